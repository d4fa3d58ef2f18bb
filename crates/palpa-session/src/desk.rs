//! The desk: passes each request to the part of the session that handles it.
//!
//! A request that concerns several parts is a method here; all other code is in the parts.

use std::path::PathBuf;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use anyhow::{Context as _, bail};
use palpa::live::{machine, notes_of};
use palpa::one_paragraph;
use palpa_rt::RecorderParams;
use palpa_scene::Scene;
use palpa_viewer::control::{Field, Hand, NoticeKind, NoticeLevel, Phase, Problem, Request};
use palpa_viewer::{Answer, Clients, HostFile, Publisher};

use crate::bars::Bars;
use crate::builder::{Builder, Wanted};
use crate::drill::Drills;
use crate::game::Game;
use crate::hand::{goal_of, in_range};
use crate::palpation::Palpation;
use crate::publish::{Fields, Screen, Status, Told, granted};
use crate::remote::{Material, Order};
use crate::replay::{Tape, new_log};
use crate::session::SessionParams;
use crate::stage::Stage;
use crate::veil::Veil;
use crate::world::World;
use crate::{edit, gallery};

/// The threads beside the session's own.
pub(crate) struct Workers {
    /// Fields over the nodes.
    pub(crate) fields: Fields,
    /// Error bars.
    pub(crate) bars: Bars,
}

/// The parts of a session.
pub(crate) struct Desk {
    /// The folder for recordings.
    out: PathBuf,
    /// Seed of the next round of the game, if the page gives none.
    seed: Option<u64>,
    clients: Clients,
    stage: Stage,
    builder: Builder,
    tape: Tape,
    game: Option<Game>,
    bars: Bars,
    drills: Drills,
    palpation: Palpation,
    screen: Screen,
    status: Status,
}

impl Desk {
    /// A desk without a body. The result of a build arrives in `orders`; `problem` is shared with
    /// the server.
    pub(crate) fn new(
        params: SessionParams,
        orders: Sender<Order>,
        problem: Arc<Mutex<Option<String>>>,
        publisher: Publisher,
        workers: Workers,
    ) -> Self {
        let wanted = Wanted {
            scene: params.scene,
            key: params.gallery_key,
        };
        Self {
            out: params.out,
            seed: params.seed,
            clients: Clients::default(),
            stage: Stage::default(),
            builder: Builder::new(wanted, orders),
            tape: Tape::default(),
            game: None,
            bars: workers.bars,
            drills: Drills::new(params.allows_faults),
            palpation: Palpation::default(),
            screen: Screen::new(publisher.clone(), workers.fields),
            status: Status::new(publisher, params.allows_faults, problem),
        }
    }

    /// Carries out an order.
    pub(crate) fn obey(&mut self, order: Order) {
        if !matches!(order, Order::Request(Request::Hand(_), _)) {
            self.screen.wake();
        }
        match order {
            Order::Request(request, answer) => self.answer(request, answer),
            Order::Clients(clients) => {
                if clients.controller != self.clients.controller {
                    self.lift();
                }
                self.clients = clients;
            }
            Order::File(file, reply) => {
                // The client may have gone.
                let _ = reply.send(self.material(file));
            }
            Order::Built(world) => self.take_over(*world),
            Order::Stop => {}
        }
    }

    fn answer(&mut self, request: Request, answer: Answer) {
        if !matches!(request, Request::Hand(_)) {
            self.status.change();
        }
        let result = self.request(request, Instant::now());
        answer(result.map_err(|error| one_paragraph(&error)));
    }

    fn request(&mut self, request: Request, now: Instant) -> anyhow::Result<()> {
        match request {
            // The server has handled it.
            Request::TakeControl => {}
            Request::Hand(hand) => self.put_hand(&hand, now)?,
            Request::Lift => self.lift(),
            Request::LoadScene { key } => {
                let scene = gallery::scene(&key)?;
                self.want(scene, Some(key))?;
            }
            Request::LoadText { text } => {
                let scene = edit::parsed(&text, &self.builder.wanted.scene.base_dir)?;
                self.want(scene, None)?;
            }
            Request::Edit { edits } => {
                let Wanted { scene, key } = &self.builder.wanted;
                let (scene, key) = (edit::edited(scene, &edits)?, key.clone());
                self.want(scene, key)?;
            }
            Request::RunMotion => {
                self.tape.close();
                let live = self.stage.need()?;
                live.hand.run_motion(live.world.home, now);
            }
            Request::StopMotion => {
                self.end_motion();
                self.lift();
            }
            Request::StartRecording => self.start_recording()?,
            Request::StopRecording => self.stop_recording()?,
            Request::OpenReplay => {
                self.lift();
                self.tape.open()?;
            }
            Request::CloseReplay => self.tape.close(),
            Request::Seek { time } => self.tape.seek(time)?,
            Request::Play { on } => self.tape.play(on)?,
            Request::ShowField { field } => {
                self.veil().check_field(field)?;
                self.status.set_field(field);
            }
            Request::ClearMap => self.palpation.clear(),
            Request::StartGame { seed, n_lumps } => self.start_game(seed, n_lumps)?,
            Request::Mark { point } => self.game()?.mark(in_range(point, "point")?)?,
            Request::Unmark => self.game()?.unmark(),
            Request::Reveal => self.reveal()?,
            Request::EndGame => self.end_game()?,
            Request::Inject { fault } => {
                self.drills.check_allowed()?;
                let engine = &self.stage.need()?.running.engine;
                self.drills.inject(fault, engine.faults(), now);
            }
            Request::Restart => self.build(),
        }
        Ok(())
    }

    // The scene and its body.

    fn want(&mut self, scene: Scene, key: Option<String>) -> anyhow::Result<()> {
        if self.game.is_some() {
            bail!("the scene cannot be changed while lumps are hidden; end the game first");
        }
        if self.tape.is_under_way() {
            bail!("the scene cannot be changed while it is recorded; stop the recording first");
        }
        self.tape.close();
        if self.end_motion() {
            self.status
                .notice(NoticeLevel::Info, NoticeKind::MotionEnded);
        }
        self.builder.wanted = Wanted { scene, key };
        self.build();
        Ok(())
    }

    /// Builds the wanted scene.
    pub(crate) fn build(&mut self) {
        self.status.change();
        if let Err(error) = self.builder.build() {
            self.fail(Problem::NoThread {
                reason: error.to_string(),
            });
        }
    }

    fn take_over(&mut self, built: anyhow::Result<World>) {
        self.status.change();
        if !self.builder.finish() {
            return self.build();
        }
        match built.and_then(|world| self.stage.replace(world)) {
            Ok(()) => {
                // What was felt belongs to the body before.
                self.palpation.clear();
                self.describe();
                self.status.well();
                if let Some(game) = &mut self.game {
                    game.begin();
                }
            }
            Err(error) => {
                self.fail(refused(&error));
                if let Some(live) = self.stage.live() {
                    // The previous body stays, and so does its scene.
                    self.builder.wanted = Wanted {
                        scene: live.world.scene.clone(),
                        key: self.status.gallery_key().map(str::to_owned),
                    };
                }
            }
        }
    }

    /// Restarts the engine with the body at rest. If the body is lost in the process, pages see the
    /// reason, and the body is built again.
    fn restart(&mut self, recorder: &RecorderParams) -> anyhow::Result<()> {
        let outcome = self.stage.restart(recorder);
        if self.stage.live().is_some() {
            self.describe();
        } else if let Err(error) = &outcome {
            self.fail(refused(error));
            self.build();
        }
        outcome
    }

    fn describe(&mut self) {
        if let Some(live) = self.stage.live() {
            let key = self.builder.wanted.key.as_deref();
            let veil = Veil::of(self.game.as_ref());
            self.status.describe(&live.world, key, veil);
        }
    }

    fn fail(&mut self, problem: Problem) {
        let is_running = self.stage.live().is_some();
        self.status.fail(problem, is_running);
    }

    // The hand.

    fn put_hand(&mut self, hand: &Hand, now: Instant) -> anyhow::Result<()> {
        let live = self.stage.need()?;
        let goal = goal_of(hand, &live.world.skin, live.world.greatest_depth())?;
        live.hand.put(goal, now)
    }

    fn lift(&mut self) {
        if let Some(live) = self.stage.live_mut() {
            live.hand.lift();
        }
    }

    fn end_motion(&mut self) -> bool {
        let live = self.stage.live_mut();
        live.is_some_and(|live| live.hand.end_motion())
    }

    // The recording.

    fn start_recording(&mut self) -> anyhow::Result<()> {
        if self.tape.is_under_way() {
            bail!("a recording is under way already");
        }
        self.veil().check_recording()?;
        self.tape.close();
        self.end_motion();
        let world = &self.stage.need()?.world;
        let (scene, ruler) = (&world.scene, Arc::clone(&world.ruler));
        let (text, notes) = (scene.to_toml(), notes_of(scene)?);
        let log = new_log(&self.out)?;
        self.restart(&RecorderParams {
            path: Some(log.clone()),
            scene: text,
            notes,
            machine: machine(),
        })?;
        self.tape.begin(log, ruler);
        Ok(())
    }

    fn stop_recording(&mut self) -> anyhow::Result<()> {
        if !self.tape.end() {
            bail!("nothing is being recorded");
        }
        self.status.change();
        // The log is complete only when its engine has ended. The body then continues, at rest.
        if self.stage.live().is_some() {
            self.restart(&RecorderParams::default())?;
        }
        Ok(())
    }

    // Find the lump.

    fn veil(&self) -> Veil<'_> {
        Veil::of(self.game.as_ref())
    }

    fn game(&mut self) -> anyhow::Result<&mut Game> {
        let game = self.game.as_mut();
        game.context("no lumps are hidden; begin a round first")
    }

    fn start_game(&mut self, seed: Option<u64>, n_lumps: u32) -> anyhow::Result<()> {
        if self.tape.is_under_way() {
            bail!("a recording is under way; stop it first");
        }
        let live = self.stage.need()?;
        let before = match &self.game {
            Some(game) => &game.before,
            None => &self.builder.wanted.scene,
        };
        let (game, scene) = Game::hide(&live.world, before, seed.or(self.seed), n_lumps)?;
        if let Some(next) = &mut self.seed {
            *next = next.wrapping_add(1);
        }
        self.tape.close();
        live.hand.end_motion();
        self.status.set_field(Field::None);
        self.game = Some(game);
        self.builder.wanted.scene = scene;
        // Hide the scene's own lumps from pages too.
        self.describe();
        self.build();
        Ok(())
    }

    fn reveal(&mut self) -> anyhow::Result<()> {
        let live = self.stage.need()?;
        let game = self.game.as_mut();
        let game = game.context("no lumps are hidden; begin a round first")?;
        if self.builder.is_building() {
            bail!("the lumps are still being hidden");
        }
        game.reveal(&live.world);
        // The new mesh shows the stiffness of its lumps.
        self.screen.renew_mesh();
        self.describe();
        Ok(())
    }

    fn end_game(&mut self) -> anyhow::Result<()> {
        let game = self.game.take().context("no round is under way")?;
        self.builder.wanted.scene = game.before;
        self.build();
        Ok(())
    }

    // The files.

    fn material(&self, file: HostFile) -> Option<Material> {
        let veil = self.veil();
        match file {
            HostFile::Scene => {
                let scene = veil.scene_file(&self.builder.wanted.scene);
                Some(Material::Scene(scene.to_toml()))
            }
            HostFile::Body if !veil.shows_body_file() => None,
            HostFile::Body => self.stage.live()?.body(),
            HostFile::Map | HostFile::MapCsv if !veil.shows_map() => None,
            HostFile::Map | HostFile::MapCsv => {
                let skin = self.stage.live()?.world.skin.surface().clone();
                Some(Material::Map(Box::new(self.palpation.whole()), skin))
            }
            HostFile::RecordingLog | HostFile::RecordingCsv | HostFile::RecordingCurve => {
                let (log, ruler) = self.tape.log()?;
                Some(Material::Log(log.to_owned(), Arc::clone(ruler)))
            }
            HostFile::Spectrum => {
                let ticks = self.stage.live()?.running.engine.late_ticks();
                Some(Material::Ticks(ticks))
            }
        }
    }

    // Time.

    /// Advances everything by `dt` seconds, and shows a frame.
    pub(crate) fn advance(&mut self, dt: f64, now: Instant) {
        if let Some(live) = self.stage.live_mut() {
            live.refresh();
            let was_in_motion = live.hand.is_in_motion();
            live.move_hand(dt, now);
            if was_in_motion != live.hand.is_in_motion() {
                self.status.change();
            }
        }
        let may_probe = self.screen.is_watched() && self.veil().shows_error_bars();
        let live = self.stage.live().filter(|_| may_probe);
        self.bars.advance(live, dt);
        let engine = self.stage.live().map(|live| &live.running.engine);
        self.drills
            .advance(engine.map(palpa_rt::Engine::faults), now);
        let is_full = engine.is_some_and(|engine| self.tape.is_full(engine.now()));
        if self.tape.advance(dt) {
            self.status.change();
        }
        self.show(dt);
        if is_full {
            // A failure is reported as the session's problem.
            let _ = self.stop_recording();
            self.status
                .notice(NoticeLevel::Warning, NoticeKind::RecordingFull);
        }
    }

    /// Makes a frame of the body, and shows it or the frame of a replay.
    fn show(&mut self, dt: f64) {
        let mut is_made = false;
        let pressed = self.stage.live().map(|live| self.screen.put_tick(live));
        let recorded = self.tape.shown().map(|(frame, _)| frame);
        let is_due = self.screen.is_due(recorded, dt);
        if let (Some(live), Some((place, force))) = (self.stage.live(), pressed) {
            if let Some(game) = &mut self.game {
                game.feel(place, force, dt);
            }
            (self.palpation).feel(self.screen.tick(), &live.world, dt);
            let is_wanted = self.tape.is_under_way() || self.screen.is_watched() && is_due;
            let shows_lumps = Veil::of(self.game.as_ref()).shows_lumps();
            if live.entry.tick.tick > 0
                && is_wanted
                && let Some((frame, mesh)) =
                    self.screen.put_body(live, shows_lumps, self.status.field())
            {
                self.tape.add(frame, mesh);
                is_made = true;
            }
        }
        let is_hidden = !Veil::of(self.game.as_ref()).shows_map();
        if self.screen.is_watched()
            && let Some(map) = self.palpation.news(is_hidden, dt)
        {
            self.screen.show_map(&map);
        }
        match self.tape.shown() {
            Some((frame, mesh)) if is_due => self.screen.show_recorded(frame, mesh),
            None if is_made && is_due => self.screen.show_body(),
            _ => {}
        }
    }

    /// Sends the engine's figures. First restarts an engine that has lost a thread.
    pub(crate) fn tell_figures(&mut self) {
        self.watch_over();
        if self.veil().is_drawn() {
            // The game's clock is part of the state.
            self.status.change();
        }
        let Some(live) = self.stage.live_mut() else {
            return;
        };
        let n_nodes = match self.screen.n_nodes() {
            0 => live.world.n_nodes(),
            n => n,
        };
        let (mut figures, notices) = live.figures(n_nodes, self.screen.n_frames());
        figures.error_bar = self.bars.present();
        (figures.granted).push(granted(self.bars.granted()));
        self.status.tell_figures(figures, notices);
    }

    /// Restarts an engine that has lost its tissue thread, because it gives no force.
    fn watch_over(&mut self) {
        let live = self.stage.live();
        let ended = live.map_or_else(Vec::new, |live| live.running.engine.ended());
        let Some(thread) = ended.first() else { return };
        let thread = (*thread).to_owned();
        self.status
            .notice(NoticeLevel::Error, NoticeKind::ThreadLost { thread });
        self.tape.end();
        self.end_motion();
        match self.stage.restart(&RecorderParams::default()) {
            Ok(()) => self.describe(),
            Err(error) => self.fail(refused(&error)),
        }
    }

    /// Sends the state if it has changed.
    pub(crate) fn tell_state(&mut self) {
        let live = self.stage.live();
        self.status.tell(|| Told {
            phase: match live {
                _ if self.builder.is_building() => Phase::Building,
                Some(_) => Phase::Running,
                None => Phase::Stopped,
            },
            is_motion_running: live.is_some_and(|live| live.hand.is_in_motion()),
            recording: self.tape.info(),
            game: self.game.as_ref().map(Game::info),
        });
    }

    /// Ends the engine and closes a recording.
    pub(crate) fn end(mut self) {
        self.stage.end();
    }
}

fn refused(error: &anyhow::Error) -> Problem {
    Problem::Refused {
        text: one_paragraph(error),
    }
}
