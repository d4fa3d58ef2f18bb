//! A recording, and its replay.
//!
//! ```text
//!  Empty ── begin ──► UnderWay ── end ──► Over ◄── close ── Shown
//!                        ▲                 │  ── open ───────▲
//!                        └───── begin ─────┘
//! ```

mod curve;
mod film;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context as _, bail};
use palpa::live::Ruler;
use palpa_viewer::control::RecordingInfo;
use palpa_viewer::wire::FrameSnapshot;

use self::film::Film;
use crate::publish::MeshBytes;

pub(crate) use curve::curve_of;
pub(crate) use film::new_log;

/// Longest recording, s: the log of one hour has some gigabytes.
const LONGEST: f64 = 3600.0;

/// The one recording of a session.
#[derive(Debug, Default)]
pub(crate) enum Tape {
    /// Nothing was recorded yet.
    #[default]
    Empty,
    /// A recording is under way.
    UnderWay(Film),
    /// The recording is over; pages see the body.
    Over(Film, Player),
    /// The recording is over, and pages see it instead of the body.
    Shown(Film, Player),
}

/// A place on the film.
#[derive(Debug, Default)]
pub(crate) struct Player {
    /// Its time, s since the start of the recording.
    at: f64,
    /// Whether it plays by itself.
    is_playing: bool,
}

impl Tape {
    /// Begins a recording whose log is at `log`, of a body whose skin is that of `ruler`. The previous
    /// recording is dropped.
    pub(crate) fn begin(&mut self, log: PathBuf, ruler: Arc<Ruler>) {
        *self = Self::UnderWay(Film::new(log, ruler));
    }

    /// Whether a recording is under way.
    pub(crate) fn is_under_way(&self) -> bool {
        matches!(self, Self::UnderWay(_))
    }

    /// Whether the recording under way has reached the maximum duration; `now` is the engine's
    /// clock, s.
    pub(crate) fn is_full(&self, now: f64) -> bool {
        self.is_under_way() && now > LONGEST
    }

    /// Ends the recording. Returns whether one was under way.
    pub(crate) fn end(&mut self) -> bool {
        match std::mem::take(self) {
            Self::UnderWay(film) => {
                *self = Self::Over(film, Player::default());
                true
            }
            other => {
                *self = other;
                false
            }
        }
    }

    /// Adds a frame and its mesh to the recording under way.
    pub(crate) fn add(&mut self, frame: &FrameSnapshot, mesh: &MeshBytes) {
        if let Self::UnderWay(film) = self {
            film.add(frame, mesh);
        }
    }

    /// The log of the recording, and the skin of its body, once it is over.
    pub(crate) fn log(&self) -> Option<(&Path, &Arc<Ruler>)> {
        match self {
            Self::Over(film, _) | Self::Shown(film, _) => Some((film.log(), film.ruler())),
            Self::Empty | Self::UnderWay(_) => None,
        }
    }

    /// Shows the recording from its beginning.
    ///
    /// # Errors
    /// When there is none, or it is empty.
    pub(crate) fn open(&mut self) -> anyhow::Result<()> {
        let (film, _) = self.over()?;
        if film.at(0.0).is_none() {
            bail!("the recording is too short: it holds no moment to be shown");
        }
        if let Self::Over(film, _) | Self::Shown(film, _) = std::mem::take(self) {
            *self = Self::Shown(film, Player::default());
        }
        Ok(())
    }

    /// Shows the body again.
    pub(crate) fn close(&mut self) {
        *self = match std::mem::take(self) {
            Self::Shown(film, Player { at, .. }) => {
                let is_playing = false;
                Self::Over(film, Player { at, is_playing })
            }
            other => other,
        };
    }

    /// Goes to a moment, s since the start of the recording.
    ///
    /// # Errors
    /// When there is no recording, or the time is not a number.
    pub(crate) fn seek(&mut self, time: f64) -> anyhow::Result<()> {
        if !time.is_finite() {
            bail!("the time is not a number");
        }
        let (film, player) = self.over()?;
        player.at = time.clamp(0.0, film.duration());
        Ok(())
    }

    /// Plays the replay, from the start if it is at the end; or pauses it.
    ///
    /// # Errors
    /// When there is no recording.
    pub(crate) fn play(&mut self, on: bool) -> anyhow::Result<()> {
        let (film, player) = self.over()?;
        if on && player.at >= film.duration() {
            player.at = 0.0;
        }
        player.is_playing = on;
        Ok(())
    }

    fn over(&mut self) -> anyhow::Result<(&Film, &mut Player)> {
        match self {
            Self::Over(film, player) | Self::Shown(film, player) => Some((&*film, player)),
            Self::Empty | Self::UnderWay(_) => None,
        }
        .context("there is no recording to be shown; make one first")
    }

    /// Moves a replay on by `dt` seconds. Returns whether it has just reached its end.
    pub(crate) fn advance(&mut self, dt: f64) -> bool {
        let Ok((film, player)) = self.over() else {
            return false;
        };
        if !player.is_playing {
            return false;
        }
        player.at += dt;
        if player.at < film.duration() {
            return false;
        }
        player.at = film.duration();
        player.is_playing = false;
        true
    }

    /// While the recording is shown, its present frame and mesh.
    pub(crate) fn shown(&self) -> Option<(&FrameSnapshot, &MeshBytes)> {
        match self {
            Self::Shown(film, player) => film.at(player.at),
            Self::Empty | Self::UnderWay(_) | Self::Over(..) => None,
        }
    }

    /// The recording for the state.
    pub(crate) fn info(&self) -> RecordingInfo {
        match self {
            Self::Empty => RecordingInfo::default(),
            Self::UnderWay(_) => RecordingInfo {
                is_recording: true,
                ..RecordingInfo::default()
            },
            Self::Over(film, player) | Self::Shown(film, player) => RecordingInfo {
                is_recording: false,
                duration: film.duration(),
                is_replaying: matches!(self, Self::Shown(..)),
                is_playing: player.is_playing,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ruler() -> Arc<Ruler> {
        let skin = palpa_mesh::Surface::default();
        Arc::new(Ruler::new(skin, palpa_servo::Pose::identity()))
    }

    fn recorded(n_frames: u32) -> Tape {
        let mut tape = Tape::default();
        tape.begin(PathBuf::from("log.mcap"), ruler());
        for k in 0..n_frames {
            let frame = FrameSnapshot {
                time: 0.1 * f64::from(k),
                mesh: 1,
                ..FrameSnapshot::default()
            };
            tape.add(&frame, &Arc::new(vec![1]));
        }
        assert!(tape.info().is_recording && tape.log().is_none() && tape.shown().is_none());
        assert!(tape.open().is_err());
        assert!(tape.end() && !tape.end());
        tape
    }

    #[test]
    fn a_replay_plays_to_its_end_and_from_the_beginning_again() {
        let mut tape = recorded(10);
        assert!(tape.shown().is_none());
        tape.open().unwrap();
        tape.seek(0.65).unwrap();
        assert!((tape.shown().unwrap().0.time - 0.6).abs() < 1e-12);
        tape.play(true).unwrap();
        assert!(!tape.advance(0.1));
        assert!(tape.info().is_playing);
        assert!(tape.advance(5.0));
        assert!(!tape.info().is_playing && !tape.advance(5.0));
        assert!((tape.shown().unwrap().0.time - 0.9).abs() < 1e-12);
        tape.play(true).unwrap();
        assert!(tape.shown().unwrap().0.time.abs() < 1e-12);
        tape.close();
        let info = tape.info();
        assert!(!info.is_replaying && !info.is_playing && tape.shown().is_none());
        assert!((info.duration - 0.9).abs() < 1e-12);
    }

    #[test]
    fn what_was_not_recorded_is_not_shown() {
        let mut tape = Tape::default();
        assert!(tape.open().is_err() && tape.seek(0.0).is_err() && tape.play(true).is_err());
        tape.close();
        assert_eq!(tape.info(), RecordingInfo::default());
        let mut empty = recorded(0);
        let error = empty.open().unwrap_err().to_string();
        assert!(error.contains("too short"), "{error}");
        assert!(empty.log().is_some());
    }

    #[test]
    fn a_recording_lasts_an_hour_at_most() {
        let mut tape = recorded(1);
        assert!(!tape.is_full(4000.0));
        tape.begin(PathBuf::new(), ruler());
        assert!(!tape.is_full(3599.0) && tape.is_full(3601.0));
    }
}
