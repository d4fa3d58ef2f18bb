//! A copy of a body's displacements, taken between two steps and completed on another thread.

use std::sync::Arc;

use palpa_mesh::Vec3;
use palpa_sparse::fronts::SolveScratch;

use super::super::outside::Outside;
use super::super::plan::Plan;
use super::Live;
use crate::model::Model;

/// The displacements of a [`Live`] body at one moment.
///
/// If the exterior answers linearly, [`Self::settled`] computes the displacements outside the zone.
/// Call it on a thread where nothing waits for it.
#[derive(Debug)]
pub struct Glance {
    model: Arc<Model>,
    /// The exterior that determines the displacements outside the zone; `None` if those are up to
    /// date.
    exterior: Option<(Arc<Plan>, Arc<Outside>)>,
    /// The load on that exterior; empty for none.
    load: Vec<f32>,
    displacements: Vec<Vec3>,
    contacts: Vec<(u32, f32)>,
}

impl Glance {
    /// The body and its materials.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Vertices of the skin in contact, ascending, each with the pressure on it, Pa.
    pub fn contacts(&self) -> &[(u32, f32)] {
        &self.contacts
    }

    /// Displacements of all nodes, m. `[n_nodes]` Cost: a substitution through the exterior.
    pub fn settled(&self) -> Vec<Vec3> {
        let mut displacements = self.displacements.clone();
        if let Some((plan, outside)) = &self.exterior {
            let mut scratch = SolveScratch::new(&plan.tree);
            let mut x = vec![0.0; self.model.structure.n_dofs()];
            let into = &mut displacements;
            let load = (!self.load.is_empty()).then_some(&*self.load);
            outside.settle(&self.model, plan, None, load, into, &mut x, &mut scratch);
        }
        displacements
    }
}

impl Live {
    /// Copies the displacements, reusing the memory of an older copy if given. Cost: a copy of the
    /// displacements.
    pub fn glance(&self, old: Option<Glance>) -> Glance {
        let (mut displacements, mut load, mut contacts) = old
            .map_or_else(Default::default, |old| {
                (old.displacements, old.load, old.contacts)
            });
        displacements.clear();
        displacements.extend_from_slice(&self.state.displacements);
        load.clear();
        load.extend_from_slice(self.beyond.load().unwrap_or(&[]));
        contacts.clear();
        contacts.extend(
            (self.skin.pressures.iter().enumerate())
                .filter(|(_, pressure)| **pressure > 0.0)
                .map(|(v, &pressure)| (v as u32, pressure as f32)),
        );
        Glance {
            model: Arc::clone(&self.model),
            exterior: (self.exterior.origin(&self.outside))
                .map(|outside| (Arc::clone(&self.plan), outside)),
            load,
            displacements,
            contacts,
        }
    }
}
