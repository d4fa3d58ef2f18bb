//! Pictures. A picture is drawn once as SVG, and the PNG is rendered from that, so that both show
//! the same.
//!
//! Our own code writes the SVG, and `resvg` renders it with the two fonts that are compiled in, so
//! that no font of the machine is needed. The chart library plotters, which can write both formats,
//! was considered and not used: it rounds every point to a whole pixel, so that a smooth force
//! curve gets steps.
//!
//! ```
//! use palpa_plot::{Axis, Chart};
//!
//! let picture = Chart::new(Axis::linear("indentation [mm]"), Axis::linear("force [N]"))
//!     .line("loading", vec![[0.0, 0.0], [1.0, 0.3], [2.0, 0.9]])
//!     .draw();
//! assert!(picture.svg().contains("indentation [mm]"));
//! ```

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::anyhow;
use resvg::{tiny_skia, usvg};

use crate::canvas::{self, Color};
use crate::output::OutDir;

/// The colours of Okabe and Ito, which colour-blind people can also tell apart; the darker ones
/// come first. Yellow is left out because it is too pale for a line on white.
pub const PALETTE: [Color; 7] = [
    Color::rgb(0x00, 0x72, 0xb2),
    Color::rgb(0xd5, 0x5e, 0x00),
    Color::rgb(0x00, 0x9e, 0x73),
    Color::rgb(0xcc, 0x79, 0xa7),
    Color::rgb(0xe6, 0x9f, 0x00),
    Color::rgb(0x56, 0xb4, 0xe9),
    Color::rgb(0x22, 0x22, 0x22),
];

/// Pixels of the PNG per SVG unit. 2 is sharp on high-resolution screens and in print.
const PNG_SCALE: f32 = 2.0;

/// A finished picture.
#[derive(Debug, Clone)]
pub struct Picture {
    pub(crate) svg: String,
}

impl Picture {
    /// The picture as the text of an SVG file.
    pub fn svg(&self) -> &str {
        &self.svg
    }

    /// The picture as the bytes of a PNG file, at twice its nominal size.
    ///
    /// # Errors
    /// When the picture is too large to render.
    pub fn png(&self) -> anyhow::Result<Vec<u8>> {
        let mut options = usvg::Options::default();
        let fonts = Arc::make_mut(&mut options.fontdb);
        for font in canvas::FONTS {
            fonts.load_font_data(font.to_vec());
        }
        fonts.set_sans_serif_family("Inter");
        let tree = usvg::Tree::from_str(&self.svg, &options)?;
        let size = tree
            .size()
            .to_int_size()
            .scale_by(PNG_SCALE)
            .ok_or_else(|| anyhow!("a picture of this size cannot be rendered"))?;
        let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height())
            .ok_or_else(|| anyhow!("a picture of this size cannot be rendered"))?;
        let scale = tiny_skia::Transform::from_scale(PNG_SCALE, PNG_SCALE);
        resvg::render(&tree, scale, &mut pixels.as_mut());
        Ok(pixels.encode_png()?)
    }

    /// Writes `<stem>.svg` and `<stem>.png`, and returns their paths.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn save(&self, dir: &OutDir, stem: &str) -> anyhow::Result<[PathBuf; 2]> {
        Ok([
            dir.write(&format!("{stem}.svg"), self.svg.as_bytes())?,
            dir.write(&format!("{stem}.png"), &self.png()?)?,
        ])
    }
}
