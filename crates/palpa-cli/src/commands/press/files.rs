//! The files of a press: removal of older files, and the series for ParaView.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use palpa_mesh::{LayeredBody, Surface};

use palpa_plot::output::OutDir;
use palpa_plot::vtu::{Grid, write_series};

/// Where in the body errors of the mesh arise.
pub(super) const ERROR_BARS: &str = "error_bars.vtu";

/// Removes the files of an earlier run from the folder, because this run might not replace all of
/// them.
pub(super) fn remove_older(folder: &Path) -> anyhow::Result<()> {
    let pictures = [
        "force_depth",
        "force_time",
        "relaxation",
        "layers",
        "section",
        "stress",
    ];
    let files = [
        "press.csv",
        "press.json",
        "press.pvd",
        "mesh_choice.json",
        ERROR_BARS,
    ];
    let mut older: Vec<PathBuf> = files.map(|name| folder.join(name)).into();
    older.extend(
        pictures
            .iter()
            .flat_map(|stem| ["svg", "png"].map(|end| folder.join(format!("{stem}.{end}")))),
    );
    if let Ok(series) = std::fs::read_dir(folder.join("series")) {
        let is_ours = |name: &str| {
            ["body_", "bone_", "lump_"]
                .iter()
                .any(|start| name.starts_with(start))
        };
        older.extend(
            series
                .flatten()
                .filter(|f| is_ours(&f.file_name().to_string_lossy()))
                .map(|f| f.path()),
        );
    }
    for path in older.iter().filter(|path| path.exists()) {
        std::fs::remove_file(path)
            .with_context(|| format!("cannot remove the older \"{}\"", path.display()))?;
    }
    Ok(())
}

/// The deformed body at some of the samples, as VTU files under one PVD.
pub(super) struct Series {
    wanted: Vec<usize>,
    frames: Vec<(f64, String)>,
}

impl Series {
    /// Picks `n` of the samples, evenly spread; with two or more, the first and the deepest are
    /// included.
    pub(super) fn new(n: usize, n_samples: usize, deepest: usize) -> Self {
        let last = n_samples - 1;
        let n = n.min(last + 1);
        let mut wanted: Vec<usize> = match n {
            0 => Vec::new(),
            1 => vec![deepest],
            2 => vec![0, deepest],
            _ => (0..n).map(|i| (i * last) / (n - 1)).collect(),
        };
        if let Some(nearest) = wanted
            .iter_mut()
            .skip(1)
            .min_by_key(|w| w.abs_diff(deepest))
        {
            *nearest = deepest;
        }
        wanted.sort_unstable();
        wanted.dedup();
        Self {
            wanted,
            frames: Vec::new(),
        }
    }

    /// Whether the sample of this number is one of the series.
    pub(super) fn wants(&self, index: usize) -> bool {
        self.wanted.contains(&index)
    }

    /// Adds the body at a time, s.
    pub(super) fn push(&mut self, out: &OutDir, time: f64, grid: &Grid) -> anyhow::Result<()> {
        let name = format!("series/body_{:03}.vtu", self.frames.len());
        out.write_with(&name, |w| grid.write(w))?;
        self.frames.push((time, name));
        Ok(())
    }

    pub(super) fn finish(self, out: &OutDir, bones: &[Surface]) -> anyhow::Result<()> {
        if self.frames.is_empty() {
            return Ok(());
        }
        for (i, bone) in bones.iter().enumerate() {
            out.write_with(&format!("series/bone_{i}.vtu"), |w| {
                Grid::of_surface(bone).write(w)
            })?;
        }
        out.write_with("press.pvd", |w| write_series(w, &self.frames))?;
        Ok(())
    }
}

/// One value per column, for each of its nodes.
pub(super) fn per_column(body: &LayeredBody, values: &[f64]) -> Vec<f64> {
    values
        .iter()
        .flat_map(|&x| std::iter::repeat_n(x, body.n_levels))
        .collect()
}

/// Adds the fields that show how the body was made to a frame: its base, its cut faces (numbered
/// from 1), the thinning of the layers, and the stand-off of the base from the bone (both per skin
/// vertex).
pub(super) fn with_making(
    grid: Grid,
    body: &LayeredBody,
    thinning: &[f64],
    stand_off: &[f64],
) -> Grid {
    let is_base = |n: usize| f64::from(u8::from(body.is_base(n)));
    let mut face = vec![0.0; body.n_vertices()];
    for (i, cut_face) in body.cut_faces.iter().enumerate() {
        for &v in &cut_face.vertices {
            face[v as usize] = (i + 1) as f64;
        }
    }
    let grid = grid
        .with_point_scalars("thinning", per_column(body, thinning))
        .with_point_scalars("is_base", (0..body.n_nodes()).map(is_base).collect())
        .with_point_scalars("cut_face", per_column(body, &face));
    if stand_off.is_empty() {
        grid
    } else {
        grid.with_point_scalars("stand_off", per_column(body, stand_off))
    }
}
