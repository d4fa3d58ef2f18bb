//! A recording as it is looked at again: its frames in memory, beside the log that the engine writes.

use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context as _, bail};
use palpa_viewer::control::RecordingInfo;
use palpa_viewer::wire::FrameSnapshot;

/// Frames kept take this much memory at most; then every other one is dropped, so that the whole time is still there.
const MOST_BYTES: usize = 200 << 20;
/// Longest recording, s: the log of an hour is some gigabytes.
pub(super) const LONGEST: f64 = 3600.0;

/// A file for a log in a folder, which is made if need be: the first number that is free, also where others record there.
///
/// # Errors
/// When the folder or the file cannot be made.
pub(super) fn new_log(folder: &Path) -> anyhow::Result<PathBuf> {
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
    bail!("{} is full of recordings", folder.display())
}

/// A mesh, as bytes of a snapshot.
pub(super) type MeshBytes = Arc<Vec<u8>>;

/// What was recorded, or is being recorded.
#[derive(Debug)]
pub(super) struct Recording {
    log: PathBuf,
    began: f64,
    frames: Vec<FrameSnapshot>,
    meshes: Vec<(u32, MeshBytes)>,
    bytes: usize,
    /// Of the frames that come, one in so many is kept.
    every: usize,
    n_seen: usize,
    is_over: bool,
    /// What is shown, s since the beginning.
    pub(super) at: f64,
    /// Whether it is shown instead of the body that is pressed.
    pub(super) is_shown: bool,
    /// Whether it goes on by itself.
    pub(super) is_playing: bool,
}

impl Recording {
    /// One that begins at `began` on the engine's clock, s, and whose log is written to `log`.
    pub(super) fn begin(log: PathBuf, began: f64) -> Self {
        Self {
            log,
            began,
            frames: Vec::new(),
            meshes: Vec::new(),
            bytes: 0,
            every: 1,
            n_seen: 0,
            is_over: false,
            at: 0.0,
            is_shown: false,
            is_playing: false,
        }
    }

    /// Whether it is under way.
    pub(super) fn is_under_way(&self) -> bool {
        !self.is_over
    }

    /// Nothing more is added.
    pub(super) fn end(&mut self) {
        self.is_over = true;
    }

    /// The log.
    pub(super) fn log(&self) -> &Path {
        &self.log
    }

    /// How long it is, s.
    pub(super) fn duration(&self) -> f64 {
        self.frames.last().map_or(0.0, |frame| frame.time)
    }

    /// Adds a frame, and the mesh that it is of.
    pub(super) fn add(&mut self, frame: &FrameSnapshot, mesh: &MeshBytes) {
        if self.is_over {
            return;
        }
        self.n_seen += 1;
        if !self.n_seen.is_multiple_of(self.every) {
            return;
        }
        if self.meshes.last().is_none_or(|(id, _)| *id != frame.mesh) {
            self.bytes += mesh.len();
            self.meshes.push((frame.mesh, Arc::clone(mesh)));
        }
        let mut frame = frame.clone();
        frame.time -= self.began;
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

    /// The frame of the moment that is shown, and its mesh.
    pub(super) fn shown(&self) -> Option<(&FrameSnapshot, &MeshBytes)> {
        let after = self.frames.partition_point(|frame| frame.time <= self.at);
        let frame = self.frames.get(after.saturating_sub(1))?;
        let mesh = self.meshes.iter().rev().find(|(id, _)| *id == frame.mesh)?;
        Some((frame, &mesh.1))
    }

    /// Goes on by itself for `dt` seconds; at its end it stands.
    pub(super) fn advance(&mut self, dt: f64) {
        if self.is_playing {
            self.at += dt;
            if self.at >= self.duration() {
                self.at = self.duration();
                self.is_playing = false;
            }
        }
    }

    /// As pages are told.
    pub(super) fn info(&self) -> RecordingInfo {
        RecordingInfo {
            is_recording: self.is_under_way(),
            duration: if self.is_under_way() {
                0.0
            } else {
                self.duration()
            },
            is_replaying: self.is_shown,
            is_playing: self.is_playing,
        }
    }
}

fn bytes_of(frame: &FrameSnapshot) -> usize {
    size_of::<FrameSnapshot>() + 2 * (frame.displacements.len() + frame.field_values.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(time: f64, mesh: u32, n: usize) -> FrameSnapshot {
        FrameSnapshot {
            time,
            mesh,
            displacements: vec![0; n],
            ..FrameSnapshot::default()
        }
    }

    #[test]
    fn the_moment_shown_is_the_last_frame_before_it_with_its_own_mesh() {
        let mut recording = Recording::begin(PathBuf::new(), 10.0);
        let meshes = [1, 2].map(|i| Arc::new(vec![i]));
        for k in 0..10 {
            let mesh = 1 + u32::from(k >= 5);
            recording.add(
                &frame(10.0 + 0.1 * f64::from(k), mesh, 3),
                &meshes[mesh as usize - 1],
            );
        }
        recording.end();
        assert!((recording.duration() - 0.9).abs() < 1e-12);
        recording.at = 0.65;
        let (shown, mesh) = recording.shown().unwrap();
        assert!((shown.time - 0.6).abs() < 1e-12 && shown.is_replay == 1);
        assert_eq!(**mesh, [2]);
        recording.at = 0.0;
        assert_eq!(**recording.shown().unwrap().1, [1]);
        recording.is_playing = true;
        recording.advance(5.0);
        assert!(!recording.is_playing && recording.at >= recording.duration());
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
        let mut recording = Recording::begin(PathBuf::new(), 0.0);
        let mesh = Arc::new(vec![0; 1000]);
        for k in 0..700 {
            recording.add(&frame(0.1 * f64::from(k), 1, 300_000), &mesh);
            assert!(recording.bytes <= MOST_BYTES);
        }
        assert!(recording.every >= 2);
        assert!(recording.frames[0].time < 0.05 && recording.duration() > 69.0);
    }
}
