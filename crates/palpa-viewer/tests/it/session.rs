//! A little session: a block of one layer under a punch, which is a spring. It has a state, meshes,
//! frames and files as the real one has, so that what the server does with them can be seen.

use palpa_scene::{ContactShape, LengthUnit};
use palpa_viewer::{
    Answer, Clients, Host, HostFile, Publisher, Server, ServerParams,
    control::{
        Field, Hand, LayerInfo, Method, Phase, Problem, RecordingCurve, RecordingInfo, Request,
        State, ToolInfo, Uploaded, UploadedContent,
    },
    wire::{FrameSnapshot, MeshSnapshot},
};
use serde_json::{Value, json};
use std::{
    fmt::Write,
    net::Ipv4Addr,
    sync::{Arc, Mutex, OnceLock, mpsc},
    thread,
    time::Duration,
};
use tokio::sync::watch;

pub(crate) const TOKEN: &str = "sesame, open & shut";
/// Stiffness of the punch on the block per Young's modulus, m.
const STIFFNESS: f64 = 0.02;

pub(crate) struct Session {
    inner: Mutex<Inner>,
    publisher: OnceLock<Publisher>,
    /// All that the session was told of its clients, in order.
    pub(crate) told: watch::Sender<Vec<Clients>>,
    slow: mpsc::Sender<Answer>,
}

struct Inner {
    young: f64,
    hand: Option<Hand>,
    recording: RecordingInfo,
    rows: String,
    problem: Option<String>,
    sequence: u32,
}

impl Session {
    /// A session and its server, with what a session publishes at its start.
    pub(crate) fn start(token: Option<&str>) -> (Arc<Self>, Server) {
        let (slow, asked) = mpsc::channel::<Answer>();
        // Some answers come from another thread.
        thread::spawn(move || asked.into_iter().for_each(|answer| answer(Ok(()))));
        let session = Arc::new(Self {
            inner: Mutex::new(Inner {
                young: 12e3,
                hand: None,
                recording: RecordingInfo::default(),
                rows: String::new(),
                problem: None,
                sequence: 0,
            }),
            publisher: OnceLock::new(),
            told: watch::Sender::default(),
            slow,
        });
        let server = Server::start(&params(token), session.clone()).unwrap();
        session.publisher.set(server.publisher()).unwrap();
        session.publish();
        (session, server)
    }

    pub(crate) fn fail(&self, why: &str) {
        self.inner.lock().unwrap().problem = Some(why.into());
    }

    /// Waits until the session was told of this number of clients last.
    pub(crate) async fn until_clients(&self, n: usize) {
        let mut told = self.told.subscribe();
        let is_so = told.wait_for(|told| told.last().is_some_and(|clients| clients.n == n));
        // Only turns a hang into a failure.
        let is_so = tokio::time::timeout(Duration::from_mins(1), is_so).await;
        is_so.expect("the number of clients in time").unwrap();
    }

    fn publish(&self) {
        if let Some(publisher) = self.publisher.get() {
            publisher.state(self.inner.lock().unwrap().state());
        }
    }

    /// The mesh of a number: a prism.
    pub(crate) fn show_mesh(&self, mesh: u32) {
        let snapshot = mesh_of(mesh).encode();
        self.publisher.get().unwrap().mesh(mesh, snapshot);
    }

    /// The next frame, and its number.
    pub(crate) fn show_frame(&self, mesh: u32, n_nodes: usize) -> u32 {
        let mut inner = self.inner.lock().unwrap();
        inner.sequence += 1;
        let frame = FrameSnapshot {
            mesh,
            sequence: inner.sequence,
            force: [0.0, 0.0, inner.force()],
            displacement_unit: 1e-6,
            displacements: vec![7; 3 * n_nodes],
            ..FrameSnapshot::default()
        };
        self.publisher.get().unwrap().frame(mesh, frame.encode());
        inner.sequence
    }
}

pub(crate) fn params(token: Option<&str>) -> ServerParams {
    ServerParams {
        bind: Ipv4Addr::LOCALHOST.into(),
        port: 0,
        token: token.map(str::to_owned),
    }
}

pub(crate) fn mesh_of(mesh: u32) -> MeshSnapshot {
    MeshSnapshot {
        mesh,
        n_levels: 2,
        positions: (0..18u8).map(f32::from).collect(),
        triangles: vec![0, 1, 2],
        interval_layer: vec![0],
        stiffness: vec![12e3],
        ..MeshSnapshot::default()
    }
}

impl Inner {
    fn force(&self) -> f64 {
        let depth = self.hand.map_or(0.0, |hand| hand.depth.max(0.0));
        STIFFNESS * self.young * depth
    }

    fn scene(&self) -> Value {
        json!({ "layer": [{ "tissue": { "young": format!("{} kPa", self.young / 1e3) } }] })
    }

    fn edit(&mut self, path: &str, value: &Value) -> Result<(), String> {
        if path != "/layer/0/tissue/young" {
            return Err(format!("{path}: there is no such key"));
        }
        let young = value
            .as_str()
            .and_then(|v| v.strip_suffix(" kPa"))
            .and_then(|v| v.parse::<f64>().ok())
            .filter(|v| (0.1..=1e4).contains(v))
            .ok_or_else(|| format!("{path}: {value}; expected 0.1 kPa to 10000 kPa"))?;
        self.young = 1e3 * young;
        Ok(())
    }

    fn ask(&mut self, request: &Request) -> Result<(), String> {
        match request {
            Request::Hand(hand) => {
                self.hand = Some(*hand);
                if self.recording.is_recording {
                    let force = self.force();
                    writeln!(self.rows, "{force}").unwrap();
                }
            }
            Request::Lift => self.hand = None,
            Request::Edit { edits } => {
                for edit in edits {
                    self.edit(&edit.path, &edit.value)?;
                }
            }
            Request::LoadText { text, .. } if text.len() < 10 => return Err("no scene".into()),
            Request::StartRecording => {
                self.rows = "force\n".into();
                self.recording.is_recording = true;
            }
            Request::StopRecording => {
                self.recording.is_recording = false;
                self.recording.duration = 1e-3 * self.rows.lines().skip(1).count() as f64;
            }
            Request::Restart => self.problem = None,
            _ => {}
        }
        Ok(())
    }

    fn state(&self) -> State {
        State {
            revision: 0,
            controller: None,
            n_clients: 0,
            gallery: vec![],
            gallery_key: None,
            scene: self.scene(),
            origin: 1,
            is_changed: false,
            files: vec![],
            n_undo: 0,
            n_redo: 0,
            layers: vec![LayerInfo {
                name: "fat".into(),
                law: "neo-Hooke".into(),
                stiffness: self.young,
                thickness: 0.02,
            }],
            lumps: vec![],
            tool: ToolInfo {
                shape: Some(ContactShape::Sphere { radius: 0.005 }),
                friction: 0.3,
            },
            home: hand(-0.002),
            usual_depth: 0.004,
            greatest_depth: 0.01,
            max_force: 8.0,
            method: Method::Tissue,
            phase: Phase::Running,
            problem: (self.problem.clone()).map(|text| Problem::Refused { text }),
            notes: vec![],
            is_motion_running: false,
            field: Field::None,
            recording: self.recording.clone(),
            game: None,
            levels: vec![],
            n_game_results: 0,
            n_nodes: 6,
            allows_faults: false,
        }
    }
}

pub(crate) fn hand(depth: f64) -> Hand {
    Hand {
        point: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        depth,
        force: None,
    }
}

impl Host for Session {
    fn request(&self, request: Request, answer: Answer) {
        match request {
            // Never answered.
            Request::Unmark => drop(answer),
            // Answered elsewhere.
            Request::Seek { .. } => self.slow.send(answer).unwrap(),
            request => {
                let outcome = self.inner.lock().unwrap().ask(&request);
                let is_new = outcome.is_ok() && !matches!(request, Request::Hand(_));
                answer(outcome);
                if is_new {
                    self.publish();
                }
            }
        }
    }

    fn clients(&self, clients: Clients) {
        self.told.send_modify(|told| told.push(clients));
        if clients.controller.is_none() {
            self.inner.lock().unwrap().hand = None;
        }
    }

    fn file(&self, file: HostFile) -> Result<Option<Vec<u8>>, String> {
        let inner = self.inner.lock().unwrap();
        match file {
            HostFile::Scene => Ok(Some(inner.scene().to_string().into_bytes())),
            HostFile::SceneArchive => Ok(Some(b"PK".to_vec())),
            HostFile::Body => Err("the disk is full".into()),
            HostFile::Map
            | HostFile::MapCsv
            | HostFile::GameCsv
            | HostFile::RecordingLog
            | HostFile::Spectrum => Ok(None),
            HostFile::RecordingCurve => {
                let there = inner.recording.duration > 0.0;
                let curve = RecordingCurve {
                    time: vec![0.0, 0.5],
                    ..RecordingCurve::default()
                };
                Ok(there.then(|| json!(curve).to_string().into_bytes()))
            }
            HostFile::RecordingCsv => {
                let there = inner.recording.duration > 0.0;
                Ok(there.then(|| inner.rows.clone().into_bytes()))
            }
        }
    }

    fn upload(&self, name: &str, bytes: Vec<u8>) -> Result<Uploaded, String> {
        if bytes.is_empty() {
            return Err(format!("{name} is empty"));
        }
        Ok(Uploaded {
            id: 7,
            name: format!("{name}, {} bytes", bytes.len()),
            content: UploadedContent::Other,
        })
    }

    fn check_uploaded(&self, id: u32, unit: LengthUnit) -> Option<Uploaded> {
        (id == 7).then(|| Uploaded {
            id,
            name: format!("{unit:?}"),
            content: UploadedContent::Other,
        })
    }

    fn uploaded_mesh(&self, id: u32) -> Option<Vec<u8>> {
        (id == 7).then(|| mesh_of(7).encode())
    }

    fn problem(&self) -> Option<String> {
        self.inner.lock().unwrap().problem.clone()
    }
}
