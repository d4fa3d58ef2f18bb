//! A press at its deepest on one mesh.

use palpa_mesh::refine::mean_depths;
use palpa_mesh::{LayeredBody, Vec3};

use super::Probed;
use super::probe::{self, Base};
use crate::press::tissue::{Deformed, Indentation};
use crate::skin::Skin;

/// The equilibrium of a press at its deepest, on one mesh: elastic, and without the way there.
#[derive(Debug)]
pub struct Deepest {
    /// The mesh.
    body: LayeredBody,
    base: Base,
}

impl Deepest {
    /// Finds the equilibrium from rest; `None` if there is none, or if the tool does not touch.
    pub fn from_rest(press: &Indentation) -> Option<Self> {
        Self::find(press, None)
    }

    /// Finds the equilibrium near that on another mesh of the same body; `None` if none is found.
    pub fn near(press: &Indentation, other: &Self) -> Option<Self> {
        let guess = carried(&other.body, &other.base.deformed, &press.mesh().body);
        Self::find(press, Some(&guess))
    }

    fn find(press: &Indentation, guess: Option<&Deformed>) -> Option<Self> {
        let depth = press.prepared.scene.press.depth;
        Some(Self {
            base: Base::find(press, &mut press.workspace(), depth, guess)?,
            body: press.mesh().body.clone(),
        })
    }

    /// Force on the tool, N.
    pub fn force_n(&self) -> f64 {
        self.base.force_n
    }

    /// Probes the press. `progress` is called before each probe with its number and the number of
    /// all; if it returns false, the probes are given up, and there is no result.
    pub fn probe(
        &self,
        press: &Indentation,
        mut progress: impl FnMut(usize, usize) -> bool,
    ) -> Option<Probed> {
        let (probed, _) = probe::run(press, std::slice::from_ref(&self.base), &mut progress)?;
        probed.into_iter().next()
    }
}

/// The deformed body of a mesh, carried to another mesh of the same body.
fn carried(from: &LayeredBody, deformed: &Deformed, to: &LayeredBody) -> Deformed {
    let skin = Skin::new(&from.skin);
    let mut displacements = Vec::with_capacity(to.n_nodes());
    let mut is_touching = vec![false; to.n_vertices()];
    for (v, p) in to.skin.points.iter().enumerate() {
        let Some(point) = skin.nearest(*p) else {
            displacements.extend(vec![Vec3::zeros(); to.n_levels]);
            continue;
        };
        let touching = point.mean(|v| Vec3::repeat(f64::from(deformed.is_touching[v])));
        is_touching[v] = touching.x > 0.5;
        let mean = |field: &[Vec3], l: usize| point.mean(|v| field[from.node(v, l)]);
        let mut old = vec![0.0; from.n_levels];
        for l in 1..from.n_levels {
            let below = mean(&from.positions, l) - mean(&from.positions, l - 1);
            old[l] = old[l - 1] + below.norm();
        }
        let new = mean_depths(to, &[v as u32]);
        let stretch = old[old.len() - 1] / new[new.len() - 1];
        for at in new.into_iter().map(|at| at * stretch) {
            let below = old.partition_point(|&l| l < at).clamp(1, old.len() - 1);
            let share = (at - old[below - 1]) / (old[below] - old[below - 1]);
            let ends = [below - 1, below].map(|l| mean(&deformed.displacements, l));
            displacements.push(ends[0].lerp(&ends[1], share.clamp(0.0, 1.0)));
        }
    }
    Deformed {
        displacements,
        is_touching,
    }
}
