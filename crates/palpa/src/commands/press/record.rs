//! The run itself: every sample to the table, some of the bodies to the series for ParaView.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use palpa_mesh::{LayeredBody, Surface, Vec3};

use super::Args;
use crate::build::BuiltBody;
use crate::cli::Context;
use crate::output::OutDir;
use crate::press::{Indentation, Run, Sample};
use crate::vtu::{Grid, write_series};

/// Removes the files of an earlier run into the same folder, of which this one might leave some standing.
pub(super) fn remove_older(folder: &Path) -> anyhow::Result<()> {
    let pictures = ["force_depth", "force_time", "section"];
    let mut older: Vec<PathBuf> = ["press.csv", "press.json", "press.pvd"]
        .map(|name| folder.join(name))
        .into();
    older.extend(
        pictures
            .iter()
            .flat_map(|stem| ["svg", "png"].map(|end| folder.join(format!("{stem}.{end}")))),
    );
    if let Ok(series) = std::fs::read_dir(folder.join("series")) {
        let is_ours = |name: &str| name.starts_with("body_") || name.starts_with("bone_");
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

/// What came out of a run.
pub(super) struct Recorded {
    pub(super) samples: Vec<Sample>,
    /// Positions at the deepest sample reached.
    pub(super) deepest: Vec<Vec3>,
    pub(super) deepest_depth: f64,
}

/// Runs the script; every sample goes to the table at once, so that an interrupted run leaves a valid one.
pub(super) fn record(
    args: &Args,
    context: &Context,
    out: &OutDir,
    built: &BuiltBody,
    indentation: &Indentation,
) -> anyhow::Result<Recorded> {
    let mut table = out.table::<Sample>("press.csv")?;
    let mut series = Series::new(args.frames, indentation);
    let mut run = indentation.start(&built.growth.body);
    let mut recorded = Recorded {
        samples: Vec::new(),
        deepest: run.state.positions.clone(),
        deepest_depth: 0.0,
    };
    let progress = context.progress(indentation.n_samples(), "pressing");
    while let Some(sample) = run.advance() {
        table.push(&sample)?;
        if sample.outcome != "diverged" {
            series.offer(out, built, &run, recorded.samples.len(), &sample)?;
            if sample.depth_mm > recorded.deepest_depth {
                recorded.deepest_depth = sample.depth_mm;
                recorded.deepest.clone_from(&run.state.positions);
            }
        }
        recorded.samples.push(sample);
        progress.inc(1);
        if context.is_interrupted() {
            break;
        }
    }
    table.finish()?;
    series.finish(out, &built.bones)?;
    Ok(recorded)
}

/// The deformed body at some of the samples, as VTU files under one PVD.
struct Series {
    wanted: Vec<usize>,
    frames: Vec<(f64, String)>,
}

impl Series {
    /// Picks `n` samples, evenly spread; from two on the first and the deepest are among them.
    fn new(n: usize, indentation: &Indentation) -> Self {
        let (last, deepest) = (indentation.n_samples() - 1, indentation.deepest());
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

    fn offer(
        &mut self,
        out: &OutDir,
        built: &BuiltBody,
        run: &Run<'_>,
        index: usize,
        sample: &Sample,
    ) -> anyhow::Result<()> {
        if !self.wanted.contains(&index) {
            return Ok(());
        }
        let growth = &built.growth;
        let body = &growth.body;
        let per_column = |values: &[f64]| -> Vec<f64> {
            values
                .iter()
                .flat_map(|&x| std::iter::repeat_n(x, body.n_levels))
                .collect()
        };
        let displacement: Vec<Vec3> = run
            .state
            .positions
            .iter()
            .zip(&body.positions)
            .map(|(now, rest)| now - rest)
            .collect();
        let mut grid = Grid::of_body(body, &run.state.positions)
            .with_point_vectors("displacement", &displacement)
            .with_point_vectors("force", &run.state.node_forces)
            .with_point_scalars("thinning", per_column(&growth.thinning))
            .with_point_scalars(
                "is_base",
                (0..body.n_nodes())
                    .map(|n| f64::from(u8::from(body.is_base(n))))
                    .collect(),
            )
            .with_point_scalars("cut_face", per_column(&cut_faces(body)));
        if !growth.stand_off.is_empty() {
            grid = grid.with_point_scalars("stand_off", per_column(&growth.stand_off));
        }
        let name = format!("body_{:03}.vtu", self.frames.len());
        out.write_with(&format!("series/{name}"), |w| grid.write(w))?;
        self.frames.push((sample.time_s, format!("series/{name}")));
        Ok(())
    }

    fn finish(self, out: &OutDir, bones: &[Surface]) -> anyhow::Result<()> {
        if !self.frames.is_empty() {
            for (i, bone) in bones.iter().enumerate() {
                out.write_with(&format!("series/bone_{i}.vtu"), |w| {
                    Grid::of_surface(bone).write(w)
                })?;
            }
            out.write_with("press.pvd", |w| write_series(w, &self.frames))?;
        }
        Ok(())
    }
}

/// For each skin vertex the number of its cut face, from 1; 0 on none.
fn cut_faces(body: &LayeredBody) -> Vec<f64> {
    let mut number = vec![0.0; body.n_vertices()];
    for (i, face) in body.cut_faces.iter().enumerate() {
        for &v in &face.vertices {
            number[v as usize] = (i + 1) as f64;
        }
    }
    number
}
