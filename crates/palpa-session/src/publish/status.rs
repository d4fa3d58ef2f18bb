//! The texts: the state of the session, its problem, and notices.

use std::sync::{Arc, Mutex, PoisonError};

use palpa_scene::Scene;
use palpa_viewer::Publisher;
use palpa_viewer::control::{
    EngineFigures, Field, GameInfo, Notice, NoticeKind, NoticeLevel, Phase, Problem, RecordingInfo,
    State,
};

use crate::history::Wanted;
use crate::own;
use crate::veil::Veil;
use crate::world::World;
use crate::{edit, gallery, game};

/// The parts of the state that change without a request.
#[derive(Debug)]
pub(crate) struct Told {
    /// Phase of the engine.
    pub(crate) phase: Phase,
    /// Whether the scene's motion runs.
    pub(crate) is_motion_running: bool,
    /// The recording.
    pub(crate) recording: RecordingInfo,
    /// The game, if one is on.
    pub(crate) game: Option<GameInfo>,
    /// Number of rounds in the table of results.
    pub(crate) n_game_results: u32,
    /// Number of changes of the scene that can be undone.
    pub(crate) n_undo: u32,
    /// Number of changes of the scene that can be redone.
    pub(crate) n_redo: u32,
}

/// The state as last sent to pages.
pub(crate) struct Status {
    publisher: Publisher,
    state: State,
    is_changed: bool,
    /// The problem as the server sees it: set only while nothing runs.
    problem: Arc<Mutex<Option<String>>>,
}

impl Status {
    /// The state of a session that begins. `problem` is shared with the server.
    pub(crate) fn new(
        publisher: Publisher,
        allows_faults: bool,
        problem: Arc<Mutex<Option<String>>>,
    ) -> Self {
        Self {
            publisher,
            state: State {
                gallery: gallery::entries(),
                levels: game::levels(),
                allows_faults,
                ..State::default()
            },
            is_changed: true,
            problem,
        }
    }

    /// Marks the state as changed: it is sent with the next frame.
    pub(crate) fn change(&mut self) {
        self.is_changed = true;
    }

    /// The field that frames carry.
    pub(crate) fn field(&self) -> Field {
        self.state.field
    }

    /// Sets the field that frames carry.
    pub(crate) fn set_field(&mut self, field: Field) {
        self.state.field = field;
        self.is_changed = true;
    }

    /// Describes the present body in the state. `wanted` is its scene, without the lumps of a game.
    pub(crate) fn describe(&mut self, world: &World, wanted: &Wanted, veil: Veil<'_>) {
        self.is_changed = true;
        let scene: Scene = veil.scene(&world.scene);
        let state = &mut self.state;
        // A scene that was read can also be written.
        state.scene = edit::to_json(&scene).unwrap_or_default();
        state.gallery_key.clone_from(&wanted.key);
        state.origin = wanted.origin.number;
        state.is_changed = wanted.is_changed();
        state.files = own::names_of(&wanted.scene);
        state.layers.clone_from(&world.layers);
        state.lumps = veil.lumps(&world.lumps);
        state.tool = world.tool.clone();
        state.home = world.home_hand();
        state.usual_depth = world.scene.motion.depth.min(world.greatest_depth());
        state.greatest_depth = world.greatest_depth();
        state.max_force = palpa::live::device_model(world.scene.device.preset)
            .spec
            .max_force;
        state.method = world.method;
        state.notes = veil.notes(&world.notes);
        state.n_nodes = world.n_nodes() as u32;
    }

    /// Reports a problem, which stays until [`Self::well`] is called. `is_running` says whether a
    /// body is running nevertheless.
    pub(crate) fn fail(&mut self, problem: Problem, is_running: bool) {
        let what = NoticeKind::Problem {
            problem: problem.clone(),
        };
        self.notice(NoticeLevel::Error, what);
        self.set_problem(Some(problem), is_running);
    }

    /// Clears the problem.
    pub(crate) fn well(&mut self) {
        self.set_problem(None, true);
    }

    fn set_problem(&mut self, problem: Option<Problem>, is_running: bool) {
        self.is_changed = true;
        self.state.problem.clone_from(&problem);
        // For the server, the session works as long as a body is running.
        let shown = (problem.filter(|_| !is_running)).map(|problem| problem.to_string());
        *self.problem.lock().unwrap_or_else(PoisonError::into_inner) = shown;
    }

    /// Sends a notice.
    pub(crate) fn notice(&self, level: NoticeLevel, what: NoticeKind) {
        self.publisher.notice(Notice { level, what });
    }

    /// Sends the engine's figures, and notices of its errors.
    pub(crate) fn tell_figures(&self, figures: EngineFigures, notices: Vec<Notice>) {
        self.publisher.engine(figures);
        for notice in notices {
            self.publisher.notice(notice);
        }
    }

    /// Sends the state if it has changed.
    pub(crate) fn tell(&mut self, told: impl FnOnce() -> Told) {
        if !std::mem::take(&mut self.is_changed) {
            return;
        }
        let Told {
            phase,
            is_motion_running,
            recording,
            game,
            n_game_results,
            n_undo,
            n_redo,
        } = told();
        let state = &mut self.state;
        state.revision += 1;
        state.phase = phase;
        state.is_motion_running = is_motion_running;
        state.recording = recording;
        state.game = game;
        state.n_game_results = n_game_results;
        (state.n_undo, state.n_redo) = (n_undo, n_redo);
        self.publisher.state(state.clone());
    }
}
