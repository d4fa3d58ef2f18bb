//! The few SVG shapes that the pictures are made of.

use std::fmt::{self, Write as _};

use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider as _};

use crate::picture::Picture;

/// Inter, reduced to Latin, Greek and mathematical characters. Its licence is in the same folder.
pub(crate) const FONTS: [&[u8]; 2] = [
    include_bytes!("../fonts/Inter-Regular.ttf"),
    include_bytes!("../fonts/Inter-SemiBold.ttf"),
];

pub(crate) const INK: Color = Color::rgb(0x22, 0x22, 0x22);
pub(crate) const MUTED: Color = Color::rgb(0x66, 0x66, 0x66);
pub(crate) const GRID: Color = Color::rgb(0xe4, 0xe4, 0xe4);
pub(crate) const WHITE: Color = Color::rgb(0xff, 0xff, 0xff);

/// An opaque sRGB colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Color([u8; 3]);

impl Color {
    /// A colour from red, green and blue, 0 to 255 each.
    pub const fn rgb(r: u8, g: u8, b: u8) -> Self {
        Self([r, g, b])
    }

    /// This colour mixed with white: `share` 0 gives white, 1 the colour itself.
    #[must_use]
    pub fn tint(self, share: f64) -> Self {
        WHITE.mixed(self, share)
    }

    /// This colour mixed with another, whose share is 0 to 1.
    #[must_use]
    pub fn mixed(self, other: Self, share: f64) -> Self {
        let share = share.clamp(0.0, 1.0);
        #[expect(clippy::cast_sign_loss, reason = "between two values of 0..=255")]
        let mix = |i: usize| {
            (f64::from(self.0[i]) * (1.0 - share) + f64::from(other.0[i]) * share).round() as u8
        };
        Self([mix(0), mix(1), mix(2)])
    }
}

impl fmt::Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [r, g, b] = self.0;
        write!(f, "#{r:02x}{g:02x}{b:02x}")
    }
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stroke {
    pub(crate) color: Color,
    pub(crate) width: f64,
    /// Lengths of dash and gap; empty for a solid line.
    pub(crate) dashes: &'static str,
}

impl Stroke {
    pub(crate) const fn new(color: Color, width: f64) -> Self {
        Self {
            color,
            width,
            dashes: "",
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// How text is set. The position of a text is the middle of its height.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Font {
    pub(crate) size: f64,
    pub(crate) is_bold: bool,
    pub(crate) color: Color,
    pub(crate) anchor: Anchor,
    pub(crate) is_upward: bool,
    /// Whether the text has a white outline, which keeps it readable across lines.
    pub(crate) has_rim: bool,
}

impl Font {
    pub(crate) const fn new(size: f64, color: Color, anchor: Anchor) -> Self {
        Self {
            size,
            is_bold: false,
            color,
            anchor,
            is_upward: false,
            has_rim: false,
        }
    }

    pub(crate) const fn bold(mut self) -> Self {
        self.is_bold = true;
        self
    }

    pub(crate) const fn upward(mut self) -> Self {
        self.is_upward = true;
        self
    }

    /// Width of `text`, without kerning.
    pub(crate) fn width(&self, text: &str) -> f64 {
        let font = FontRef::new(FONTS[usize::from(self.is_bold)])
            .expect("the font is compiled in and is valid");
        let metrics = font.glyph_metrics(Size::new(self.size as f32), LocationRef::default());
        let glyphs = font.charmap();
        text.chars()
            .map(|c| metrics.advance_width(glyphs.map(c).unwrap_or_default()))
            .map(|advance| f64::from(advance.unwrap_or(0.0)))
            .sum()
    }
}

/// A rectangle of the picture; y points downward.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Frame {
    pub(crate) fn right(&self) -> f64 {
        self.x + self.width
    }

    pub(crate) fn bottom(&self) -> f64 {
        self.y + self.height
    }
}

/// A white sheet to draw shapes on, in SVG units (96 to the inch); y points downward.
#[derive(Debug)]
pub(crate) struct Canvas {
    width: f64,
    height: f64,
    body: String,
    n_clips: usize,
}

/// Writing to a `String` cannot fail.
macro_rules! put {
    ($canvas:expr, $($arg:tt)*) => {
        let _ = writeln!($canvas.body, $($arg)*);
    };
}

impl Canvas {
    pub(crate) fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            body: String::new(),
            n_clips: 0,
        }
    }

    pub(crate) fn line(&mut self, from: [f64; 2], to: [f64; 2], stroke: Stroke) {
        self.polyline(&[from, to], stroke);
    }

    pub(crate) fn polyline(&mut self, points: &[[f64; 2]], stroke: Stroke) {
        let Stroke {
            color,
            width,
            dashes,
        } = stroke;
        put!(
            self,
            r#"<path d="{}" fill="none" stroke="{color}" stroke-width="{width}" stroke-dasharray="{}" stroke-linejoin="round" stroke-linecap="{}"/>"#,
            path(points, false),
            if dashes.is_empty() { "none" } else { dashes },
            if dashes.is_empty() { "round" } else { "butt" },
        );
    }

    /// Fills closed rings together, by the even-odd rule.
    pub(crate) fn polygon(&mut self, rings: &[&[[f64; 2]]], fill: Color, stroke: Option<Stroke>) {
        let d: String = rings.iter().map(|ring| path(ring, true)).collect();
        let edge = stroke.map_or_else(String::new, |s| {
            format!(
                r#" stroke="{}" stroke-width="{}" stroke-linejoin="round""#,
                s.color, s.width
            )
        });
        put!(
            self,
            r#"<path d="{d}" fill="{fill}" fill-rule="evenodd"{edge}/>"#
        );
    }

    /// Fills closed rings that lie side by side with one colour, without seams between them. All
    /// must run the same way round.
    pub(crate) fn patches(&mut self, rings: &[Vec<[f64; 2]>], fill: Color) {
        let d: String = rings.iter().map(|ring| path(ring, true)).collect();
        put!(
            self,
            r#"<path d="{d}" fill="{fill}" stroke="{fill}" stroke-width="0.6" stroke-linejoin="round"/>"#
        );
    }

    /// Fills a closed ring with a translucent colour.
    pub(crate) fn veil(&mut self, ring: &[[f64; 2]], fill: Color, opacity: f64) {
        let d = path(ring, true);
        put!(
            self,
            r#"<path d="{d}" fill="{fill}" fill-opacity="{opacity}"/>"#
        );
    }

    pub(crate) fn rect(&mut self, frame: Frame, fill: Color) {
        let Frame {
            x,
            y,
            width,
            height,
        } = frame;
        put!(
            self,
            r#"<rect x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{height:.2}" fill="{fill}"/>"#
        );
    }

    pub(crate) fn circle(&mut self, [x, y]: [f64; 2], radius: f64, fill: Color, edge: Stroke) {
        put!(
            self,
            r#"<circle cx="{x:.2}" cy="{y:.2}" r="{radius:.2}" fill="{fill}" stroke="{}" stroke-width="{}"/>"#,
            edge.color,
            edge.width
        );
    }

    pub(crate) fn text(&mut self, [x, y]: [f64; 2], text: &str, font: Font) {
        let anchor = match font.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        // Inter's capitals and digits are 0.73 em high.
        let drop = 0.365 * font.size;
        let place = if font.is_upward {
            format!(
                r#"transform="translate({:.2} {y:.2}) rotate(-90)""#,
                x + drop
            )
        } else {
            format!(r#"x="{x:.2}" y="{:.2}""#, y + drop)
        };
        let rim = if font.has_rim {
            format!(
                r#" stroke="{WHITE}" stroke-width="3" stroke-linejoin="round" paint-order="stroke""#
            )
        } else {
            String::new()
        };
        put!(
            self,
            r#"<text {place} font-size="{}" font-weight="{}" fill="{}"{rim} text-anchor="{anchor}">{}</text>"#,
            font.size,
            if font.is_bold { 600 } else { 400 },
            font.color,
            escaped(text)
        );
    }

    /// Clips everything that `draw` draws to `frame`.
    pub(crate) fn clipped(&mut self, frame: Frame, draw: impl FnOnce(&mut Self)) {
        let id = self.n_clips;
        self.n_clips += 1;
        let Frame {
            x,
            y,
            width,
            height,
        } = frame;
        put!(
            self,
            r#"<clipPath id="clip{id}"><rect x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{height:.2}"/></clipPath><g clip-path="url(#clip{id})">"#
        );
        draw(self);
        put!(self, "</g>");
    }

    pub(crate) fn finish(self) -> Picture {
        let Self {
            width,
            height,
            body,
            ..
        } = self;
        Picture {
            svg: format!(
                r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="Inter, Helvetica, Arial, sans-serif">
<rect width="{width}" height="{height}" fill="{WHITE}"/>
{body}</svg>
"#
            ),
        }
    }
}

fn path(points: &[[f64; 2]], is_closed: bool) -> String {
    let mut d = String::with_capacity(points.len() * 14);
    for (i, [x, y]) in points.iter().enumerate() {
        let _ = write!(d, "{}{x:.2} {y:.2}", if i == 0 { 'M' } else { 'L' });
    }
    if is_closed {
        d.push('Z');
    }
    d
}

fn escaped(text: &str) -> String {
    // XML does not allow control characters.
    text.chars()
        .filter(|c| !c.is_control())
        .collect::<String>()
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
