//! The record of a press: the samples of its runs, and the body at its deepest.

use palpa_fem::{PrismField, level_forces};
use palpa_mesh::quality::prism_shapes;
use palpa_mesh::{LayeredBody, Vec3};

use super::{Failure, Indentation, Run, Sample, SampleOutcome};

/// The samples of a press so far. Its methods give the figures of all samples together and the
/// notes on them.
///
/// ```no_run
/// # fn press(press: &palpa::press::tissue::Indentation) {
/// use palpa::press::tissue::Record;
///
/// let mut record = Record::new(press);
/// for speed in 0..press.speeds.len() {
///     let mut run = press.start(speed);
///     while let Some(sample) = run.advance() {
///         record.push(&run, sample);
///     }
/// }
/// for note in press.notes.iter().chain(&record.notes()) {
///     println!("note: {note}");
/// }
/// # }
/// ```
#[derive(Debug)]
pub struct Record<'a> {
    pub(super) indentation: &'a Indentation,
    /// The samples of all runs, in their order.
    pub samples: Vec<Sample>,
    /// Steps that failed; at most one a run.
    pub failures: Vec<Failure>,
    /// The body at the deepest sample of the first run.
    pub deepest: Deepest,
    /// Displacements of the nodes at the samples of the first press down, m; `None` if they are not
    /// kept.
    down: Option<Vec<(usize, Vec<Vec3>)>>,
}

/// The body at its deepest sample.
#[derive(Debug)]
pub struct Deepest {
    /// Index of the sample.
    pub sample: usize,
    /// Depth of the tool, mm.
    pub depth_mm: f64,
    /// Displacements of the nodes, m. `[n_nodes]`
    pub displacements: Vec<Vec3>,
    /// Force of the tissue below on each level, N. `[n_levels]`; empty before the first depth.
    pub level_forces: Vec<Vec3>,
    /// Von Mises stress of every prism, Pa. `[n_prisms]`
    pub von_mises: Vec<f64>,
    /// Pressure of the tool on the skin, Pa. `[n_vertices]`
    pub skin_pressure: Vec<f64>,
    /// Prisms with a corner turned inside out, if any.
    pub turned: Option<TurnedPrisms>,
}

/// Prisms that are turned inside out at a corner, although the volume is positive at every
/// integration point.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnedPrisms {
    /// Number of prisms.
    pub n: usize,
    /// Middle of the worst prism, m.
    pub at: Vec3,
}

impl<'a> Record<'a> {
    /// A record without samples.
    pub fn new(indentation: &'a Indentation) -> Self {
        Self {
            indentation,
            samples: Vec::new(),
            failures: Vec::new(),
            down: None,
            deepest: Deepest {
                sample: 0,
                depth_mm: 0.0,
                displacements: vec![Vec3::zeros(); indentation.model.n_nodes()],
                level_forces: Vec::new(),
                von_mises: vec![0.0; indentation.mesh().body.n_prisms()],
                skin_pressure: vec![0.0; indentation.mesh().body.n_vertices()],
                turned: None,
            },
        }
    }

    /// A record without samples that will keep all that [`crate::accuracy`] needs: the
    /// displacements of the first press down.
    pub fn with_displacements(indentation: &'a Indentation) -> Self {
        Self {
            down: Some(Vec::new()),
            ..Self::new(indentation)
        }
    }

    /// Adds the sample that `run` has just returned. The runs come one after the other, the first
    /// one first.
    pub fn push(&mut self, run: &Run<'_>, sample: Sample) {
        if !sample.outcome.is_converged() {
            self.failures.extend(run.failure.clone());
        } else if run.index == 0 && sample.depth_mm > self.deepest.depth_mm {
            self.deepest = Deepest::new(run, self.samples.len(), sample.depth_mm);
        }
        if let Some(down) = &mut self.down
            && sample.run == 0
            && sample.is_first_loading()
            && sample.outcome.is_converged()
        {
            down.push((self.samples.len(), run.state.displacements.clone()));
        }
        self.samples.push(sample);
    }

    /// The press.
    pub fn indentation(&self) -> &'a Indentation {
        self.indentation
    }

    /// Displacements of the nodes at a converged sample of the first press down, m. `[n_nodes]`
    ///
    /// # Panics
    /// If they were not kept.
    pub(crate) fn displacements(&self, sample: usize) -> &[Vec3] {
        let mut kept = self.down.iter().flatten();
        let of = kept.find(|(index, _)| *index == sample);
        &of.expect("a record that keeps displacements").1
    }

    /// Converged, or how the first step that failed ended.
    pub fn outcome(&self) -> SampleOutcome {
        let failed = self.samples.iter().find(|s| !s.outcome.is_converged());
        failed.map_or(SampleOutcome::Converged, |s| s.outcome)
    }

    /// The samples that converged.
    pub fn converged(&self) -> Vec<&Sample> {
        let samples = self.samples.iter();
        samples.filter(|s| s.outcome.is_converged()).collect()
    }
}

impl Deepest {
    fn new(run: &Run<'_>, sample: usize, depth_mm: f64) -> Self {
        let (model, state, ws) = (&run.indentation.model, &run.state, &run.workspace);
        Self {
            sample,
            depth_mm,
            displacements: state.displacements.clone(),
            level_forces: level_forces(model, state, ws),
            von_mises: run.fields.iter().map(PrismField::von_mises).collect(),
            skin_pressure: run.indentation.skin_pressure(run),
            turned: turned(&run.indentation.mesh().body, &state.positions(model)),
        }
    }
}

fn turned(body: &LayeredBody, positions: &[Vec3]) -> Option<TurnedPrisms> {
    let shapes = prism_shapes(body, positions);
    let invalid = || shapes.iter().enumerate().filter(|(_, s)| !s.is_valid());
    let (p, _) = invalid().min_by(|a, b| a.1.scaled_jacobian.total_cmp(&b.1.scaled_jacobian))?;
    let n_intervals = body.n_levels - 1;
    let corners = body.prism(p / n_intervals, p % n_intervals);
    Some(TurnedPrisms {
        n: invalid().count(),
        at: corners.iter().map(|&node| positions[node]).sum::<Vec3>() / 6.0,
    })
}
