//! `palpa view` as a process, asked over HTTP as a program would. The page in a browser is tested
//! in `web/e2e`.

mod own;

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::process::{Child, Stdio};
use std::time::Duration;

use palpa_testkit::{Bench, Layer, Scene, wait_for};
use serde_json::{Value, json};
use vtkio::Vtk;
use vtkio::model::{Attribute, DataSet, Piece};

use crate::palpa;

/// Time after which a request without an answer counts as a hang.
const HANG: Duration = Duration::from_mins(3);

fn gel() -> Scene {
    Scene::block([60.0, 60.0, 20.0], 10.0)
        .layer(Layer::elastic("gel", "10 kPa").levels(2))
        .sphere(10.0)
        .press(3.0)
        .near_tool(5.0)
        .growth(1.0)
        .set("motion", "depth", "4 mm")
}

struct Viewer {
    process: Child,
    url: String,
    /// Keeps its connection: the server takes a limited number of them.
    agent: ureq::Agent,
    bench: Bench,
}

impl Viewer {
    fn start(more: &[&str]) -> Self {
        let bench = palpa();
        bench.file("gel.toml", gel());
        // Of its own, so that a test sees what is left in it.
        let tmp = bench.path("tmp");
        fs::create_dir(&tmp).unwrap();
        let args = ["view", "--no-open", "--port", "0", "--json", "gel.toml"];
        let mut process = bench
            .command(&[&args, more].concat())
            .env("TMPDIR", tmp)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(process.stdout.take().unwrap()).lines();
        let mut text = String::new();
        let started: Value = loop {
            text += &lines.next().unwrap().unwrap();
            if let Ok(value) = serde_json::from_str(&text) {
                break value;
            }
        };
        let url = started["url"].as_str().unwrap().to_owned();
        let viewer = Self {
            process,
            url,
            agent: agent(),
            bench,
        };
        viewer.wait_until(|state| state["phase"] == "running");
        viewer
    }

    fn get(&self, path: &str) -> (u16, Vec<u8>) {
        let mut answer = self
            .agent
            .get(format!("{}{path}", self.url))
            .call()
            .unwrap();
        let mut body = Vec::new();
        answer
            .body_mut()
            .as_reader()
            .read_to_end(&mut body)
            .unwrap();
        (answer.status().as_u16(), body)
    }

    /// Null before there is anything to tell.
    fn json(&self, path: &str) -> Value {
        serde_json::from_slice(&self.get(path).1).unwrap_or(Value::Null)
    }

    /// Status and words of a refusal.
    fn post(&self, text: &str) -> (u16, String) {
        let mut answer = self
            .agent
            .post(format!("{}api/control", self.url))
            .header("Content-Type", "application/json")
            .send(text)
            .unwrap();
        let body = answer.body_mut().read_to_string().unwrap();
        let words = serde_json::from_str::<Value>(&body).map_or(body, |reply| {
            reply["error"].as_str().unwrap_or_default().to_owned()
        });
        (answer.status().as_u16(), words)
    }

    fn ask(&self, request: &Value) {
        assert_eq!(
            self.post(&request.to_string()),
            (200, String::new()),
            "{request}"
        );
    }

    fn wait_until(&self, is_so: impl Fn(&Value) -> bool) -> Value {
        let mut last = Value::Null;
        wait_for("a state of the session", || {
            let state = self.json("api/state");
            let told = [&state["phase"], &state["problem"]].map(Clone::clone);
            if last != json!(told) {
                last = json!(told);
                println!("{last}");
            }
            is_so(&state).then_some(state)
        })
    }

    /// Asks for the hand at the home of the scene. It is to be repeated: a hand that hears nothing
    /// for a second lifts.
    fn hold(&self, home: &Value, depth: f64) {
        let hand = json!({ "type": "hand", "point": home["point"], "normal": home["normal"], "depth": depth });
        self.ask(&hand);
    }

    /// The largest displacement of the body as it is pressed now, m.
    fn displacement(&self) -> f64 {
        let (status, bytes) = self.get("api/body.vtu");
        assert_eq!(status, 200, "{}", String::from_utf8_lossy(&bytes));
        let vtk = Vtk::parse_xml(&bytes[..]).unwrap();
        let DataSet::UnstructuredGrid { pieces, .. } = vtk.data else {
            panic!("no unstructured grid");
        };
        let Some(Piece::Inline(piece)) = pieces.into_iter().next() else {
            panic!("no piece");
        };
        let found = piece.data.point.iter().find_map(|a| match a {
            Attribute::DataArray(array) if array.name == "displacement" => Some(array),
            _ => None,
        });
        let displacements: Vec<f64> = found.unwrap().data.cast_into().unwrap();
        let size = |u: &[f64]| u.iter().map(|x| x * x).sum::<f64>().sqrt();
        displacements.chunks(3).map(size).fold(0.0, f64::max)
    }

    /// Presses until the body has come to rest, pressed in by most of a depth that a hand on a
    /// spring reaches. Returns the largest displacement, m.
    fn press(&self, depth: f64) -> f64 {
        let home = self.json("api/state")["home"].clone();
        let mut before = [0.0; 3];
        wait_for("the press is at rest", || {
            self.hold(&home, depth);
            let now = self.displacement();
            let is_still = before.iter().all(|u| (u - now).abs() < 0.02 * now);
            before = [before[1], before[2], now];
            (is_still && now > 0.2 * depth).then_some(now)
        })
    }

    /// Lifts the hand, until the body is back at rest but for a hundredth of its displacement
    /// before, and the tool has left it for some time.
    fn lift(&self, pressed: f64) {
        self.ask(&json!({ "type": "lift" }));
        wait_for("the body is let go", || {
            (self.displacement() < 0.01 * pressed).then_some(())
        });
        self.pass(0.8, || ());
    }

    /// Does something again and again while so many seconds pass on the engine's clock.
    fn pass(&self, seconds: f64, again: impl Fn()) {
        let now = || self.json("api/engine")["seconds"].as_f64().unwrap_or(0.0);
        let until = now() + seconds;
        wait_for("the engine's clock", || {
            again();
            (now() >= until).then_some(())
        });
    }

    /// Records a press and its release: the table of its ticks.
    fn record(&self, depth: f64) -> Vec<[f64; 4]> {
        self.ask(&json!({ "type": "start_recording" }));
        let pressed = self.press(depth);
        self.lift(pressed);
        self.ask(&json!({ "type": "stop_recording" }));
        let (status, table) = self.get("api/recording.csv");
        assert_eq!(status, 200);
        rows(&table)
    }

    /// Replays the recording bit for bit with `palpa replay`.
    fn run_again(&self) {
        let log = self.bench.path("recording.mcap");
        fs::write(&log, self.get("api/recording.mcap").1).unwrap();
        let found = self.bench.report(&["replay", "recording.mcap", "--json"]);
        assert_eq!(found["verdict"], "same");
    }

    #[cfg(unix)]
    fn stop(mut self) -> std::process::ExitStatus {
        palpa_testkit::interrupt(&self.process);
        self.process.wait().unwrap()
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn agent() -> ureq::Agent {
    ureq::Agent::config_builder()
        .http_status_as_error(false)
        .timeout_global(Some(HANG))
        .build()
        .into()
}

/// Time (s) and force (N) of every tick.
fn rows(table: &[u8]) -> Vec<[f64; 4]> {
    let text = std::str::from_utf8(table).unwrap();
    let mut lines = text.lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| columns.iter().position(|c| *c == name).unwrap();
    let wanted = ["now", "force_x", "force_y", "force_z"].map(column);
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            wanted.map(|c| cells[c].parse().unwrap())
        })
        .collect()
}

fn largest(rows: &[[f64; 4]]) -> f64 {
    let size = |row: &[f64; 4]| (row[1] * row[1] + row[2] * row[2] + row[3] * row[3]).sqrt();
    rows.iter().map(size).fold(0.0, f64::max)
}

#[test]
fn a_press_is_felt_is_released_and_its_recording_runs_again_to_the_bit() {
    let viewer = Viewer::start(&[]);
    let rows = viewer.record(4e-3);
    let most = largest(&rows);
    assert!((0.05..8.0).contains(&most), "{most} N");
    assert!(largest(&rows[rows.len() - 20..]) < 1e-6, "let go");
    viewer.run_again();
    viewer.ask(&json!({ "type": "open_replay" }));
    let state = viewer.wait_until(|state| state["recording"]["is_replaying"] == true);
    let duration = state["recording"]["duration"].as_f64().unwrap();
    let ticked = rows[rows.len() - 1][0] - rows[0][0];
    // Frames and rows begin and end together but for the frames that a busy machine leaves out.
    assert!(
        (duration - ticked).abs() < 0.25 * ticked,
        "{duration} of {ticked} s"
    );
    viewer.ask(&json!({ "type": "seek", "time": 0.5 * duration }));
    #[cfg(unix)]
    assert_eq!(viewer.stop().code(), Some(0));
}

#[test]
fn a_stiffer_tissue_is_felt_stiffer_and_a_lump_is_there() {
    let viewer = Viewer::start(&[]);
    let soft = largest(&viewer.record(4e-3));
    viewer.ask(&json!({ "type": "edit", "edits": [{ "path": "/layer/0/tissue/young", "value": "40 kPa" }] }));
    viewer.wait_until(|state| state["layers"][0]["stiffness"] == 40e3);
    viewer.wait_until(|state| state["phase"] == "running");
    let stiff = largest(&viewer.record(4e-3));
    // A hand on a spring does not press four times as hard.
    assert!(stiff > 1.5 * soft, "{soft} N, then {stiff} N");
    let lump = json!({ "name": "pea", "shape": "sphere", "radius": "4 mm", "below": ["0 mm", "0 mm", "0 mm"],
        "depth": "8 mm", "tissue": { "name": "hard", "young": "300 kPa", "poisson": 0.45 } });
    viewer.ask(&json!({ "type": "edit", "edits": [{ "path": "/lump/-", "value": lump }] }));
    let state = viewer.wait_until(|state| state["lumps"][0]["name"] == "pea");
    assert!((state["lumps"][0]["centre"][2].as_f64().unwrap() + 8e-3).abs() < 1e-6);
    let scene = String::from_utf8(viewer.get("api/scene.toml").1).unwrap();
    assert!(scene.contains("pea") && scene.contains("40 kPa"), "{scene}");
}

#[test]
fn the_patch_of_2009_is_felt_with_both_methods() {
    let viewer = Viewer::start(&[]);
    for (key, method) in [("patch_bars", "reference"), ("patch_tissue", "tissue")] {
        viewer.ask(&json!({ "type": "load_scene", "key": key }));
        let state = viewer.wait_until(|s| s["gallery_key"] == key && s["phase"] == "running");
        assert_eq!(
            (&state["method"], &state["n_nodes"]),
            (&json!(method), &json!(36))
        );
        let rows = viewer.record(15e-3);
        assert!(
            (0.05..8.0).contains(&largest(&rows)),
            "{key}: {} N",
            largest(&rows)
        );
        assert!(largest(&rows[rows.len() - 20..]) < 1e-6, "{key}: let go");
        viewer.run_again();
    }
}

#[test]
fn hidden_lumps_stay_hidden_until_the_truth_is_asked_for() {
    let viewer = Viewer::start(&["--seed", "7"]);
    viewer.ask(&json!({ "type": "load_scene", "key": "block" }));
    viewer.wait_until(|s| s["gallery_key"] == "block" && s["phase"] == "running");
    viewer.ask(&json!({ "type": "start_game", "n_lumps": 2 }));
    let state = viewer.wait_until(|s| s["game"]["n_lumps"] == 2 && s["phase"] == "running");
    assert_eq!(state["game"]["seed"], 7);
    assert_eq!(state["lumps"], json!([]));
    assert!(state["scene"].get("lump").is_none());
    assert!(
        !viewer
            .get("api/scene.toml")
            .1
            .windows(6)
            .any(|w| w == b"hidden")
    );
    let (code, words) = viewer.post(r#"{"type":"start_recording"}"#);
    assert!(code == 409 && words.contains("hidden lumps"), "{words}");
    // The body is not shown while lumps are hidden: the hand presses for some time of the engine's
    // clock.
    viewer.pass(3.0, || viewer.hold(&state["home"], 4e-3));
    viewer.ask(&json!({ "type": "mark", "point": [0.01, 0.0, 0.0] }));
    viewer.ask(&json!({ "type": "reveal" }));
    let state = viewer.wait_until(|state| state["game"]["result"].is_object());
    let result = &state["game"]["result"];
    assert_eq!(result["lumps"].as_array().unwrap().len(), 2);
    let errors = result["lumps"].as_array().unwrap().iter();
    assert_eq!(errors.filter(|lump| lump["error"].is_number()).count(), 1);
    assert!(result["max_force"].as_f64().unwrap() > 0.05, "{result:#}");
    assert!(result["covered"].as_f64().unwrap() > 0.0);
    viewer.ask(&json!({ "type": "end_game" }));
    viewer
        .wait_until(|s| s["game"].is_null() && s["lumps"] == json!([]) && s["phase"] == "running");
}

#[test]
fn what_is_wrong_is_said_and_the_body_goes_on() {
    let viewer = Viewer::start(&[]);
    for (request, words) in [
        (
            json!({ "type": "edit", "edits": [{ "path": "/layer/0/tissue/young", "value": "12 apples" }] }),
            "apples",
        ),
        (json!({ "type": "load_text", "text": "[body" }), ":1:6"),
        (
            json!({ "type": "load_scene", "key": "nonsense" }),
            "forearm",
        ),
        (json!({ "type": "open_replay" }), "no recording"),
        (
            json!({ "type": "mark", "point": [0, 0, 0] }),
            "no lumps are hidden",
        ),
        (json!({ "type": "start_game", "n_lumps": 99 }), "1 to 3"),
        (
            json!({ "type": "inject", "fault": "tissue_panic" }),
            "not allowed",
        ),
    ] {
        let (code, found) = viewer.post(&request.to_string());
        assert!(
            code == 409 && found.contains(words),
            "{request}: {code} {found}"
        );
    }
    // A scene that can be read but not built: the body before stays.
    let too_deep =
        json!({ "type": "edit", "edits": [{ "path": "/motion/depth", "value": "30 mm" }] });
    viewer.ask(&too_deep);
    let state = viewer.wait_until(|state| state["problem"]["kind"] == "refused");
    let text = &state["problem"]["text"];
    assert!(
        text.as_str().unwrap().contains("depth"),
        "{}",
        state["problem"]
    );
    assert_eq!(
        viewer.wait_until(|s| s["phase"] == "running")["scene"]["motion"]["depth"],
        "4 mm"
    );
    let (status, words) = viewer.get("healthz");
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&words));
    viewer.press(3e-3);
}

#[test]
fn a_fault_of_the_tissue_is_told_and_the_engine_starts_anew() {
    let viewer = Viewer::start(&["--allow-faults"]);
    // So old that the figures of an engine that has just begun are younger.
    let before = wait_for("the engine is 3 s old", || {
        let seconds = viewer.json("api/engine")["seconds"].as_f64();
        seconds.filter(|s| *s >= 3.0)
    });
    viewer.ask(&json!({ "type": "inject", "fault": "tissue_panic" }));
    wait_for("the engine starts anew", || {
        let now = viewer.json("api/engine");
        let is_new = now["seconds"].as_f64() < Some(before);
        (is_new && now["tissue_rate"].as_f64() > Some(0.0)).then_some(())
    });
    assert!(largest(&viewer.record(4e-3)) > 0.05);
}

/// Whatever is asked, an answer comes and the body stays.
#[test]
fn nonsense_neither_stops_nor_fills_it() {
    let viewer = Viewer::start(&[]);
    let mut random = fastrand::Rng::with_seed(11);
    let numbers = [0.0, -1.0, 1e308, -1e308, 1e-308, 0.02, 4e-3, 1e9];
    for _ in 0..300 {
        let mut number = || numbers[random.usize(..numbers.len())];
        let vector = json!([number(), number(), number()]);
        let (a, b) = (number(), vector.clone());
        let path = [
            "/layer/0/levels",
            "/lump/-",
            "/mesh/near_tool",
            "/tool/radius",
            "/x",
            "",
            "/layer/5",
            "/press/at/1",
        ];
        let path = path[random.usize(..path.len())];
        let words = [
            "lift",
            "stop_motion",
            "reveal",
            "unmark",
            "close_replay",
            "end_game",
        ];
        let word = words[random.usize(..words.len())];
        let request = match random.u8(..9) {
            0..=2 => json!({ "type": "hand", "point": vector, "normal": b, "depth": a }),
            3 => json!({ "type": "seek", "time": a }),
            4 => json!({ "type": "mark", "point": vector }),
            5 => json!({ "type": "edit", "edits": [{ "path": path, "value": vector }] }),
            6 => json!({ "type": "edit", "edits": [{ "path": path, "value": null }] }),
            7 => json!({ "type": "show_field", "field": "pressure" }),
            _ => {
                json!({ "type": word })
            }
        };
        let (code, _) = viewer.post(&request.to_string());
        assert!(code == 200 || code == 409, "{request}: {code}");
    }
    for text in [
        "",
        "{",
        "[]",
        "{\"type\":\"hand\"}",
        "{\"type\":1}",
        "\u{0}",
        &"[".repeat(100_000),
    ] {
        assert_eq!(viewer.post(text).0, 400, "{text:.20}");
    }
    let (status, words) = viewer.get("healthz");
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&words));
    viewer.wait_until(|state| state["phase"] == "running");
    viewer.press(3e-3);
}

#[test]
fn where_it_may_not_listen_it_says_so() {
    let says = |args: &[&str]| {
        let args = [&["view", "--no-open", "--out", "out"], args].concat();
        let (code, _, stderr) = palpa().run(&args);
        (code, stderr)
    };
    let (code, words) = says(&["--bind", "0.0.0.0"]);
    assert!(code == 2 && words.contains("--token"), "{words}");
    let (code, words) = says(&["--token", "abc"]);
    assert!(code == 2 && words.contains("token"), "{words}");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let (code, words) = says(&["--port", &port]);
    assert!(code == 2 && words.contains(&port), "{words}");
    let (code, words) = says(&["no_such_scene.toml"]);
    assert!(code == 2 && words.contains("no_such_scene.toml"), "{words}");
}
