//! The picture of the body: its mesh, and a frame of it up to sixty times a second.

use std::sync::Arc;

use palpa::live::Seen;
use palpa_mesh::Vec3;
use palpa_rt::thread_cpu;
use palpa_viewer::Publisher;
use palpa_viewer::control::Field;
use palpa_viewer::wire::{FrameSnapshot, MapSnapshot};

use super::pace::Pace;
use super::{Fields, frame};
use crate::stage::Live;

/// An encoded mesh snapshot.
pub(crate) type MeshBytes = Arc<Vec<u8>>;

/// The picture that pages see.
pub(crate) struct Screen {
    publisher: Publisher,
    fields: Fields,
    /// The body's latest frame.
    frame: FrameSnapshot,
    /// The body's latest mesh.
    mesh: MeshBytes,
    /// The engine and its mesh that `mesh` was made from.
    made_from: Option<(u64, u64)>,
    /// Number of the mesh that pages have.
    shown: Option<u32>,
    n_meshes: u32,
    n_frames: u64,
    pace: Pace,
}

impl Screen {
    /// A screen that shows nothing yet.
    pub(crate) fn new(publisher: Publisher, fields: Fields) -> Self {
        Self {
            publisher,
            fields,
            frame: FrameSnapshot::default(),
            mesh: MeshBytes::default(),
            made_from: None,
            shown: None,
            n_meshes: 0,
            n_frames: 0,
            pace: Pace::default(),
        }
    }

    /// Something has changed that ticks do not show: a request, the state, the number of pages.
    pub(crate) fn wake(&mut self) {
        self.pace.wake();
    }

    /// Whether a frame is due, `dt` seconds after the last call: each time that is affordable while something moves, twice a
    /// second at rest. `recorded` is the frame of a recording that is shown instead of the body.
    pub(crate) fn is_due(&mut self, recorded: Option<&FrameSnapshot>, dt: f64) -> bool {
        self.pace.is_due(recorded.unwrap_or(&self.frame), dt)
    }

    /// Whether any page is connected.
    pub(crate) fn is_watched(&self) -> bool {
        self.publisher.n_clients() > 0
    }

    /// Frames of the body made so far.
    pub(crate) fn n_frames(&self) -> u64 {
        self.n_frames
    }

    /// Nodes in the body's latest frame.
    pub(crate) fn n_nodes(&self) -> usize {
        self.frame.displacements.len() / 3
    }

    /// Puts the latest tick into the frame. Returns the place that is pressed, and the force there,
    /// N.
    pub(crate) fn put_tick(&mut self, live: &Live) -> (Vec3, f64) {
        let place = live.place();
        frame::put_tick(
            &mut self.frame,
            &live.entry,
            &live.world.scene_from_device,
            &live.world.ruler,
            &(place.point, place.normal),
        );
        self.frame.deepest = live.hand.deepest();
        self.frame.step_status = live.step.status.into();
        (place.point, Vec3::from(self.frame.force).norm())
    }

    /// Puts the latest look at the body into the frame, with a field over its nodes. Returns the
    /// frame and its mesh; none before the first look.
    pub(crate) fn put_body(
        &mut self,
        live: &Live,
        shows_lumps: bool,
        field: Field,
    ) -> Option<(&FrameSnapshot, &MeshBytes)> {
        let begin = thread_cpu();
        let look = live.look();
        let (settled, model, contacts);
        let displacements: &[Vec3] = match look.body.as_ref()? {
            Seen::Tissue(glance) => {
                settled = glance.settled();
                model = Some(Arc::clone(glance.model()));
                contacts = glance.contacts();
                &settled
            }
            Seen::Springs(displacements) => {
                model = None;
                contacts = &[][..];
                displacements
            }
        };
        if self.made_from != Some((live.engine, look.mesh)) {
            let body = match &model {
                Some(model) => model.body(),
                None => live.world.spring_body()?,
            };
            self.made_from = Some((live.engine, look.mesh));
            self.n_meshes += 1;
            let stiffness = live.world.stiffness(body, shows_lumps);
            let mesh = frame::mesh(self.n_meshes, body, stiffness, &live.world.bones);
            self.mesh = Arc::new(mesh.encode());
        }
        self.n_frames += 1;
        self.frame.mesh = self.n_meshes;
        self.frame.sequence = self.n_frames as u32;
        frame::put_displacements(&mut self.frame, displacements);
        frame::put_contacts(&mut self.frame, contacts);
        let field = model.and_then(|model| {
            let mesh = u64::from(self.n_meshes);
            self.fields.of(mesh, field, &model, displacements)
        });
        frame::put_field(&mut self.frame, field);
        self.pace.spend(thread_cpu() - begin);
        Some((&self.frame, &self.mesh))
    }

    /// The body's latest tick; its nodes may be older.
    pub(crate) fn tick(&self) -> &FrameSnapshot {
        &self.frame
    }

    /// Shows a palpation map.
    pub(crate) fn show_map(&self, map: &MapSnapshot) {
        self.publisher.map(map.encode());
    }

    /// Requests a new mesh with the next frame.
    pub(crate) fn renew_mesh(&mut self) {
        self.made_from = None;
    }

    /// Shows the body's latest frame.
    pub(crate) fn show_body(&mut self) {
        send(&self.publisher, &mut self.shown, &self.frame, &self.mesh);
    }

    /// Shows a frame of a recording.
    pub(crate) fn show_recorded(&mut self, frame: &FrameSnapshot, mesh: &MeshBytes) {
        send(&self.publisher, &mut self.shown, frame, mesh);
    }
}

/// Sends a frame, and its mesh first if pages have another one.
fn send(publisher: &Publisher, shown: &mut Option<u32>, frame: &FrameSnapshot, mesh: &MeshBytes) {
    if *shown != Some(frame.mesh) {
        *shown = Some(frame.mesh);
        publisher.mesh(frame.mesh, mesh.to_vec());
    }
    publisher.frame(frame.mesh, frame.encode());
}
