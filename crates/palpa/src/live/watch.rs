//! What a viewer sees of the tissue: the latest displacements, left where nobody has to wait for anybody.

use palpa_fem::realtime::{Glance, Roaming};
use palpa_mesh::Vec3;
use palpa_rt::{Reader, Writer, mailbox};

/// The body at one step of the tissue.
#[derive(Debug, Default)]
pub struct Look {
    /// The step.
    pub step: u64,
    /// Which mesh it was, counted from 1.
    pub mesh: u64,
    /// Round which place (at rest, m) it was fine, and up to which distance, m; none where what is fine does not move.
    pub fine: Option<(Vec3, f64)>,
    /// What it was.
    pub body: Option<Seen>,
}

/// The body that was looked at.
#[derive(Debug)]
pub enum Seen {
    /// Finite elements.
    Tissue(Glance),
    /// Displacements of a network of bars, m. `[n_nodes]`
    Springs(Vec<Vec3>),
}

/// The tissue's end.
#[derive(Debug)]
pub struct Watch {
    writer: Writer<Look>,
    period: f64,
    due: f64,
}

impl Watch {
    /// Looks at most once in a period, s, and where they are read.
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

    /// Leaves a look at a body of finite elements, if one is due. Cost: a copy of the displacements.
    pub(super) fn look(&mut self, step: u64, now: f64, body: &Roaming) {
        let [mesh, _] = body.n_meshes();
        self.leave(step, now, mesh, body.fine(), |old| {
            let old = match old {
                Some(Seen::Tissue(glance)) => Some(glance),
                _ => None,
            };
            Seen::Tissue(body.live().glance(old))
        });
    }

    /// Leaves a look at displacements, if one is due.
    pub(super) fn look_at(
        &mut self,
        step: u64,
        now: f64,
        displacements: impl Iterator<Item = Vec3>,
    ) {
        self.leave(step, now, 1, None, |_| {
            Seen::Springs(displacements.collect())
        });
    }

    fn leave(
        &mut self,
        step: u64,
        now: f64,
        mesh: u64,
        fine: Option<(Vec3, f64)>,
        make: impl FnOnce(Option<Seen>) -> Seen,
    ) {
        if now < self.due {
            return;
        }
        self.due = now + self.period;
        let slot = self.writer.slot();
        let body = Some(make(slot.body.take()));
        *slot = Look {
            step,
            mesh,
            fine,
            body,
        };
        self.writer.publish();
    }
}
