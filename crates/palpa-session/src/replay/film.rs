//! The film of a recording: its frames in memory, beside the log that the engine writes.

use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context as _, bail};
use palpa::live::Ruler;
use palpa_viewer::wire::FrameSnapshot;

use crate::publish::MeshBytes;

/// Largest memory of a film, bytes. Above it, every other frame is dropped, so that the film still
/// covers the whole recording.
const MOST_BYTES: usize = 200 << 20;

/// Creates the file for a log, with the first free number in `folder`. The folder is created if
/// necessary. Other sessions may record into the same folder.
///
/// # Errors
/// When the folder or the file cannot be made.
pub(crate) fn new_log(folder: &Path) -> anyhow::Result<PathBuf> {
    let advice = || format!("no recording can be made in {}", folder.display());
    std::fs::create_dir_all(folder).with_context(advice)?;
    for n in 1_u32.. {
        let path = folder.join(format!("recording-{n}.mcap"));
        match File::create_new(&path) {
            Ok(_) => return Ok(path),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error).with_context(advice),
        }
    }
    bail!("{} has no room for another recording", folder.display())
}

/// The frames of a recording, with their meshes.
#[derive(Debug)]
pub(crate) struct Film {
    log: PathBuf,
    ruler: Arc<Ruler>,
    frames: Vec<FrameSnapshot>,
    meshes: Vec<(u32, MeshBytes)>,
    bytes: usize,
    /// One of `every` frames is kept.
    every: usize,
    n_seen: usize,
}

impl Film {
    /// An empty film beside the log at `log`, of a body whose skin is that of `ruler`.
    pub(super) fn new(log: PathBuf, ruler: Arc<Ruler>) -> Self {
        Self {
            log,
            ruler,
            frames: Vec::new(),
            meshes: Vec::new(),
            bytes: 0,
            every: 1,
            n_seen: 0,
        }
    }

    /// The log of the engine.
    pub(super) fn log(&self) -> &Path {
        &self.log
    }

    /// The skin of the body that was recorded.
    pub(super) fn ruler(&self) -> &Arc<Ruler> {
        &self.ruler
    }

    /// Time of the last frame, s.
    pub(super) fn duration(&self) -> f64 {
        self.frames.last().map_or(0.0, |frame| frame.time)
    }

    /// Adds a frame, and the mesh that it belongs to.
    pub(super) fn add(&mut self, frame: &FrameSnapshot, mesh: &MeshBytes) {
        self.n_seen += 1;
        if !self.n_seen.is_multiple_of(self.every) {
            return;
        }
        if self.meshes.last().is_none_or(|(id, _)| *id != frame.mesh) {
            self.bytes += mesh.len();
            self.meshes.push((frame.mesh, Arc::clone(mesh)));
        }
        let mut frame = frame.clone();
        frame.is_replay = 1;
        self.bytes += bytes_of(&frame);
        self.frames.push(frame);
        if self.bytes > MOST_BYTES {
            self.thin_out();
        }
    }

    fn thin_out(&mut self) {
        let mut i = 0;
        self.frames.retain(|_| {
            i += 1;
            i % 2 == 1
        });
        self.every *= 2;
        self.meshes
            .retain(|(id, _)| self.frames.iter().any(|frame| frame.mesh == *id));
        let frames: usize = self.frames.iter().map(bytes_of).sum();
        self.bytes = frames
            + self
                .meshes
                .iter()
                .map(|(_, mesh)| mesh.len())
                .sum::<usize>();
    }

    /// The last frame at or before `time` (s), and its mesh; none if the film is empty.
    pub(super) fn at(&self, time: f64) -> Option<(&FrameSnapshot, &MeshBytes)> {
        let after = self.frames.partition_point(|frame| frame.time <= time);
        let frame = self.frames.get(after.saturating_sub(1))?;
        let mesh = self.meshes.iter().rev().find(|(id, _)| *id == frame.mesh)?;
        Some((frame, &mesh.1))
    }
}

fn bytes_of(frame: &FrameSnapshot) -> usize {
    size_of::<FrameSnapshot>()
        + 2 * (frame.displacements.len() + frame.field_values.len())
        + 8 * frame.contacts.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn empty() -> Film {
        let skin = palpa_mesh::Surface::default();
        let ruler = Ruler::new(skin, palpa_servo::Pose::identity());
        Film::new(PathBuf::new(), Arc::new(ruler))
    }

    fn frame(time: f64, mesh: u32, n: usize) -> FrameSnapshot {
        FrameSnapshot {
            time,
            mesh,
            displacements: vec![0; n],
            ..FrameSnapshot::default()
        }
    }

    #[test]
    fn a_moment_is_the_last_frame_before_it_with_its_own_mesh() {
        let mut film = empty();
        assert!(film.at(0.0).is_none());
        let meshes = [1, 2].map(|i| Arc::new(vec![i]));
        for k in 0..10 {
            let mesh = 1 + u32::from(k >= 5);
            film.add(
                &frame(0.1 * f64::from(k), mesh, 3),
                &meshes[mesh as usize - 1],
            );
        }
        assert!((film.duration() - 0.9).abs() < 1e-12);
        let (shown, mesh) = film.at(0.65).unwrap();
        assert!((shown.time - 0.6).abs() < 1e-12 && shown.is_replay == 1);
        assert_eq!(**mesh, [2]);
        assert_eq!(**film.at(0.0).unwrap().1, [1]);
    }

    #[test]
    fn no_log_is_ever_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = [(); 2].map(|()| new_log(folder.path()).unwrap());
        assert_ne!(a, b);
        assert!(a.exists() && b.exists());
        assert!(new_log(&a).is_err());
    }

    #[test]
    fn memory_is_bounded_and_the_whole_time_stays() {
        let mut film = empty();
        let mesh = Arc::new(vec![0; 1000]);
        for k in 0..700 {
            film.add(&frame(0.1 * f64::from(k), 1, 300_000), &mesh);
            assert!(film.bytes <= MOST_BYTES);
        }
        assert!(film.every >= 2);
        assert!(film.frames[0].time < 0.05 && film.duration() > 69.0);
    }
}
