//! Fields over the nodes, computed on a thread of their own: a field takes longer than a frame.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread;
use std::time::Instant;

use palpa_fem::{Model, PrismField, relaxed_fields};
use palpa_mesh::Vec3;
use palpa_viewer::control::Field;

/// A field over the nodes of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NodeField {
    /// The mesh.
    pub(super) mesh: u64,
    /// Which field.
    pub(super) field: Field,
    /// Mean over the prisms around each node. `[n_nodes]`
    pub(super) values: Vec<f64>,
}

#[derive(Debug)]
struct Job {
    mesh: u64,
    field: Field,
    model: Arc<Model>,
    displacements: Arc<[Vec3]>,
}

/// The worker, and the last field that it computed.
#[derive(Debug)]
pub(crate) struct Fields {
    jobs: SyncSender<Job>,
    done: Receiver<NodeField>,
    latest: Option<NodeField>,
    is_busy: bool,
    /// Mesh, field and displacements of the latest job.
    asked: Option<(u64, Field, Arc<[Vec3]>)>,
}

/// Displacements that differ by less than this, m, give a field that looks the same.
const UNSEEN: f64 = 1e-7;

impl Fields {
    /// Starts the worker, which ends when this is dropped.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub(crate) fn start() -> std::io::Result<Self> {
        let (jobs, inbox) = sync_channel::<Job>(1);
        let (outbox, done) = sync_channel(1);
        thread::Builder::new()
            .name("palpa-fields".to_owned())
            .spawn(move || {
                for job in inbox {
                    let Job {
                        mesh,
                        field,
                        model,
                        displacements,
                    } = job;
                    let begin = Instant::now();
                    let values = at_nodes(&model, &displacements, field);
                    let took = begin.elapsed();
                    let field = NodeField {
                        mesh,
                        field,
                        values,
                    };
                    if outbox.send(field).is_err() {
                        return;
                    }
                    // Use at most half of a core: tissue and browser need the rest.
                    thread::sleep(took);
                }
            })?;
        Ok(Self {
            jobs,
            done,
            latest: None,
            is_busy: false,
            asked: None,
        })
    }

    /// The latest field of this kind on this mesh. Starts a job for these displacements if the
    /// worker is free.
    pub(super) fn of(
        &mut self,
        mesh: u64,
        field: Field,
        model: &Arc<Model>,
        displacements: &[Vec3],
    ) -> Option<&NodeField> {
        if field == Field::None {
            return None;
        }
        match self.done.try_recv() {
            Ok(done) => {
                self.latest = Some(done);
                self.is_busy = false;
            }
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => {}
        }
        if !self.is_busy && !self.is_asked(mesh, field, displacements) {
            let displacements: Arc<[Vec3]> = displacements.into();
            let job = Job {
                mesh,
                field,
                model: Arc::clone(model),
                displacements: Arc::clone(&displacements),
            };
            if self.jobs.try_send(job).is_ok() {
                self.asked = Some((mesh, field, displacements));
                self.is_busy = true;
            }
        }
        self.latest
            .as_ref()
            .filter(|latest| latest.mesh == mesh && latest.field == field)
    }

    /// Whether the latest job was for these displacements.
    fn is_asked(&self, mesh: u64, field: Field, displacements: &[Vec3]) -> bool {
        self.asked.as_ref().is_some_and(|(m, f, before)| {
            (*m, *f) == (mesh, field)
                && before.len() == displacements.len()
                && (before.iter().zip(displacements)).all(|(a, b)| (a - b).amax() <= UNSEEN)
        })
    }
}

/// A field at the nodes: the mean over the prisms that meet there. `[n_nodes]`
fn at_nodes(model: &Model, displacements: &[Vec3], field: Field) -> Vec<f64> {
    let body = model.body();
    let value = |prism: &PrismField| match field {
        Field::None => 0.0,
        Field::VonMises => prism.von_mises(),
        Field::Pressure => prism.pressure(),
        Field::Stretch => prism.stretches[2],
    };
    let prisms = relaxed_fields(model, displacements);
    let n_intervals = body.n_levels - 1;
    let mut sums = vec![(0.0, 0_u32); body.n_nodes()];
    for (p, prism) in prisms.iter().enumerate() {
        let value = value(prism);
        for node in body.prism(p / n_intervals, p % n_intervals) {
            sums[node].0 += value;
            sums[node].1 += 1;
        }
    }
    sums.into_iter()
        .map(|(sum, n)| sum / f64::from(n.max(1)))
        .collect()
}
