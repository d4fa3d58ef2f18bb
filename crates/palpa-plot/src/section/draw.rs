//! The picture of sections: layers in their colours, bones, tool, scale bar, and states side by
//! side.

use palpa_mesh::Vec3;

use super::shades::Shades;
use super::{Plane, Point2, Section};
use crate::canvas::{Anchor, Canvas, Font, INK, MUTED, Stroke, WHITE};
use crate::{Color, Picture};

/// Colours of the layers from the skin down, similar to real skin, fat and muscle. They also differ
/// in grey.
const LAYERS: [Color; 6] = [
    Color::rgb(0xd9, 0x9a, 0x6c),
    Color::rgb(0xf7, 0xe3, 0xa1),
    Color::rgb(0xb8, 0x5c, 0x50),
    Color::rgb(0x8f, 0xb8, 0xd8),
    Color::rgb(0x5f, 0x8f, 0x78),
    Color::rgb(0xb9, 0xa2, 0xcc),
];
const BONE: Color = Color::rgb(0xd8, 0xd4, 0xc8);
/// Colour of the rigid core where it is not bone.
const CORE: Color = Color::rgb(0xf3, 0xf2, 0xee);
const LUMP: Color = Color::rgb(0x3d, 0x6e, 0x8a);
const TOOL: Color = Color::rgb(0x33, 0x3f, 0x4d);
const WIDTH: f64 = 960.0;
const MARGIN: f64 = 24.0;
const LEGEND: f64 = 150.0;
const HEADER: f64 = 56.0;
const FOOTER: f64 = 56.0;
/// Thickness of the plate that stands for a bonded disc. m
const PLATE_THICKNESS: f64 = 2e-3;

/// One state of the body in the picture.
#[derive(Debug, Clone)]
pub struct Panel<'a> {
    /// Title of the panel, for example "at rest".
    pub title: &'a str,
    /// The cut body.
    pub section: &'a Section,
    /// The cut bones, from [`cut_surface`](super::cut_surface).
    pub bones: &'a [Vec<Point2>],
    /// The cut lumps, in the same form.
    pub lumps: &'a [Vec<Point2>],
    /// Values that shade the cells. If `None`, cells have the colours of their layers, and the edges
    /// of the elements are drawn.
    pub shades: Option<Shades<'a>>,
    /// The outline of the tool, if there is one.
    pub tool: Option<ToolOutline>,
}

/// The outline of a tool in the plane.
#[derive(Debug, Clone, PartialEq)]
pub enum ToolOutline {
    /// A thin plate, as its corners in order.
    Plate([Point2; 4]),
    /// A convex shape, as points around its rim.
    Shape(Vec<Point2>),
    /// A single node.
    Node(Point2),
}

impl ToolOutline {
    /// A disc of `radius` that presses at `centre` in `direction`; both must lie in the plane.
    pub fn disc(plane: &Plane, centre: &Vec3, direction: &Vec3, radius: f64) -> Self {
        let [x, y] = plane.project(centre);
        let [tip_x, tip_y] = plane.project(&(centre + direction));
        let length = (tip_x - x).hypot(tip_y - y);
        let [dx, dy] = if length > 0.0 {
            [(tip_x - x) / length, (tip_y - y) / length]
        } else {
            [0.0, -1.0]
        };
        let corner = |side: f64, back: f64| {
            [
                x - dy * side * radius - dx * back,
                y + dx * side * radius - dy * back,
            ]
        };
        Self::Plate([
            corner(-1.0, 0.0),
            corner(1.0, 0.0),
            corner(1.0, PLATE_THICKNESS),
            corner(-1.0, PLATE_THICKNESS),
        ])
    }

    /// A single node at `at`.
    pub fn node(plane: &Plane, at: &Vec3) -> Self {
        Self::Node(plane.project(at))
    }

    /// A convex shape, given by a point inside it in the plane and by `distance`: the distance of a
    /// point from the shape (m, negative inside). The outline stops at the distance `most` from the
    /// inner point.
    pub fn shape(plane: &Plane, inside: &Vec3, most: f64, distance: impl Fn(&Vec3) -> f64) -> Self {
        const RAYS: u32 = 240;
        let [x, y] = plane.project(inside);
        let rim = (0..RAYS).map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(RAYS)).sin_cos();
            let at = |r: f64| [x + r * cos, y + r * sin];
            let (mut near, mut far) = (0.0, most);
            for _ in 0..40 {
                let half = f64::midpoint(near, far);
                if distance(&plane.place(at(half))) < 0.0 {
                    near = half;
                } else {
                    far = half;
                }
            }
            at(far)
        });
        Self::Shape(rim.collect())
    }

    fn points(&self) -> &[Point2] {
        match self {
            Self::Shape(rim) => rim,
            Self::Plate(corners) => corners,
            Self::Node(at) => std::slice::from_ref(at),
        }
    }
}

/// Draws states of one body side by side, at the same scale.
pub fn draw(title: &str, subtitle: &str, panels: &[Panel<'_>]) -> Picture {
    let (lo, hi) = bounds(panels);
    let size = [(hi[0] - lo[0]).max(1e-6), (hi[1] - lo[1]).max(1e-6)];
    let n = panels.len().max(1) as f64;
    let gap = 24.0;
    let panel_width = (WIDTH - 2.0 * MARGIN - LEGEND - gap * n) / n;
    // A tall section is scaled down, so that the picture does not become tall.
    let scale = (panel_width / size[0]).min(620.0 / size[1]);
    let height = HEADER + 34.0 + (size[1] * scale).max(120.0) + FOOTER;
    let mut canvas = Canvas::new(WIDTH, height);
    let font = Font::new(16.0, INK, Anchor::Start).bold();
    canvas.text([MARGIN, 26.0], title, font);
    canvas.text(
        [MARGIN, 47.0],
        subtitle,
        Font::new(12.5, MUTED, Anchor::Start),
    );

    let top = HEADER + 34.0;
    for (i, panel) in panels.iter().enumerate() {
        let left = MARGIN + i as f64 * (panel_width + gap);
        let indent = (panel_width - size[0] * scale) / 2.0;
        let view = |[x, y]: Point2| {
            [
                left + indent + (x - lo[0]) * scale,
                top + (hi[1] - y) * scale,
            ]
        };
        let font = Font::new(13.0, INK, Anchor::Middle);
        canvas.text([left + panel_width / 2.0, HEADER + 14.0], panel.title, font);
        draw_panel(&mut canvas, panel, &view);
    }
    draw_legend(
        &mut canvas,
        panels,
        [WIDTH - MARGIN - LEGEND + 12.0, top + 8.0],
    );
    draw_scale_bar(&mut canvas, [MARGIN, height - 22.0], size[0], scale);
    canvas.finish()
}

fn draw_panel(canvas: &mut Canvas, panel: &Panel<'_>, view: &dyn Fn(Point2) -> Point2) {
    let seen = |points: &[Point2]| -> Vec<Point2> { points.iter().map(|&p| view(p)).collect() };
    for core in panel.section.base.iter().filter(|line| is_closed(line)) {
        canvas.polygon(&[&seen(core)], CORE, None);
    }
    let bones: Vec<Vec<Point2>> = panel.bones.iter().map(|bone| seen(bone)).collect();
    for bone in &bones {
        canvas.polygon(&[bone], BONE, Some(Stroke::new(MUTED, 1.0)));
    }
    match &panel.shades {
        Some(shades) => shades.fill(canvas, panel.section, view),
        None => {
            for cell in &panel.section.cells {
                let color = LAYERS[cell.layer % LAYERS.len()];
                // The edge has a darker shade of the layer: it shows the elements and hides the
                // seams between them.
                let edge = Stroke::new(shade(color), 0.45);
                canvas.polygon(&[&seen(&cell.outline)], color, Some(edge));
            }
        }
    }
    for lump in panel.lumps.iter().map(|lump| seen(lump)) {
        if panel.shades.is_none() {
            canvas.polygon(&[&lump], LUMP, Some(Stroke::new(INK, 1.1)));
        } else {
            canvas.polyline(&lump, Stroke::new(INK, 1.1));
        }
    }
    for border in panel.section.borders.iter().chain(&panel.section.base) {
        canvas.polyline(&seen(border), Stroke::new(INK, 1.1));
    }
    match &panel.tool {
        Some(ToolOutline::Shape(rim)) => {
            canvas.polygon(&[&seen(rim)], TOOL, Some(Stroke::new(TOOL, 1.0)));
        }
        Some(ToolOutline::Plate(corners)) => {
            canvas.polygon(&[&corners.map(view)], TOOL, Some(Stroke::new(TOOL, 1.0)));
        }
        Some(ToolOutline::Node(at)) => canvas.circle(view(*at), 5.0, TOOL, Stroke::new(WHITE, 1.5)),
        None => {}
    }
    if let Some(shades) = &panel.shades {
        shades.draw_on_skin(canvas, panel.section, view);
    }
}

fn draw_legend(canvas: &mut Canvas, panels: &[Panel<'_>], [x, mut y]: Point2) {
    let shades = panels
        .iter()
        .find_map(|panel| Some((panel.shades?, panel.section)));
    if let Some((shades, section)) = shades {
        y = shades.draw_scale(canvas, section, [x, y]);
    }
    let swatch = |y: f64| {
        [
            [x, y - 7.0],
            [x + 14.0, y - 7.0],
            [x + 14.0, y + 7.0],
            [x, y + 7.0],
        ]
    };
    let name = Font::new(12.5, INK, Anchor::Start);
    let mut entry = |color: Color, text: &str| {
        canvas.polygon(&[&swatch(y)], color, Some(Stroke::new(shade(color), 0.5)));
        canvas.text([x + 22.0, y], text, name);
        y += 22.0;
    };
    if shades.is_none() {
        let layers = panels.first().map_or(&[][..], |p| &p.section.layer_names);
        for (layer, name) in layers.iter().enumerate() {
            entry(LAYERS[layer % LAYERS.len()], name);
        }
        if panels.iter().any(|panel| !panel.lumps.is_empty()) {
            entry(LUMP, "lump");
        }
    }
    let base = panels.iter().flat_map(|panel| &panel.section.base);
    if base.into_iter().any(|line| is_closed(line)) {
        entry(CORE, "rigid core");
    }
    if panels.iter().any(|panel| !panel.bones.is_empty()) {
        entry(BONE, "bone");
    }
    if panels.iter().any(|panel| panel.tool.is_some()) {
        entry(TOOL, "tool");
    }
}

/// A scale bar of a round length, about a quarter of the section's width.
fn draw_scale_bar(canvas: &mut Canvas, [x, y]: Point2, width: f64, scale: f64) {
    let rough_mm = 250.0 * width;
    let power = 10.0_f64.powf(rough_mm.log10().floor());
    let factor = [5.0, 2.0, 1.0]
        .into_iter()
        .find(|f| f * power <= rough_mm)
        .unwrap_or(1.0);
    let length_mm = factor * power;
    let length = length_mm * 1e-3 * scale;
    let stroke = Stroke::new(INK, 1.5);
    canvas.line([x, y], [x + length, y], stroke);
    for end in [x, x + length] {
        canvas.line([end, y - 4.0], [end, y + 4.0], stroke);
    }
    let font = Font::new(12.0, INK, Anchor::Start);
    canvas.text([x + length + 8.0, y], &format!("{length_mm} mm"), font);
}

fn is_closed(line: &[Point2]) -> bool {
    line.len() > 2 && line.first() == line.last()
}

/// A darker version of a colour.
fn shade(color: Color) -> Color {
    color.mixed(INK, 0.3)
}

/// Two opposite corners of the bounding box of all panels.
fn bounds(panels: &[Panel<'_>]) -> (Point2, Point2) {
    let points = panels.iter().flat_map(|panel| {
        let cells = panel.section.cells.iter().flat_map(|cell| &cell.outline);
        let bones = panel.bones.iter().flatten();
        let tool = panel.tool.iter().flat_map(ToolOutline::points);
        cells.chain(bones).chain(tool).copied().collect::<Vec<_>>()
    });
    let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let (lo, hi) = points
        .filter(|p| p[0].is_finite() && p[1].is_finite())
        .fold(start, |(lo, hi), [x, y]| {
            ([lo[0].min(x), lo[1].min(y)], [hi[0].max(x), hi[1].max(y)])
        });
    if lo[0] > hi[0] {
        return ([0.0; 2], [0.1; 2]);
    }
    (lo, hi)
}
