//! Line charts: one, or several in one picture.

use crate::axis::{Axis, Fit, power_of_ten};
use crate::canvas::{Anchor, Canvas, Color, Font, Frame, GRID, INK, MUTED, Stroke, WHITE};
use crate::picture::{PALETTE, Picture};

const TITLE: Font = Font::new(16.0, INK, Anchor::Start).bold();
const PANEL_TITLE: Font = Font::new(13.5, INK, Anchor::Start).bold();
const SUBTITLE: Font = Font::new(12.5, MUTED, Anchor::Start);
const LABEL: Font = Font::new(13.0, INK, Anchor::Middle);
const TICK: Font = Font::new(12.0, MUTED, Anchor::Middle);
const NAME: Font = Font::new(12.5, INK, Anchor::Start);
const REMARK: Font = Font::new(11.5, MUTED, Anchor::Start);

const AXIS_LINE: Stroke = Stroke::new(Color::rgb(0x99, 0x99, 0x99), 1.0);
const GUIDE_LINE: Stroke = Stroke {
    color: MUTED,
    width: 1.0,
    dashes: "2 3",
};
const LINE_WIDTH: f64 = 2.0;
/// Length of the line sample before a series' name, and the gap around it.
const SAMPLE: f64 = 20.0;
const GAP: f64 = 7.0;
const NAME_HEIGHT: f64 = 18.0;
/// Between guides closer than this, there is no room for a name.
const GUIDE_ROOM: f64 = 18.0;

/// A point of a chart: `[x, y]`.
type Point = [f64; 2];

/// A line through points, with its name.
#[derive(Debug, Clone)]
pub struct Series {
    name: String,
    points: Vec<Point>,
    /// `[x, lowest, highest]`
    spread: Vec<[f64; 3]>,
    color: Option<Color>,
    dashes: &'static str,
    has_line: bool,
    has_markers: bool,
}

impl Series {
    /// A solid line. Points that are not finite leave a gap. An empty name is not shown.
    pub fn new(name: impl Into<String>, points: Vec<Point>) -> Self {
        Self {
            name: name.into(),
            points,
            spread: Vec::new(),
            color: None,
            dashes: "",
            has_line: true,
            has_markers: false,
        }
    }

    /// Draws a dashed line: for a reference or a fit.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dashes = "6 4";
        self
    }

    /// Adds a dot at every point.
    #[must_use]
    pub fn with_markers(mut self) -> Self {
        self.has_markers = true;
        self
    }

    /// Draws dots only: for measurements.
    #[must_use]
    pub fn only_markers(mut self) -> Self {
        self.has_line = false;
        self.with_markers()
    }

    /// Sets the colour; without it a series takes the next of [`PALETTE`].
    #[must_use]
    pub fn with_color(mut self, color: Color) -> Self {
        self.color = Some(color);
        self
    }

    /// Adds a shaded band between the lowest and highest values: `[x, lowest, highest]`.
    #[must_use]
    pub fn with_spread(mut self, spread: Vec<[f64; 3]>) -> Self {
        self.spread = spread;
        self
    }
}

/// A shaded range of an axis, with its name inside.
#[derive(Debug, Clone)]
pub struct Band {
    range: [f64; 2],
    name: String,
    color: Color,
}

impl Band {
    /// The range `from..to` of the x axis, for example the depth of a layer.
    pub fn x(from: f64, to: f64, name: impl Into<String>, color: Color) -> Self {
        Self {
            range: [from, to],
            name: name.into(),
            color,
        }
    }
}

/// A dotted line across the chart, with its name beside it.
#[derive(Debug, Clone)]
pub struct Guide {
    at: f64,
    is_vertical: bool,
    is_named_right: bool,
    name: String,
}

impl Guide {
    /// A vertical line.
    pub fn x(at: f64, name: impl Into<String>) -> Self {
        Self {
            at,
            is_vertical: true,
            is_named_right: false,
            name: name.into(),
        }
    }

    /// A horizontal line.
    pub fn y(at: f64, name: impl Into<String>) -> Self {
        Self {
            is_vertical: false,
            ..Self::x(at, name)
        }
    }

    /// Puts the name of a horizontal line at its right end: for curves that cross the line at its
    /// left end.
    #[must_use]
    pub fn named_right(mut self) -> Self {
        self.is_named_right = true;
        self
    }
}

/// A line chart.
#[derive(Debug, Clone)]
pub struct Chart {
    title: String,
    subtitle: String,
    x: Axis,
    y: Axis,
    series: Vec<Series>,
    bands: Vec<Band>,
    guides: Vec<Guide>,
    notes: Vec<(Point, String)>,
}

impl Chart {
    /// An empty chart.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self {
            title: String::new(),
            subtitle: String::new(),
            x,
            y,
            series: Vec::new(),
            bands: Vec::new(),
            guides: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Sets the title: what the chart shows.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Sets the line under the title: the body and the conditions.
    #[must_use]
    pub fn subtitle(mut self, subtitle: impl Into<String>) -> Self {
        self.subtitle = subtitle.into();
        self
    }

    /// Adds a solid line.
    #[must_use]
    pub fn line(self, name: impl Into<String>, points: Vec<Point>) -> Self {
        self.series(Series::new(name, points))
    }

    /// Adds a series.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds a shaded range.
    #[must_use]
    pub fn band(mut self, band: Band) -> Self {
        self.bands.push(band);
        self
    }

    /// Adds a dotted line.
    #[must_use]
    pub fn guide(mut self, guide: Guide) -> Self {
        self.guides.push(guide);
        self
    }

    /// Adds a circle at a point, with a remark beside it.
    #[must_use]
    pub fn note(mut self, at: Point, remark: impl Into<String>) -> Self {
        self.notes.push((at, remark.into()));
        self
    }

    /// Draws the chart, 960 × 600.
    pub fn draw(&self) -> Picture {
        let mut canvas = Canvas::new(960.0, 600.0);
        let frame = Frame {
            x: 24.0,
            y: 20.0,
            width: 912.0,
            height: 564.0,
        };
        self.draw_in(&mut canvas, frame, TITLE, [0.0; 2]);
        canvas.finish()
    }

    /// The left and right margins that the labels of the plot need.
    fn margins(&self, frame: Frame) -> [f64; 2] {
        let y = self.y.fit(self.values(1), n_y_ticks(frame), true);
        let tick_width = widest(TICK, y.ticks.iter().map(|(_, label)| label.as_str()));
        let names = widest(NAME, self.series.iter().map(|s| s.name.as_str()));
        let right = if names > 0.0 {
            GAP + SAMPLE + GAP + names
        } else {
            12.0
        };
        [22.0 + tick_width + 8.0, right]
    }

    /// Draws the chart with at least the margins `least`.
    fn draw_in(&self, canvas: &mut Canvas, frame: Frame, title: Font, least: [f64; 2]) {
        let header = self.draw_header(canvas, frame, title);
        let n_x = (frame.width / 100.0).max(3.0);
        let x = self.x.fit(self.values(0), n_x, false);
        let y = self.y.fit(self.values(1), n_y_ticks(frame), true);
        let own = self.margins(frame);
        let [left, right] = [0, 1].map(|side: usize| own[side].max(least[side]));
        let plot = Frame {
            x: frame.x + left,
            y: frame.y + header,
            width: (frame.width - left - right).max(40.0),
            height: (frame.height - header - 46.0).max(40.0),
        };
        let view = View { plot, x: &x, y: &y };
        self.draw_bands(canvas, &view);
        self.draw_axes(canvas, &view, frame);
        self.draw_guides(canvas, &view);
        canvas.clipped(grown(plot, 5.0), |canvas| {
            for (series, color) in self.colored() {
                self.draw_series(canvas, &view, series, color);
            }
        });
        self.draw_notes(canvas, &view);
        self.draw_names(canvas, &view);
    }

    fn draw_header(&self, canvas: &mut Canvas, frame: Frame, title: Font) -> f64 {
        let mut y = 0.0;
        for (text, font, height) in [
            (&self.title, title, 1.5 * title.size),
            (&self.subtitle, SUBTITLE, 20.0),
        ] {
            if !text.is_empty() {
                canvas.text([frame.x, frame.y + y + 8.0], text, font);
                y += height;
            }
        }
        y + 16.0
    }

    fn draw_axes(&self, canvas: &mut Canvas, view: &View<'_>, frame: Frame) {
        let plot = view.plot;
        let grid = Stroke::new(GRID, 1.0);
        let faint = Stroke::new(GRID.tint(0.5), 1.0);
        let column = |canvas: &mut Canvas, x: f64, stroke| {
            canvas.line([x, plot.y], [x, plot.bottom()], stroke);
        };
        let row = |canvas: &mut Canvas, y: f64, stroke| {
            canvas.line([plot.x, y], [plot.right(), y], stroke);
        };
        for &value in &view.x.minor {
            column(canvas, view.x_of(value), faint);
        }
        for &value in &view.y.minor {
            row(canvas, view.y_of(value), faint);
        }
        for (value, label) in &view.x.ticks {
            let x = view.x_of(*value);
            column(canvas, x, grid);
            canvas.text([x, plot.bottom() + 14.0], label, TICK);
        }
        for (value, label) in &view.y.ticks {
            let y = view.y_of(*value);
            row(canvas, y, grid);
            let font = Font {
                anchor: Anchor::End,
                ..TICK
            };
            canvas.text([plot.x - 8.0, y], label, font);
        }
        row(canvas, plot.bottom(), AXIS_LINE);
        column(canvas, plot.x, AXIS_LINE);

        let middle = [plot.x + plot.width / 2.0, plot.y + plot.height / 2.0];
        canvas.text(
            [middle[0], plot.bottom() + 36.0],
            &scaled(&self.x, view.x),
            LABEL,
        );
        canvas.text(
            [frame.x + 8.0, middle[1]],
            &scaled(&self.y, view.y),
            LABEL.upward(),
        );
    }

    fn draw_bands(&self, canvas: &mut Canvas, view: &View<'_>) {
        for band in &self.bands {
            let [from, to] = band
                .range
                .map(|value| view.x.place(value).clamp(0.0, 1.0) * view.plot.width);
            let width = to - from;
            if width.is_nan() || width <= 0.0 {
                continue;
            }
            let frame = Frame {
                x: view.plot.x + from,
                width,
                ..view.plot
            };
            canvas.rect(frame, band.color.tint(0.13));
            let middle = frame.x + width / 2.0;
            if REMARK.width(&band.name) + 8.0 < width {
                let font = Font {
                    anchor: Anchor::Middle,
                    ..REMARK
                };
                canvas.text([middle, frame.y + 11.0], &band.name, font);
            } else if width >= 13.0 {
                let font = Font {
                    anchor: Anchor::End,
                    ..REMARK.upward()
                };
                canvas.text([middle, frame.y + 6.0], &band.name, font);
            }
        }
    }

    fn draw_guides(&self, canvas: &mut Canvas, view: &View<'_>) {
        let plot = view.plot;
        for guide in &self.guides {
            if guide.is_vertical && (0.0..=1.0).contains(&view.x.place(guide.at)) {
                let x = view.x_of(guide.at);
                canvas.line([x, plot.y], [x, plot.bottom()], GUIDE_LINE);
                let is_late = x + 5.0 + REMARK.width(&guide.name) > plot.right();
                let (x, anchor) = if is_late {
                    (x - 5.0, Anchor::End)
                } else {
                    (x + 5.0, Anchor::Start)
                };
                canvas.text(
                    [x, plot.bottom() - 11.0],
                    &guide.name,
                    Font { anchor, ..REMARK },
                );
            } else if !guide.is_vertical && (0.0..=1.0).contains(&view.y.place(guide.at)) {
                let y = view.y_of(guide.at);
                canvas.line([plot.x, y], [plot.right(), y], GUIDE_LINE);
                let (x, anchor) = if guide.is_named_right {
                    (plot.right() - 6.0, Anchor::End)
                } else {
                    (plot.x + 6.0, Anchor::Start)
                };
                // The name goes above the line, or below it if it would touch the next line above.
                let is_close = |other: &Guide| {
                    let above = y - view.y_of(other.at);
                    !other.is_vertical && above > 0.0 && above < GUIDE_ROOM
                };
                let drop = if self.guides.iter().any(is_close) {
                    9.0
                } else {
                    -9.0
                };
                canvas.text([x, y + drop], &guide.name, Font { anchor, ..REMARK });
            }
        }
    }

    fn draw_series(&self, canvas: &mut Canvas, view: &View<'_>, series: &Series, color: Color) {
        let lower = series.spread.iter().map(|&[x, low, _]| [x, low]);
        let upper = series.spread.iter().map(|&[x, _, high]| [x, high]);
        let ring: Vec<Point> = lower
            .chain(upper.rev())
            .filter(|&point| self.shows(point))
            .map(|point| view.point(point))
            .collect();
        if ring.len() > 2 {
            canvas.veil(&ring, color, 0.2);
        }
        if series.has_line {
            for run in series.points.split(|&point| !self.shows(point)) {
                let line: Vec<Point> = run.iter().map(|&point| view.point(point)).collect();
                match line[..] {
                    [] => {}
                    // A single point between gaps has no line, so a dot of the line's width shows
                    // it.
                    [point] => canvas.circle(point, LINE_WIDTH / 2.0, color, stroke(series, color)),
                    _ => canvas.polyline(&line, stroke(series, color)),
                }
            }
        }
        if series.has_markers {
            for &point in series.points.iter().filter(|&&point| self.shows(point)) {
                canvas.circle(view.point(point), 3.5, color, Stroke::new(WHITE, 1.0));
            }
        }
    }

    fn draw_notes(&self, canvas: &mut Canvas, view: &View<'_>) {
        for (at, remark) in &self.notes {
            if !self.shows(*at) {
                continue;
            }
            let [x, y] = view.point(*at);
            canvas.circle([x, y], 5.0, WHITE, Stroke::new(INK, 1.5));
            let is_late = x + 10.0 + REMARK.width(remark) > view.plot.right();
            let (x, anchor) = if is_late {
                (x - 10.0, Anchor::End)
            } else {
                (x + 10.0, Anchor::Start)
            };
            let font = Font {
                anchor,
                color: INK,
                has_rim: true,
                ..REMARK
            };
            // Below the line on its right, above it on its left: so the remark is clear of a rising
            // curve.
            let drop = if is_late { -9.0 } else { 9.0 };
            canvas.text([x, y + drop], remark, font);
        }
    }

    /// Writes the names of the series at the right, each at the height where its line ends.
    fn draw_names(&self, canvas: &mut Canvas, view: &View<'_>) {
        let plot = view.plot;
        let mut names: Vec<(f64, &Series, Color)> = self
            .colored()
            .filter(|(series, _)| !series.name.is_empty())
            .map(|(series, color)| {
                let end = series
                    .points
                    .iter()
                    .filter(|&&point| self.shows(point))
                    .fold(None, |end: Option<&Point>, point| match end {
                        Some(end) if end[0] > point[0] => Some(end),
                        _ => Some(point),
                    });
                let y = end.map_or(plot.bottom(), |&end| view.point(end)[1]);
                (y.clamp(plot.y, plot.bottom()), series, color)
            })
            .collect();
        names.sort_by(|a, b| a.0.total_cmp(&b.0));
        // First downward so that names do not overlap, then upward so that the last one stays
        // inside.
        for i in 1..names.len() {
            names[i].0 = names[i].0.max(names[i - 1].0 + NAME_HEIGHT);
        }
        let mut limit = plot.bottom();
        for name in names.iter_mut().rev() {
            name.0 = name.0.min(limit);
            limit = name.0 - NAME_HEIGHT;
        }
        for (y, series, color) in names {
            let x = plot.right() + GAP;
            if series.has_line {
                canvas.line([x, y], [x + SAMPLE, y], stroke(series, color));
            }
            if series.has_markers {
                canvas.circle([x + SAMPLE / 2.0, y], 3.5, color, Stroke::new(WHITE, 1.0));
            }
            canvas.text([x + SAMPLE + GAP, y], &series.name, NAME);
        }
    }

    fn colored(&self) -> impl Iterator<Item = (&Series, Color)> {
        self.series
            .iter()
            .enumerate()
            .map(|(i, series)| (series, series.color.unwrap_or(PALETTE[i % PALETTE.len()])))
    }

    fn shows(&self, [x, y]: Point) -> bool {
        self.x.shows(x) && self.y.shows(y)
    }

    /// All values along one axis.
    fn values(&self, axis: usize) -> impl Iterator<Item = f64> {
        self.series.iter().flat_map(move |series| {
            let points = series.points.iter().filter(|&&point| self.shows(point));
            let spread = series
                .spread
                .iter()
                .flat_map(|&[x, low, high]| [[x, low], [x, high]]);
            points.copied().chain(spread).map(move |point| point[axis])
        })
    }
}

/// Draws several charts in one picture, row by row.
pub fn panels(title: &str, charts: &[Chart], n_columns: usize) -> Picture {
    const WIDTH: f64 = 530.0;
    const HEIGHT: f64 = 376.0;
    const MARGIN: f64 = 26.0;
    const LINE: f64 = 24.0;
    let n_columns = n_columns.clamp(1, charts.len().max(1));
    let n_rows = charts.len().div_ceil(n_columns);
    let font = Font {
        size: 19.0,
        ..TITLE
    };
    let lines = wrapped(title, font, n_columns as f64 * WIDTH - MARGIN);
    let header = match lines.len() {
        0 => 0.0,
        n => 38.0 + (n - 1) as f64 * LINE,
    };
    let mut canvas = Canvas::new(
        n_columns as f64 * WIDTH + MARGIN,
        n_rows as f64 * HEIGHT + MARGIN + header,
    );
    for (i, line) in lines.iter().enumerate() {
        canvas.text([MARGIN, MARGIN + 10.0 + i as f64 * LINE], line, font);
    }
    // Charts in a single column get the same margins, so that their x axes line up.
    let least = match n_columns {
        1 => charts.iter().fold([0.0_f64; 2], |least, chart| {
            let own = chart.margins(Frame {
                x: 0.0,
                y: 0.0,
                width: WIDTH - MARGIN,
                height: HEIGHT - MARGIN,
            });
            [0, 1].map(|side| least[side].max(own[side]))
        }),
        _ => [0.0; 2],
    };
    for (i, chart) in charts.iter().enumerate() {
        let frame = Frame {
            x: MARGIN + (i % n_columns) as f64 * WIDTH,
            y: MARGIN + header + (i / n_columns) as f64 * HEIGHT,
            width: WIDTH - MARGIN,
            height: HEIGHT - MARGIN,
        };
        chart.draw_in(&mut canvas, frame, PANEL_TITLE, least);
    }
    canvas.finish()
}

fn n_y_ticks(frame: Frame) -> f64 {
    (frame.height / 75.0).max(3.0)
}

/// Splits text into lines no wider than `width`, unless a single word is wider.
fn wrapped(text: &str, font: Font, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let longer = lines.last().map(|line| format!("{line} {word}"));
        match (longer, lines.last_mut()) {
            (Some(longer), Some(line)) if font.width(&longer) <= width => *line = longer,
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The area in which values are drawn, with its axes.
struct View<'a> {
    plot: Frame,
    x: &'a Fit,
    y: &'a Fit,
}

impl View<'_> {
    fn x_of(&self, value: f64) -> f64 {
        self.plot.x + self.x.place(value) * self.plot.width
    }

    fn y_of(&self, value: f64) -> f64 {
        self.plot.bottom() - self.y.place(value) * self.plot.height
    }

    /// The place of a point. A point far outside is clamped: it only shows where its line leaves
    /// the chart.
    fn point(&self, [x, y]: Point) -> Point {
        [self.x_of(x).clamp(-1e5, 1e5), self.y_of(y).clamp(-1e5, 1e5)]
    }
}

fn stroke(series: &Series, color: Color) -> Stroke {
    Stroke {
        color,
        width: LINE_WIDTH,
        dashes: series.dashes,
    }
}

/// The axis label, including the common power of ten of the tick labels.
fn scaled(axis: &Axis, fit: &Fit) -> String {
    match fit.exponent {
        0 => axis.label.clone(),
        exponent => format!("{}  (× {})", axis.label, power_of_ten(exponent)),
    }
}

fn widest<'a>(font: Font, texts: impl Iterator<Item = &'a str>) -> f64 {
    texts.map(|text| font.width(text)).fold(0.0, f64::max)
}

fn grown(frame: Frame, by: f64) -> Frame {
    Frame {
        x: frame.x - by,
        y: frame.y - by,
        width: frame.width + 2.0 * by,
        height: frame.height + 2.0 * by,
    }
}
