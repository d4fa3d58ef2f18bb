//! The viewer's copy of the tissue's displacements, passed on without waiting on either side.

use palpa_fem::PosedTool;
use palpa_fem::realtime::{Glance, Roaming};
use palpa_mesh::Vec3;
use palpa_rt::{Reader, Writer, mailbox};

/// The body at one step of the tissue, for a viewer.
#[derive(Debug, Default)]
pub struct Look {
    /// Number of the step.
    pub step: u64,
    /// Number of the mesh, from 1.
    pub mesh: u64,
    /// Centre (at rest, m) and radius (m) of the fine part of the mesh; `None` if it does not move.
    pub fine: Option<(Vec3, f64)>,
    /// The first tool with the pose that the step was given, in the scene's frame; `None` for a
    /// network of bars.
    pub tool: Option<PosedTool>,
    /// The displacements; `None` before the first look.
    pub body: Option<Seen>,
}

/// The displacements of a body.
#[derive(Debug)]
pub enum Seen {
    /// Finite elements.
    Tissue(Glance),
    /// Displacements of a network of bars, m. `[n_nodes]`
    Springs(Vec<Vec3>),
}

/// The tissue's end: makes the looks.
#[derive(Debug)]
pub struct Watch {
    writer: Writer<Look>,
    period: f64,
    due: f64,
}

impl Watch {
    /// Makes at most one look per `period`, s. Returns the end that reads them, too.
    pub fn new(period: f64) -> (Self, Reader<Look>) {
        let (writer, reader) = mailbox([(); 3].map(|()| Box::<Look>::default()));
        let due = f64::NEG_INFINITY;
        let watch = Self {
            writer,
            period,
            due,
        };
        (watch, reader)
    }

    /// Makes a look at a body of finite elements, if one is due. Cost: a copy of the displacements.
    pub(super) fn look(&mut self, step: u64, now: f64, body: &Roaming, tool: Option<&PosedTool>) {
        let [mesh, _] = body.n_meshes();
        let look = Look {
            step,
            mesh,
            fine: body.fine(),
            tool: tool.copied(),
            body: None,
        };
        self.leave(look, now, |old| {
            let old = match old {
                Some(Seen::Tissue(glance)) => Some(glance),
                _ => None,
            };
            Seen::Tissue(body.live().glance(old))
        });
    }

    /// Makes a look at displacements, if one is due.
    pub(super) fn look_at(
        &mut self,
        step: u64,
        now: f64,
        displacements: impl Iterator<Item = Vec3>,
    ) {
        let look = Look {
            step,
            mesh: 1,
            ..Look::default()
        };
        self.leave(look, now, |_| Seen::Springs(displacements.collect()));
    }

    /// Leaves a look, with the body that `make` makes from the one in its place.
    fn leave(&mut self, mut look: Look, now: f64, make: impl FnOnce(Option<Seen>) -> Seen) {
        if now < self.due {
            return;
        }
        self.due = now + self.period;
        let slot = self.writer.slot();
        look.body = Some(make(slot.body.take()));
        *slot = look;
        self.writer.publish();
    }
}
