//! Values as colours: cells filled smoothly, a band along the skin, and the colour scale.
//!
//! SVG has no gradients over triangles. A cell is cut into the parts of the steps of the scale, along
//! lines of equal value; the steps are too many to be seen.

use super::{Cell, CornerMeans, Point2, Section};
use crate::Color;
use crate::canvas::{Anchor, Canvas, Font, INK, MUTED, Stroke};

/// Colours from the least value to the largest: light to dark, in equal steps of lightness.
const COLORS: [Color; 6] = [
    Color::rgb(0xfc, 0xf7, 0xea),
    Color::rgb(0xf8, 0xd5, 0x9c),
    Color::rgb(0xf0, 0x9c, 0x5c),
    Color::rgb(0xd1, 0x57, 0x4f),
    Color::rgb(0x8c, 0x2a, 0x5c),
    Color::rgb(0x3b, 0x12, 0x48),
];
/// Number of steps of the scale.
const N_STEPS: usize = 96;
/// Width of the band along the skin.
const BAND: f64 = 5.0;

/// Values that shade the cells smoothly.
#[derive(Debug, Clone, Copy)]
pub struct Shades<'a> {
    /// Name of the values, with their unit: "von Mises stress, kPa".
    pub name: &'a str,
    /// The values, 0 or more.
    pub values: &'a CornerMeans,
    /// The colours of the values.
    pub scale: Scale,
    /// Values on the skin in the same unit and colours, if there are any.
    pub on_skin: Option<SkinShades<'a>>,
}

/// Values on the skin, drawn as a band along it where they are not zero.
#[derive(Debug, Clone, Copy)]
pub struct SkinShades<'a> {
    /// Name of the values: "contact pressure".
    pub name: &'a str,
    /// One value for each vertex of the skin, 0 or more.
    pub values: &'a [f64],
    /// The largest value on the whole skin, marked at the scale.
    pub largest: f64,
}

/// Which value gets which colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Colours from 0 to this value, in proportion to the value.
    Linear(f64),
    /// Colours from 0 to this value, in proportion to its square root: small values stay apart where
    /// few are large.
    Root(f64),
}

impl Scale {
    /// The value of the darkest colour.
    pub fn most(self) -> f64 {
        match self {
            Self::Linear(most) | Self::Root(most) => most,
        }
    }

    /// The place of a value on the scale, 0 to 1.
    fn share(self, value: f64) -> f64 {
        match self {
            Self::Linear(most) => (value / most).clamp(0.0, 1.0),
            Self::Root(most) => (value / most).clamp(0.0, 1.0).sqrt(),
        }
    }

    fn value(self, share: f64) -> f64 {
        match self {
            Self::Linear(most) => most * share,
            Self::Root(most) => most * share * share,
        }
    }

    fn step(self, value: f64) -> usize {
        ((self.share(value) * N_STEPS as f64) as usize).min(N_STEPS - 1)
    }

    /// The value at which a step begins.
    fn begin(self, step: usize) -> f64 {
        self.value(step as f64 / N_STEPS as f64)
    }
}

/// Colour of a step of the scale.
fn color_of(step: usize) -> Color {
    let at = (step as f64 + 0.5) / N_STEPS as f64 * (COLORS.len() - 1) as f64;
    let first = (at as usize).min(COLORS.len() - 2);
    COLORS[first].mixed(COLORS[first + 1], at - first as f64)
}

/// A point on the sheet with its value.
#[derive(Debug, Clone, Copy)]
struct Corner {
    at: Point2,
    value: f64,
}

impl Corner {
    /// The point between two corners that has this value.
    fn between(self, other: Self, value: f64) -> Self {
        let way = (value - self.value) / (other.value - self.value);
        let [x, y] = self.at;
        let [to_x, to_y] = other.at;
        Self {
            at: [x + (to_x - x) * way, y + (to_y - y) * way],
            value,
        }
    }
}

impl Shades<'_> {
    /// Fills the cells. Inside a cell, the values at its corners are interpolated linearly.
    pub(super) fn fill(
        &self,
        canvas: &mut Canvas,
        section: &Section,
        view: &dyn Fn(Point2) -> Point2,
    ) {
        let mut steps: Vec<Vec<Vec<Point2>>> = vec![Vec::new(); N_STEPS];
        for cell in &section.cells {
            let corners: Vec<Corner> = (cell.outline.iter().zip(&cell.places))
                .map(|(&at, place)| Corner {
                    at: view(at),
                    value: self.values.at(cell.prism, place),
                })
                .collect();
            let mut all = corners.iter().map(|corner| self.scale.step(corner.value));
            let step = all.next().unwrap_or(0);
            if all.all(|other| other == step) {
                steps[step].push(corners.iter().map(|corner| corner.at).collect());
                continue;
            }
            let middle = mean_of(&corners);
            for (i, &corner) in corners.iter().enumerate() {
                let next = corners[(i + 1) % corners.len()];
                self.cut_in_steps(&[middle, corner, next], &mut steps);
            }
        }
        for (step, rings) in steps.iter_mut().enumerate() {
            // All run the same way round, so that they do not cancel out where a press turns cells
            // over.
            for ring in rings.iter_mut().filter(|ring| signed_area(ring) < 0.0) {
                ring.reverse();
            }
            if !rings.is_empty() {
                canvas.patches(rings, color_of(step));
            }
        }
    }

    /// Adds the parts of a triangle to the rings of each step of the scale.
    fn cut_in_steps(&self, triangle: &[Corner; 3], steps: &mut [Vec<Vec<Point2>>]) {
        let of_corners = triangle.map(|corner| self.scale.step(corner.value));
        let (least, most) = (
            of_corners.into_iter().min().unwrap_or(0),
            of_corners.into_iter().max().unwrap_or(0),
        );
        let touched = steps.iter_mut().enumerate().take(most + 1).skip(least);
        for (step, rings) in touched {
            // The first and the last step take all values beyond the scale.
            let mut part = triangle.to_vec();
            if step > least {
                let begin = self.scale.begin(step);
                part = clipped(&part, begin, |value| value >= begin);
            }
            if step < most {
                let end = self.scale.begin(step + 1);
                part = clipped(&part, end, |value| value <= end);
            }
            if part.len() >= 3 {
                rings.push(part.iter().map(|corner| corner.at).collect());
            }
        }
    }

    /// Draws the values on the skin as a band outside it.
    pub(super) fn draw_on_skin(
        &self,
        canvas: &mut Canvas,
        section: &Section,
        view: &dyn Fn(Point2) -> Point2,
    ) {
        let Some(on_skin) = self.on_skin else {
            return;
        };
        let at_node = |node: usize| on_skin.values[node / section.n_levels];
        let is_on_skin = |cell: &Cell, i: usize| {
            let mut nodes = cell.places[i].nodes.into_iter();
            nodes.all(|node| node.is_multiple_of(section.n_levels))
        };
        for cell in &section.cells {
            let n = cell.places.len();
            for ends in (0..n).map(|i| [i, (i + 1) % n]) {
                if !ends.into_iter().all(|i| is_on_skin(cell, i)) {
                    continue;
                }
                let [dx, dy] = outward(cell, ends, view).map(|d| 0.5 * BAND * d);
                let [from, to] = ends.map(|i| {
                    let [x, y] = view(cell.outline[i]);
                    Corner {
                        at: [x + dx, y + dy],
                        value: cell.places[i].value(at_node),
                    }
                });
                self.draw_band(canvas, from, to);
            }
        }
    }

    /// Draws a line whose value changes linearly. The lightest step is left out: it stands for none.
    fn draw_band(&self, canvas: &mut Canvas, from: Corner, to: Corner) {
        let [first, last] = [from, to].map(|corner| self.scale.step(corner.value));
        for step in first.min(last).max(1)..=first.max(last) {
            let (begin, end) = (self.scale.begin(step), self.scale.begin(step + 1));
            // Of a line, too, the part of a step is what is left after two cuts.
            let inside = |corner: Corner, other: Corner| match corner.value {
                value if value < begin => corner.between(other, begin),
                value if value > end && step < first.max(last) => corner.between(other, end),
                _ => corner,
            };
            let line = [inside(from, to).at, inside(to, from).at];
            canvas.polyline(&line, Stroke::new(color_of(step), BAND));
        }
    }

    /// Draws the colour scale, and returns the height below it.
    pub(super) fn draw_scale(&self, canvas: &mut Canvas, section: &Section, [x, y]: Point2) -> f64 {
        const HEIGHT: f64 = 150.0;
        const WIDTH: f64 = 14.0;
        const LABELS: u32 = 5;
        let small = Font::new(11.5, MUTED, Anchor::Start);
        canvas.text([x, y], self.name, small);
        let top = y + 18.0;
        let height_of = |share: f64| top + HEIGHT * (1.0 - share);
        for step in 0..N_STEPS {
            let [from, to] = [step, step + 1].map(|step| height_of(step as f64 / N_STEPS as f64));
            let ring = [[x, from], [x + WIDTH, from], [x + WIDTH, to], [x, to]];
            canvas.patches(&[ring.to_vec()], color_of(step));
        }
        let most = self.scale.most();
        let mut values = self.values.in_section(section).into_iter();
        let is_over = values.any(|value| value > most * (1.0 + 1e-9));
        for i in 0..=LABELS {
            let share = f64::from(i) / f64::from(LABELS);
            let at = height_of(share);
            let over = if i == LABELS && is_over { "≥ " } else { "" };
            canvas.line(
                [x + WIDTH, at],
                [x + WIDTH + 4.0, at],
                Stroke::new(INK, 1.0),
            );
            let text = format!("{over}{}", rounded(self.scale.value(share)));
            canvas.text([x + 22.0, at], &text, Font::new(12.5, INK, Anchor::Start));
        }
        let below = top + HEIGHT + 22.0;
        let Some(on_skin) = &self.on_skin else {
            return below;
        };
        // A pointer at the largest value, and what it stands for.
        let pointer = |x: f64, y: f64| [[x, y - 4.0], [x + 7.0, y], [x, y + 4.0]];
        let at = height_of(self.scale.share(on_skin.largest));
        canvas.polygon(&[&pointer(x - 8.0, at)], INK, None);
        canvas.polygon(&[&pointer(x, below)], INK, None);
        canvas.text(
            [x + 12.0, below],
            &format!("{} (band):", on_skin.name),
            small,
        );
        let largest = format!("largest {}", rounded(on_skin.largest));
        canvas.text([x + 12.0, below + 15.0], &largest, small);
        below + 40.0
    }
}

fn mean_of(corners: &[Corner]) -> Corner {
    let n = corners.len().max(1) as f64;
    let mean = |of: fn(&Corner) -> f64| corners.iter().map(of).sum::<f64>() / n;
    Corner {
        at: [mean(|c| c.at[0]), mean(|c| c.at[1])],
        value: mean(|c| c.value),
    }
}

/// The part of a convex polygon on one side of the line where its linear value is `border`.
fn clipped(polygon: &[Corner], border: f64, is_inside: impl Fn(f64) -> bool) -> Vec<Corner> {
    let mut part = Vec::with_capacity(polygon.len() + 1);
    for (i, &corner) in polygon.iter().enumerate() {
        let next = polygon[(i + 1) % polygon.len()];
        if is_inside(corner.value) {
            part.push(corner);
        }
        if is_inside(corner.value) != is_inside(next.value) {
            part.push(corner.between(next, border));
        }
    }
    part
}

/// Twice the area of a ring, positive for one of the two ways round.
fn signed_area(ring: &[Point2]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter()
        .zip(next)
        .map(|(p, q)| p[0] * q[1] - p[1] * q[0])
        .sum()
}

/// The unit vector on the sheet that points out of a cell across the side between two corners.
fn outward(cell: &Cell, side: [usize; 2], view: &dyn Fn(Point2) -> Point2) -> Point2 {
    let n = cell.outline.len().max(1) as f64;
    let seen = cell.outline.iter().map(|&p| view(p));
    let middle = seen.fold([0.0; 2], |[x, y], p| [x + p[0] / n, y + p[1] / n]);
    let [p, q] = side.map(|i| view(cell.outline[i]));
    let [x, y] = [q[1] - p[1], p[0] - q[0]];
    let is_inward = x * (middle[0] - p[0]) + y * (middle[1] - p[1]) > 0.0;
    let length = x.hypot(y).max(f64::MIN_POSITIVE) * if is_inward { -1.0 } else { 1.0 };
    [x / length, y / length]
}

/// A value with three significant digits.
fn rounded(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(values: [f64; 3]) -> [Corner; 3] {
        let places = [[0.0, 0.0], [40.0, 0.0], [0.0, 30.0]];
        std::array::from_fn(|i| Corner {
            at: places[i],
            value: values[i],
        })
    }

    #[test]
    fn the_parts_of_a_triangle_tile_it_and_have_the_areas_of_their_values() {
        let means = CornerMeans::default();
        for scale in [Scale::Linear(2.0), Scale::Root(2.0)] {
            let shades = Shades {
                name: "",
                values: &means,
                scale,
                on_skin: None,
            };
            // Beyond the scale on both sides, falling and rising, and all alike.
            for values in [[0.0, 2.0, 1.0], [3.0, 0.1, 0.1], [-1.0, 0.5, 4.0], [0.7; 3]] {
                let mut steps = vec![Vec::new(); N_STEPS];
                shades.cut_in_steps(&triangle(values), &mut steps);
                let area = |rings: &Vec<Vec<Point2>>| -> f64 {
                    rings.iter().map(|ring| signed_area(ring).abs()).sum()
                };
                let whole: f64 = steps.iter().map(area).sum();
                assert!(
                    (whole - 1200.0).abs() < 1e-9,
                    "{scale:?} {values:?}: {whole}"
                );
            }
            // A value that grows evenly along one side: the part below a value v is that of a strip,
            // 1 − (1 − v/2)².
            let mut steps = vec![Vec::new(); N_STEPS];
            shades.cut_in_steps(&triangle([0.0, 2.0, 0.0]), &mut steps);
            let end = N_STEPS / 3;
            let below: f64 = (steps[..end].iter().flatten())
                .map(|ring| signed_area(ring).abs())
                .sum();
            let value = scale.begin(end);
            let expected = 1200.0 * (1.0 - (1.0 - 0.5 * value).powi(2));
            assert!(
                (below - expected).abs() < 1e-9,
                "{scale:?}: {below} for {expected}"
            );
        }
    }

    #[test]
    fn a_scale_goes_to_its_value_and_back() {
        for scale in [Scale::Linear(320.0), Scale::Root(320.0)] {
            for step in 0..N_STEPS {
                let inside = f64::midpoint(scale.begin(step), scale.begin(step + 1));
                assert_eq!(scale.step(inside), step, "{scale:?}");
            }
            assert_eq!((scale.step(-1.0), scale.step(1e9)), (0, N_STEPS - 1));
        }
        assert!(Scale::Root(320.0).step(10.0) > 4 * Scale::Linear(320.0).step(10.0));
    }
}
