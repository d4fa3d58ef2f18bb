//! The session's thread: requests in, snapshots out, sixty times a second.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use nalgebra::Point3;
use palpa_device::Path as HandPath;
use palpa_mesh::Vec3;
use palpa_rt::{RecorderParams, StepRecord, TickEntry};
use palpa_scene::Scene;
use palpa_servo::Pose;
use palpa_viewer::control::{
    FaultKind, Field, Hand, Notice, NoticeLevel, Phase, RecordingInfo, Request, State,
};
use palpa_viewer::wire::FrameSnapshot;
use palpa_viewer::{Answer, Clients, HostFile, Publisher};

use super::{edit, frame, gallery};
use crate::fields::Fields;
use crate::figures::Figures;
use crate::game::Game;
use crate::hand::{Goal, HandDriver, Place};
use crate::notes::shown;
use crate::recording::{self, MeshBytes, Recording};
use crate::remote::{Material, Order, Remote};
use crate::world::{BEFORE_THE_BROWSER, Running, World};
use palpa::live::{Look, Seen, notes_of, once_from};
use palpa::one_paragraph;

const PERIOD: Duration = Duration::from_micros(16_667);
const MOST_ORDERS: u32 = 1000;
const FIGURES_PERIOD: Duration = Duration::from_millis(500);
/// A page says at least so often where the hand is while it presses; one that says nothing for so long has let go.
const HAND_SILENCE: Duration = Duration::from_secs(1);
/// A pause of the tissue, on purpose.
const PAUSE: Duration = Duration::from_millis(500);
/// The hand goes home before a motion begins; after so long it begins anyway.
const HOMING: Duration = Duration::from_secs(5);

/// How a session begins.
#[derive(Debug, Clone)]
pub struct SessionParams {
    /// The scene.
    pub scene: Scene,
    /// Its key, if it is of the gallery.
    pub gallery_key: Option<String>,
    /// The folder for recordings.
    pub out: PathBuf,
    /// Seed of the first round of finding lumps, where the page gives none; the rounds after it count on.
    pub seed: Option<u64>,
    /// Whether pages may ask for faults.
    pub allows_faults: bool,
}

/// A session that does not run yet.
#[derive(Debug)]
pub struct Session {
    params: SessionParams,
    inbox: Receiver<Order>,
    orders: Sender<Order>,
    problem: Arc<Mutex<Option<String>>>,
}

/// A session that runs; dropped, it stops: the engine ramps down and a recording is closed.
#[derive(Debug)]
pub struct Handle {
    orders: Sender<Order>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Handle {
    fn drop(&mut self) {
        let _ = self.orders.send(Order::Stop);
        if let Some(thread) = self.thread.take() {
            // A panic has been reported where it happened.
            let _ = thread.join();
        }
    }
}

impl Session {
    /// A session, and what a server asks it by.
    pub fn new(params: SessionParams) -> (Self, Arc<Remote>) {
        let (orders, inbox) = channel();
        let problem = Arc::<Mutex<Option<String>>>::default();
        let remote = Arc::new(Remote {
            orders: orders.clone(),
            problem: Arc::clone(&problem),
        });
        let session = Self {
            params,
            inbox,
            orders,
            problem,
        };
        (session, remote)
    }

    /// Runs it on a thread of its own.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub fn start(self, publisher: Publisher) -> anyhow::Result<Handle> {
        let orders = self.orders.clone();
        let fields = Fields::start()?;
        let thread = thread::Builder::new()
            .name("palpa-session".to_owned())
            .spawn(move || {
                // It moves the hand: as near to the tissue as the system lets it.
                BEFORE_THE_BROWSER.ask("palpa-session");
                Body::new(self, publisher, fields).run();
            })?;
        Ok(Handle {
            orders,
            thread: Some(thread),
        })
    }
}

/// A scene that is to be built.
#[derive(Debug, Clone)]
struct Wanted {
    scene: Scene,
    key: Option<String>,
}

/// The scene's motion, under way.
#[derive(Debug)]
enum Motion {
    Homing(Instant),
    Moving { path: HandPath, time: f64 },
}

/// What is pressed now.
struct Live {
    world: World,
    running: Running,
    hand: HandDriver,
    figures: Figures,
    entry: TickEntry,
    step: StepRecord,
    /// The mesh of the tissue that was sent last.
    mesh: u64,
    mesh_bytes: MeshBytes,
}

impl Live {
    /// Starts the engine on a body at rest with the hand over a place; with a recorder, where a replay begins.
    fn start(
        world: &World,
        place: Place,
        recorder: &RecorderParams,
    ) -> anyhow::Result<impl FnOnce(World) -> Self + use<>> {
        let along = world.scene_from_device.rotation * Vec3::x();
        let hand = HandDriver::over(place, along, world.tool_size());
        let tip = if recorder.path.is_some() {
            world.beginning()
        } else {
            hand.tip()
        };
        let running = world.start(tip, recorder)?;
        Ok(move |world| Self {
            world,
            running,
            hand,
            figures: Figures::new(),
            entry: TickEntry::default(),
            step: StepRecord::default(),
            mesh: 0,
            mesh_bytes: MeshBytes::default(),
        })
    }
}

/// All that the thread holds.
struct Body {
    params: SessionParams,
    inbox: Receiver<Order>,
    orders: Sender<Order>,
    problem: Arc<Mutex<Option<String>>>,
    publisher: Publisher,
    fields: Fields,
    live: Option<Live>,
    /// The scene of the body that is there, and what is asked for beyond it.
    wanted: Wanted,
    is_building: bool,
    is_stale: bool,
    state: State,
    is_changed: bool,
    heard: Option<Instant>,
    motion: Option<Motion>,
    recording: Option<Recording>,
    game: Option<Game>,
    /// Numbers of meshes and frames as pages see them.
    mesh: u32,
    shown_replay_mesh: Option<u32>,
    frame: FrameSnapshot,
    n_frames: u64,
    paused_until: Option<Instant>,
    clients: Clients,
}

impl Body {
    fn new(session: Session, publisher: Publisher, fields: Fields) -> Self {
        let Session {
            params,
            inbox,
            orders,
            problem,
        } = session;
        let wanted = Wanted {
            scene: params.scene.clone(),
            key: params.gallery_key.clone(),
        };
        let state = State {
            gallery: gallery::entries(),
            allows_faults: params.allows_faults,
            ..State::default()
        };
        Self {
            params,
            inbox,
            orders,
            problem,
            publisher,
            fields,
            live: None,
            wanted,
            is_building: false,
            is_stale: false,
            state,
            is_changed: true,
            heard: None,
            motion: None,
            recording: None,
            game: None,
            mesh: 0,
            shown_replay_mesh: None,
            frame: FrameSnapshot::default(),
            n_frames: 0,
            paused_until: None,
            clients: Clients::default(),
        }
    }

    fn run(mut self) {
        self.build();
        let mut due = Instant::now();
        let mut figures_due = due;
        let mut last = due;
        loop {
            let rest = due.saturating_duration_since(Instant::now());
            let mut next = match self.inbox.recv_timeout(rest) {
                Err(RecvTimeoutError::Disconnected) => return self.end(),
                next => next.ok(),
            };
            // All that lies there, up to what may come in a second: a page may ask for more than there are frames.
            let mut n_left = MOST_ORDERS;
            while let Some(order) = next {
                if matches!(order, Order::Stop) {
                    return self.end();
                }
                self.obey(order);
                n_left -= 1;
                next = if n_left > 0 {
                    self.inbox.try_recv().ok()
                } else {
                    None
                };
            }
            if Instant::now() < due {
                continue;
            }
            let now = Instant::now();
            due = (due + PERIOD).max(now);
            self.advance((now - last).as_secs_f64().min(0.1), now);
            last = now;
            if now >= figures_due {
                figures_due = now + FIGURES_PERIOD;
                self.tell_figures();
            }
            if std::mem::take(&mut self.is_changed) {
                self.tell_state();
            }
        }
    }

    fn end(self) {
        if let Some(live) = self.live {
            live.running.engine.stop();
        }
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::Request(request, answer) => self.answer(request, answer),
            Order::Clients(clients) => {
                if clients.controller != self.clients.controller {
                    self.lift();
                }
                self.clients = clients;
            }
            Order::File(file, reply) => {
                // Whoever asked may have gone.
                let _ = reply.send(self.material(file));
            }
            Order::Built(world) => self.take_over(*world),
            Order::Stop => {}
        }
    }

    fn answer(&mut self, request: Request, answer: Answer) {
        self.is_changed |= !matches!(request, Request::Hand(_));
        let result = self.request(request);
        answer(result.map_err(|error| one_paragraph(&error)));
    }

    fn request(&mut self, request: Request) -> anyhow::Result<()> {
        match request {
            // The server's own.
            Request::TakeControl => Ok(()),
            Request::Hand(hand) => self.put_hand(&hand),
            Request::Lift => {
                self.lift();
                Ok(())
            }
            Request::LoadScene { key } => {
                let scene = gallery::scene(&key)?;
                self.want(scene, Some(key))
            }
            Request::LoadText { text } => {
                let scene = edit::parsed(&text, &self.wanted.scene.base_dir)?;
                self.want(scene, None)
            }
            Request::Edit { edits } => {
                let scene = edit::edited(&self.wanted.scene, &edits)?;
                self.want(scene, self.wanted.key.clone())
            }
            Request::RunMotion => self.run_motion(),
            Request::StopMotion => {
                self.motion = None;
                self.lift();
                Ok(())
            }
            Request::StartRecording => self.start_recording(),
            Request::StopRecording => self.stop_recording(),
            Request::OpenReplay => self.open_replay(),
            Request::CloseReplay => {
                self.close_replay();
                Ok(())
            }
            Request::Seek { time } => self.seek(time),
            Request::Play { on } => self.play(on),
            Request::ShowField { field } => {
                if self.hides_lumps() && field != Field::None {
                    bail!("while lumps are hidden, only displacement may be shown");
                }
                self.state.field = field;
                Ok(())
            }
            Request::StartGame { seed, n_lumps } => self.start_game(seed, n_lumps),
            Request::Mark { point } => self.game()?.mark(finite(point, "point")?),
            Request::Unmark => {
                self.game()?.unmark();
                Ok(())
            }
            Request::Reveal => self.reveal(),
            Request::EndGame => self.end_game(),
            Request::Inject { fault } => self.inject(fault),
            Request::Restart => {
                self.build();
                Ok(())
            }
        }
    }

    // The scene and the body that is built from it.

    fn want(&mut self, scene: Scene, key: Option<String>) -> anyhow::Result<()> {
        if self.game.is_some() {
            bail!("the scene stays as it is while lumps are hidden; end the game first");
        }
        if self.is_recording() {
            bail!("the scene stays as it is while it is recorded; stop the recording first");
        }
        self.close_replay();
        if self.motion.take().is_some() {
            let text = "the motion ended: the scene was changed";
            self.notice(NoticeLevel::Info, text.to_owned());
        }
        self.wanted = Wanted { scene, key };
        self.build();
        Ok(())
    }

    /// Builds what is wanted on a thread of its own; if one is at it already, what it builds is left and the latest is built.
    fn build(&mut self) {
        self.is_stale = self.is_building;
        self.is_changed = true;
        if self.is_building {
            return;
        }
        let scene = self.wanted.scene.clone();
        let orders = self.orders.clone();
        let spawned = thread::Builder::new()
            .name("palpa-build".to_owned())
            .spawn(move || {
                let built = std::panic::catch_unwind(|| World::build(&scene));
                let built = built.unwrap_or_else(|_| {
                    Err(anyhow::anyhow!(
                        "building the body failed by a fault of Palpa, not of the scene"
                    ))
                });
                // A session that is over wants no body.
                let _ = orders.send(Order::Built(Box::new(built)));
            });
        match spawned {
            Ok(_) => self.is_building = true,
            Err(error) => self.fail(format!("no thread to build the body: {error}")),
        }
    }

    fn take_over(&mut self, world: anyhow::Result<World>) {
        self.is_building = false;
        self.is_changed = true;
        if self.is_stale {
            self.build();
            return;
        }
        let started = world.and_then(|world| self.start(world, None));
        if let Err(error) = started {
            self.fail(one_paragraph(&error));
            if let Some(live) = &self.live {
                // The body that is there goes on, and so does its scene.
                self.wanted.scene = live.world.scene.clone();
                self.wanted.key.clone_from(&self.state.gallery_key);
            }
            return;
        }
        self.set_problem(None);
        if let Some(game) = &mut self.game {
            game.begin();
        }
    }

    /// Starts the engine on a body at rest, and ends the one before. A recording begins where a replay does. If there is no
    /// starting it, the body before is there again.
    fn start(&mut self, world: World, log: Option<PathBuf>) -> anyhow::Result<()> {
        let recorder = match log {
            None => RecorderParams::default(),
            Some(path) => RecorderParams {
                path: Some(path),
                scene: world.scene.to_toml(),
                notes: notes_of(&world.scene)?,
            },
        };
        // First the old one: two at once would share the processor, and the first steps are the costliest.
        let before = self.live.take().map(|old| {
            old.running.engine.stop();
            (old.world, old.hand.place().point)
        });
        let home = world.home;
        // A body that was only changed is pressed where it was before.
        let same = (before.as_ref())
            .filter(|(old, _)| recorder.path.is_none() && old.scene.body == world.scene.body)
            .and_then(|(_, point)| world.skin.nearest(*point));
        let places = same.into_iter().chain([home]);
        let mut failed = None;
        for place in places {
            match Live::start(&world, place, &recorder) {
                Ok(live) => {
                    self.live = Some(live(world));
                    self.describe();
                    return Ok(());
                }
                Err(error) => failed = Some(error),
            }
        }
        if let Some((old, _)) = before
            && let Ok(live) = Live::start(&old, old.home, &RecorderParams::default())
        {
            self.live = Some(live(old));
        }
        self.is_changed = true;
        Err(failed.unwrap_or_else(|| anyhow::anyhow!("there is no place to begin")))
    }

    /// What pages are told of the body that is there.
    fn describe(&mut self) {
        self.is_changed = true;
        let Some(live) = &self.live else { return };
        let world = &live.world;
        let hides = self.hides_lumps();
        let mut scene = world.scene.clone();
        if hides {
            scene.lumps.clear();
        }
        let state = &mut self.state;
        // A scene that was read can be written.
        state.scene = edit::to_json(&scene).unwrap_or_default();
        state.gallery_key.clone_from(&self.wanted.key);
        state.layers.clone_from(&world.layers);
        state.lumps = if hides {
            Vec::new()
        } else {
            world.lumps.clone()
        };
        state.tool = world.tool.clone();
        state.home = world.home_hand();
        state.usual_depth = world.scene.motion.depth.min(world.greatest_depth());
        state.greatest_depth = world.greatest_depth();
        state.max_force = palpa::live::device_model(world.scene.device.preset)
            .spec
            .max_force;
        state.method = world.method;
        state.notes = (world.notes.iter())
            // A note on a lump says where it is.
            .filter(|note| !(hides && note.is_about_lumps()))
            .map(shown)
            .collect();
        state.n_nodes = world.n_nodes() as u32;
    }

    fn fail(&mut self, problem: String) {
        self.notice(NoticeLevel::Error, problem.clone());
        self.set_problem(Some(problem));
    }

    fn set_problem(&mut self, problem: Option<String>) {
        self.is_changed = true;
        self.state.problem.clone_from(&problem);
        // The session is well as long as something runs.
        let shown = problem.filter(|_| self.live.is_none());
        *self.problem.lock().unwrap_or_else(PoisonError::into_inner) = shown;
    }

    fn notice(&self, level: NoticeLevel, text: String) {
        self.publisher.notice(Notice { level, text });
    }

    // The hand.

    fn put_hand(&mut self, hand: &Hand) -> anyhow::Result<()> {
        let point = finite(hand.point, "point")?;
        let normal = finite(hand.normal, "normal")?;
        if !hand.depth.is_finite() {
            bail!("the depth is not a number");
        }
        if self.motion.is_some() {
            bail!("the scene's motion is running; stop it to take the hand");
        }
        let Some(live) = &mut self.live else {
            bail!("there is no body yet");
        };
        let place = live.world.skin.nearest(point).context("there is no skin")?;
        let normal = normal.try_normalize(1e-6).unwrap_or(place.normal);
        // A page that says another side than the skin's own is wrong.
        let normal = if normal.dot(&place.normal) > 0.5 {
            normal
        } else {
            place.normal
        };
        let depth = hand.depth.min(live.world.greatest_depth());
        live.hand.set_goal(Some(Goal {
            place: Place { normal, ..place },
            depth,
        }));
        self.heard = Some(Instant::now());
        Ok(())
    }

    fn lift(&mut self) {
        self.heard = None;
        if let Some(live) = &mut self.live {
            live.hand.set_goal(None);
        }
    }

    fn run_motion(&mut self) -> anyhow::Result<()> {
        self.close_replay();
        let Some(live) = &mut self.live else {
            bail!("there is no body yet");
        };
        let place = live.world.home;
        live.hand.set_goal(Some(Goal {
            place,
            depth: -crate::hand::HOVER,
        }));
        self.heard = None;
        self.motion = Some(Motion::Homing(Instant::now()));
        Ok(())
    }

    /// Where the tool is to be, in the scene's frame.
    fn move_hand(&mut self, dt: f64, now: Instant) {
        if self.heard.is_some_and(|heard| now - heard > HAND_SILENCE) {
            self.lift();
        }
        let Some(live) = &mut self.live else { return };
        let frame = live.world.scene_from_device;
        live.running.looks.take();
        let fine = live.running.looks.current().fine;
        let pose = match &mut self.motion {
            None => live.hand.advance(&live.world.skin, fine, dt),
            Some(Motion::Homing(began)) => {
                let pose = live.hand.advance(&live.world.skin, fine, dt);
                let off = (live.hand.place().point - live.world.home.point).norm();
                if off < 1e-4 && live.hand.is_lifted() || now - *began > HOMING {
                    let at = frame.inverse_transform_point(&Point3::from(live.hand.tip()));
                    let path = once_from(at.coords, &live.world.scene, &frame);
                    self.motion = Some(Motion::Moving { path, time: 0.0 });
                    self.is_changed = true;
                }
                pose
            }
            Some(Motion::Moving { path, time }) => {
                *time += dt;
                let at = path.at(*time);
                if *time > path.duration() {
                    self.motion = None;
                    self.is_changed = true;
                    live.hand.set_goal(None);
                }
                frame * Pose::translation(at.x, at.y, at.z)
            }
        };
        live.running.target.set_pose(&(frame.inverse() * pose));
    }

    // What is seen.

    fn advance(&mut self, dt: f64, now: Instant) {
        self.move_hand(dt, now);
        if self.paused_until.is_some_and(|until| now >= until) {
            self.paused_until = None;
            if let Some(live) = &self.live {
                live.running.engine.faults().pause_tissue(false);
            }
        }
        self.look(dt);
        if let Some(recording) = &mut self.recording {
            let was_playing = recording.is_playing;
            recording.advance(dt);
            self.is_changed |= was_playing != recording.is_playing;
            if recording.is_shown {
                self.show_recording();
            }
        }
        let is_full = (self.live.as_ref()).is_some_and(|live| {
            self.is_recording() && live.running.engine.now() > recording::LONGEST
        });
        if is_full {
            let _ = self.stop_recording();
            self.notice(
                NoticeLevel::Warning,
                "the recording ended: an hour is the longest".to_owned(),
            );
        }
    }

    /// Looks at engine and body, and makes a frame of it.
    fn look(&mut self, dt: f64) {
        let Some(live) = &mut self.live else { return };
        let snapshot = live.running.engine.snapshot();
        (live.entry, live.step) = (snapshot.tick, snapshot.step);
        live.figures.note(&live.entry);
        let frame = live.world.scene_from_device;
        let tip = (frame * Point3::from(live.entry.devices[0].position)).coords;
        let is_elsewhere =
            matches!(self.motion, Some(Motion::Moving { .. })) || live.hand.is_travelling();
        let over = if is_elsewhere {
            live.world.skin.nearest(tip).unwrap_or(live.world.home)
        } else {
            *live.hand.place()
        };
        frame::put_tick(
            &mut self.frame,
            &live.entry,
            &frame,
            &(over.point, over.normal),
        );
        self.frame.deepest = live.hand.deepest();
        self.frame.step_status = live.step.status.into();
        if let Some(game) = &mut self.game
            && !game.is_revealed()
        {
            game.feel(over.point, Vec3::from(self.frame.force).norm(), dt);
        }
        let is_recording = self.recording.as_ref().is_some_and(Recording::is_under_way);
        let is_watched = self.publisher.n_clients() > 0;
        if live.entry.tick.tick == 0 || !(is_watched || is_recording) {
            return;
        }
        live.running.looks.take();
        let look = live.running.looks.current();
        if look.mesh == 0 {
            return;
        }
        self.see(is_recording);
    }

    fn see(&mut self, is_recording: bool) {
        let Some(live) = &mut self.live else { return };
        let shows_lumps = self.game.as_ref().is_none_or(Game::is_revealed);
        let look: &Look = live.running.looks.current();
        let mesh_number = look.mesh;
        let mut model = None;
        let settled;
        let displacements: &[Vec3] = match &look.body {
            None => return,
            Some(Seen::Tissue(glance)) => {
                settled = glance.settled();
                model = Some(Arc::clone(glance.model()));
                &settled
            }
            Some(Seen::Springs(displacements)) => displacements,
        };
        if live.mesh != mesh_number {
            let body = match (&model, live.world.spring_body()) {
                (Some(model), _) => model.body(),
                (None, Some(body)) => body,
                (None, None) => return,
            };
            live.mesh = mesh_number;
            self.mesh += 1;
            let stiffness = live.world.stiffness(body, shows_lumps);
            let mesh = frame::mesh(self.mesh, body, stiffness, &live.world.bones);
            live.mesh_bytes = Arc::new(mesh.encode());
            if !self.recording.as_ref().is_some_and(|r| r.is_shown) {
                self.publisher.mesh(self.mesh, live.mesh_bytes.to_vec());
            }
        }
        self.n_frames += 1;
        self.frame.mesh = self.mesh;
        self.frame.sequence = self.n_frames as u32;
        frame::put_displacements(&mut self.frame, displacements);
        let field = model.and_then(|model| {
            self.fields.of(
                u64::from(self.mesh),
                self.state.field,
                &model,
                displacements,
            )
        });
        frame::put_field(&mut self.frame, field);
        if is_recording && let Some(recording) = &mut self.recording {
            recording.add(&self.frame, &live.mesh_bytes);
        }
        if !self.recording.as_ref().is_some_and(|r| r.is_shown) {
            self.publisher.frame(self.mesh, self.frame.encode());
        }
    }

    // Recording and replay.

    fn is_recording(&self) -> bool {
        self.recording.as_ref().is_some_and(Recording::is_under_way)
    }

    fn start_recording(&mut self) -> anyhow::Result<()> {
        if self.is_recording() {
            bail!("a recording is under way already");
        }
        if self.hides_lumps() {
            bail!(
                "a log holds the whole scene, hidden lumps as well: record after the truth is shown"
            );
        }
        self.close_replay();
        self.motion = None;
        if self.live.is_none() {
            bail!("there is no body yet");
        }
        let log = recording::new_log(&self.params.out)?;
        let Some(Live { world, running, .. }) = self.live.take() else {
            bail!("there is no body yet");
        };
        running.engine.stop();
        if let Err(error) = self.start(world, Some(log.clone())) {
            self.build();
            return Err(error);
        }
        self.recording = Some(Recording::begin(log, 0.0));
        Ok(())
    }

    fn stop_recording(&mut self) -> anyhow::Result<()> {
        let Some(recording) = self.recording.as_mut().filter(|r| r.is_under_way()) else {
            bail!("nothing is being recorded");
        };
        recording.end();
        self.is_changed = true;
        // The log is whole once its engine has ended; the body goes on, at rest.
        if let Some(Live { world, running, .. }) = self.live.take() {
            running.engine.stop();
            if let Err(error) = self.start(world, None) {
                self.build();
                return Err(error);
            }
        }
        Ok(())
    }

    fn over(&mut self) -> anyhow::Result<&mut Recording> {
        let over = self.recording.as_mut().filter(|r| !r.is_under_way());
        over.context("there is no recording to be shown; make one first")
    }

    fn open_replay(&mut self) -> anyhow::Result<()> {
        self.lift();
        self.shown_replay_mesh = None;
        let recording = self.over()?;
        if recording.shown().is_none() {
            bail!("the recording is too short: it holds no moment to be shown");
        }
        recording.is_shown = true;
        recording.at = 0.0;
        recording.is_playing = false;
        Ok(())
    }

    fn close_replay(&mut self) {
        let Some(recording) = &mut self.recording else {
            return;
        };
        if std::mem::take(&mut recording.is_shown) {
            recording.is_playing = false;
            // The body's mesh is sent again.
            if let Some(live) = &mut self.live {
                live.mesh = 0;
            }
        }
    }

    fn seek(&mut self, time: f64) -> anyhow::Result<()> {
        if !time.is_finite() {
            bail!("the time is not a number");
        }
        let recording = self.over()?;
        recording.at = time.clamp(0.0, recording.duration());
        Ok(())
    }

    fn play(&mut self, on: bool) -> anyhow::Result<()> {
        let recording = self.over()?;
        if on && recording.at >= recording.duration() {
            recording.at = 0.0;
        }
        recording.is_playing = on;
        Ok(())
    }

    fn show_recording(&mut self) {
        let Some((frame, mesh)) = self.recording.as_ref().and_then(Recording::shown) else {
            return;
        };
        if self.shown_replay_mesh != Some(frame.mesh) {
            self.shown_replay_mesh = Some(frame.mesh);
            self.publisher.mesh(frame.mesh, mesh.to_vec());
        }
        self.publisher.frame(frame.mesh, frame.encode());
    }

    // Find the lump.

    fn hides_lumps(&self) -> bool {
        self.game.as_ref().is_some_and(|game| !game.is_revealed())
    }

    fn game(&mut self) -> anyhow::Result<&mut Game> {
        self.game
            .as_mut()
            .context("no lumps are hidden; begin a round first")
    }

    fn start_game(&mut self, seed: Option<u64>, n_lumps: u32) -> anyhow::Result<()> {
        if self.is_recording() {
            bail!("a recording is under way; stop it first");
        }
        let Some(live) = &self.live else {
            bail!("there is no body yet");
        };
        let before = match &self.game {
            Some(game) => game.before.clone(),
            None => self.wanted.scene.clone(),
        };
        let seed = seed.or(self.params.seed);
        let (game, scene) = Game::hide(&live.world, &before, seed, n_lumps)?;
        if let Some(next) = &mut self.params.seed {
            *next = next.wrapping_add(1);
        }
        self.close_replay();
        self.motion = None;
        self.state.field = Field::None;
        self.game = Some(game);
        self.wanted.scene = scene;
        // What is known of the lumps before is no help either.
        self.describe();
        self.build();
        Ok(())
    }

    fn reveal(&mut self) -> anyhow::Result<()> {
        let Some(live) = &mut self.live else {
            bail!("there is no body yet");
        };
        let game = self
            .game
            .as_mut()
            .context("no lumps are hidden; begin a round first")?;
        if self.is_building {
            bail!("the lumps are still being hidden");
        }
        game.reveal(&live.world);
        // With its lumps, now.
        live.mesh = 0;
        self.describe();
        Ok(())
    }

    fn end_game(&mut self) -> anyhow::Result<()> {
        let game = self.game.take().context("no round is under way")?;
        self.wanted.scene = game.before;
        self.build();
        Ok(())
    }

    fn inject(&mut self, fault: FaultKind) -> anyhow::Result<()> {
        if !self.params.allows_faults {
            bail!("faults on purpose are not allowed here; start with --allow-faults");
        }
        let Some(live) = &self.live else {
            bail!("there is no body yet");
        };
        let faults = live.running.engine.faults();
        match fault {
            FaultKind::TissuePanic => faults.panic_tissue(),
            FaultKind::SpoiltPatch => faults.spoil_patches(1),
            FaultKind::TissuePause => {
                faults.pause_tissue(true);
                self.paused_until = Some(Instant::now() + PAUSE);
            }
        }
        Ok(())
    }

    // What is told.

    fn material(&mut self, file: HostFile) -> Option<Material> {
        match file {
            HostFile::Scene => {
                let scene = match &self.game {
                    Some(game) if self.hides_lumps() => &game.before,
                    _ => &self.wanted.scene,
                };
                Some(Material::Scene(scene.to_toml()))
            }
            // The mesh is finer round lumps.
            HostFile::Body if self.hides_lumps() => None,
            HostFile::Body => self.body_now(),
            HostFile::RecordingLog | HostFile::RecordingCsv => {
                let recording = self.recording.as_ref()?;
                (!recording.is_under_way()).then(|| Material::Log(recording.log().to_owned()))
            }
        }
    }

    /// The body as the tissue left it last; before its first step, at rest.
    fn body_now(&mut self) -> Option<Material> {
        let live = self.live.as_mut()?;
        live.running.looks.take();
        Some(match &live.running.looks.current().body {
            Some(Seen::Tissue(glance)) => {
                Material::Tissue(Arc::clone(glance.model()), glance.settled())
            }
            Some(Seen::Springs(displacements)) => {
                let body = Box::new(live.world.spring_body()?.clone());
                Material::Springs(body, displacements.clone())
            }
            None => {
                let model = live.world.first_model()?;
                let at_rest = vec![Vec3::zeros(); model.n_nodes()];
                Material::Tissue(model, at_rest)
            }
        })
    }

    fn tell_figures(&mut self) {
        self.watch_over();
        // Time goes on in a game and in a recording.
        self.is_changed |= self.hides_lumps();
        let n_frames = self.n_frames;
        let Some(live) = &mut self.live else { return };
        let report = live.running.engine.report();
        let (status, meshes) = (live.step.status, live.step.mesh);
        let n_nodes = match self.frame.displacements.len() / 3 {
            0 => live.world.n_nodes(),
            n => n,
        };
        let (figures, notices) =
            live.figures
                .make(&report, &live.entry, status, meshes, n_nodes, n_frames);
        self.publisher.engine(figures);
        for notice in notices {
            self.publisher.notice(notice);
        }
    }

    /// An engine without its tissue gives no force: it is started anew.
    fn watch_over(&mut self) {
        let ended = match &self.live {
            Some(live) => live.running.engine.ended(),
            None => return,
        };
        let Some(thread) = ended.first() else { return };
        self.notice(
            NoticeLevel::Error,
            format!(
                "{thread} ended by a fault; the force went to zero, and the engine is started anew"
            ),
        );
        if let Some(recording) = self.recording.as_mut().filter(|r| r.is_under_way()) {
            recording.end();
        }
        let Some(Live { world, running, .. }) = self.live.take() else {
            return;
        };
        running.engine.stop();
        self.motion = None;
        if let Err(error) = self.start(world, None) {
            self.fail(one_paragraph(&error));
        }
    }

    fn tell_state(&mut self) {
        self.state.revision += 1;
        self.state.phase = if self.is_building {
            Phase::Building
        } else if self.live.is_some() {
            Phase::Running
        } else {
            Phase::Stopped
        };
        self.state.is_motion_running = self.motion.is_some();
        self.state.recording = match &self.recording {
            Some(recording) => recording.info(),
            None => RecordingInfo::default(),
        };
        self.state.game = self.game.as_ref().map(Game::info);
        self.publisher.state(self.state.clone());
    }
}

/// Nothing that is pressed is larger, m.
const FAR: f64 = 100.0;

fn finite(v: [f64; 3], what: &str) -> anyhow::Result<Vec3> {
    if v.iter().all(|x| x.abs() < FAR) {
        Ok(v.into())
    } else {
        bail!("the {what} is no place or direction near the body")
    }
}
