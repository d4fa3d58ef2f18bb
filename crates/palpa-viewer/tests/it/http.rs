//! What can be had over HTTP.

use crate::{page::Page, session::Session};
use palpa_viewer::{
    Server,
    control::{EngineFigures, Reply, Request, State},
};
use serde_json::Value;
use std::collections::BTreeMap;
use ureq::{Agent, http::Response};

/// An answer, read.
pub(crate) struct Got {
    pub(crate) status: u16,
    pub(crate) headers: BTreeMap<String, String>,
    pub(crate) text: String,
}

pub(crate) fn agent() -> Agent {
    Agent::config_builder()
        .http_status_as_error(false)
        .build()
        .new_agent()
}

fn read(mut response: Response<ureq::Body>) -> Got {
    Got {
        status: response.status().as_u16(),
        headers: response
            .headers()
            .iter()
            .map(|(k, v)| (k.to_string(), v.to_str().unwrap().to_owned()))
            .collect(),
        text: response.body_mut().read_to_string().unwrap(),
    }
}

pub(crate) fn get(server: &Server, path: &str) -> Got {
    get_with(server, path, &[])
}

pub(crate) fn get_with(server: &Server, path: &str, headers: &[(&str, &str)]) -> Got {
    let mut request = agent().get(format!("http://{}{path}", server.address()));
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    read(request.call().unwrap())
}

pub(crate) fn post(server: &Server, body: &[u8]) -> Got {
    let url = format!("http://{}/api/control", server.address());
    let request = agent().post(url).header("Content-Type", "application/json");
    read(request.send(body).unwrap())
}

fn ask(server: &Server, body: &str) -> (u16, Reply) {
    let got = post(server, body.as_bytes());
    (got.status, serde_json::from_str(&got.text).unwrap())
}

#[test]
fn the_page_or_how_to_have_it() {
    let (_session, server) = Session::start(None);
    let got = get(&server, "/");
    assert_eq!(got.status, 200);
    assert!(got.headers["content-type"].starts_with("text/html"));
    assert_eq!(got.headers["cache-control"], "no-cache");
    assert!(got.text.contains("make run") || got.text.contains("<script"));
    let policy = &got.headers["content-security-policy"];
    assert!(policy.contains("default-src 'self'") && !policy.contains("unsafe-eval"));
    assert_eq!(got.headers["x-content-type-options"], "nosniff");
    assert_eq!(got.headers["referrer-policy"], "no-referrer");
    for path in ["/nowhere", "/.gitignore", "/../Cargo.toml", "/%2e%2e/a"] {
        assert_eq!(get(&server, path).status, 404, "{path}");
    }
}

/// The files of the page that are in the binary: their kinds, how long they are kept, and that they
/// are not sent twice.
#[test]
fn files_of_the_page() {
    let (_session, server) = Session::start(None);
    let page = get(&server, "/").text;
    for path in page.split('"').filter(|p| p.starts_with("/assets/")) {
        let got = get(&server, path);
        assert_eq!(got.status, 200, "{path}");
        let kind = &got.headers["content-type"];
        assert!(
            kind.contains("javascript") || kind.contains("css"),
            "{kind}"
        );
        assert!(got.headers["cache-control"].contains("immutable"));
        let again = get_with(&server, path, &[("If-None-Match", &got.headers["etag"])]);
        assert_eq!((again.status, again.text.len()), (304, 0));
    }
}

#[test]
fn a_program_asks_while_no_page_controls() {
    let (_session, server) = Session::start(None);
    let (status, reply) = ask(&server, r#"{"id": 7, "type": "lift"}"#);
    assert_eq!((status, reply.id, reply.error), (200, Some(7), None));
    let edit =
        r#"{"type": "edit", "edits": [{"path": "/layer/0/tissue/young", "value": "5 kPa"}]}"#;
    assert_eq!(ask(&server, edit).0, 200);
    let state: State = serde_json::from_str(&get(&server, "/api/state").text).unwrap();
    assert_eq!(state.layers[0].stiffness, 5e3);
    let (status, reply) = ask(&server, r#"{"type": "load_text", "text": "x"}"#);
    assert_eq!((status, reply.error.unwrap().as_str()), (409, "no scene"));
    let (status, reply) = ask(&server, r#"{"type": "unmark"}"#);
    assert_eq!(status, 409);
    assert!(reply.error.unwrap().contains("no answer"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_program_and_a_page_take_control_from_each_other() {
    let (_session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    let (status, reply) = ask(&server, r#"{"id": 1, "type": "lift"}"#);
    assert_eq!((status, reply.id), (409, Some(1)));
    assert!(reply.error.unwrap().contains("take control"));

    assert_eq!(ask(&server, r#"{"type": "take_control"}"#).0, 200);
    page.state_where(|s| s.controller.is_none()).await;
    assert_eq!(ask(&server, r#"{"type": "lift"}"#).0, 200);
    let why = page.ask(Request::Lift).await.unwrap();
    assert!(why.contains("a program controls"), "{why}");
    // Another page does not take it by coming.
    let other = Page::open(&server).await;
    assert_eq!(ask(&server, r#"{"type": "lift"}"#).0, 200);
    drop(other);

    assert_eq!(page.ask(Request::TakeControl).await, None);
    assert_eq!(ask(&server, r#"{"type": "lift"}"#).0, 409);
}

#[test]
fn what_a_program_cannot_ask() {
    let (_session, server) = Session::start(None);
    let (status, reply) = ask(&server, "{\"type\":\n \"fly\"}");
    assert_eq!(status, 400);
    let why = reply.error.unwrap();
    assert!(why.contains("fly") && why.contains("take_control"), "{why}");
    assert_eq!(ask(&server, "").0, 400);
    assert_eq!(post(&server, b"\xff\xfe").status, 400);
    assert_eq!(post(&server, &vec![b' '; (1 << 20) + 1]).status, 413);
    let url = format!("http://{}/api/control", server.address());
    let form = agent().post(&url).send(r#"{"type": "lift"}"#).unwrap();
    assert_eq!(form.status(), 415);
    assert_eq!(agent().get(&url).call().unwrap().status(), 405);
    assert_eq!(get(&server, "/ws").status, 426);
}

#[test]
fn programs_ask_too_often() {
    let (_session, server) = Session::start(None);
    // Each costs 129 of 400, and 200 come back in a second.
    let text = format!(
        r#"{{"type": "load_text", "text": "{}"}}"#,
        "x".repeat(1 << 19)
    );
    let statuses: Vec<u16> = (0..12)
        .map(|_| post(&server, text.as_bytes()).status)
        .collect();
    assert_eq!(statuses[..3], [200; 3]);
    assert!(statuses.contains(&429), "{statuses:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn files_have_their_names() {
    let (_session, server) = Session::start(None);
    let scene = get(&server, "/api/scene.toml");
    assert_eq!(scene.status, 200);
    assert!(scene.text.contains("12 kPa"));
    assert_eq!(
        scene.headers["content-disposition"],
        "attachment; filename=\"scene.toml\""
    );
    assert_eq!(scene.headers["cache-control"], "no-store");
    let body = get(&server, "/api/body.vtu");
    assert_eq!(body.status, 500);
    assert!(body.text.contains("the disk is full"));
    assert_eq!(get(&server, "/api/recording.mcap").status, 404);
    assert_eq!(get(&server, "/api/recording.csv").status, 404);
    assert_eq!(get(&server, "/api/recording/curve").status, 404);

    let mut page = Page::open(&server).await;
    page.ask(Request::StartRecording).await;
    page.ask(Request::Hand(crate::session::hand(0.005))).await;
    page.ask(Request::StopRecording).await;
    let csv = get(&server, "/api/recording.csv");
    assert_eq!(csv.headers["content-type"], "text/csv; charset=utf-8");
    assert!(csv.headers["content-disposition"].contains("palpa-recording.csv"));
    let curve = get(&server, "/api/recording/curve");
    assert_eq!(curve.headers["content-type"], "application/json");
    assert!(!curve.headers.contains_key("content-disposition"));
    let curve: Value = serde_json::from_str(&curve.text).unwrap();
    assert_eq!(curve["time"], serde_json::json!([0.0, 0.5]));
    assert_eq!(get(&server, "/api/spectrum").status, 404);
    let force: f64 = csv.text.lines().nth(1).unwrap().parse().unwrap();
    assert!((force - 1.2).abs() < 1e-12);
}

#[test]
fn figures() {
    let (_session, server) = Session::start(None);
    assert_eq!(get(&server, "/api/engine").status, 503);
    let figures = EngineFigures {
        tissue_rate: 87.5,
        tick_cpu: [4e-6, 9e-6, f64::INFINITY],
        n_nodes: 6,
        ..EngineFigures::default()
    };
    server.publisher().engine(figures);
    let engine: Value = serde_json::from_str(&get(&server, "/api/engine").text).unwrap();
    assert_eq!(engine["tissue_rate"], 87.5);

    let got = get(&server, "/metrics");
    assert!(got.headers["content-type"].starts_with("text/plain; version=0.0.4"));
    let samples = parse_metrics(&got.text);
    assert_eq!(samples["palpa_tissue_steps_per_second"], 87.5);
    assert_eq!(
        samples["palpa_servo_tick_cpu_seconds{quantile=\"0.5\"}"],
        4e-6
    );
    assert_eq!(
        samples["palpa_servo_tick_cpu_seconds{quantile=\"1\"}"],
        f64::INFINITY
    );
    assert_eq!(samples["palpa_web_clients"], 0.0);
    assert_eq!(samples["palpa_up"], 1.0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_sent_and_asked_is_counted() {
    let (session, server) = Session::start(None);
    session.show_mesh(1);
    session.show_frame(1, 6);
    let mut page = Page::open(&server).await;
    page.ask(Request::Lift).await;
    page.ask(Request::Unmark).await;
    page.say("what?").await;
    page.reply().await;
    let samples = parse_metrics(&get(&server, "/metrics").text);
    for (name, value) in [
        ("clients", 1.0),
        ("controlled", 1.0),
        ("connections_total", 1.0),
        ("meshes_sent_total", 1.0),
        ("snapshots_sent_total", 1.0),
        ("snapshots_dropped_total", 0.0),
        ("requests_total", 2.0),
        ("requests_refused_total", 1.0),
        ("malformed_total", 1.0),
        ("clients_dropped_total", 0.0),
    ] {
        assert_eq!(samples[&format!("palpa_web_{name}")], value, "{name}");
    }
    assert!(samples["palpa_web_sent_bytes_total"] > 500.0);
    // One that goes without a word was not let go.
    drop(page);
    session.until_clients(0).await;
    let samples = parse_metrics(&get(&server, "/metrics").text);
    assert_eq!(samples["palpa_web_clients_dropped_total"], 0.0);
}

/// Reads the text format: each sample has a type and words before it, and a number after its name.
fn parse_metrics(text: &str) -> BTreeMap<String, f64> {
    let mut samples = BTreeMap::new();
    let mut helped = String::new();
    let mut typed = String::new();
    for line in text.lines() {
        if let Some(rest) = line.strip_prefix("# HELP ") {
            let (name, words) = rest.split_once(' ').unwrap();
            assert!(words.ends_with('.'));
            helped = name.into();
        } else if let Some(rest) = line.strip_prefix("# TYPE ") {
            let (name, kind) = rest.split_once(' ').unwrap();
            assert_eq!(kind == "counter", name.ends_with("_total"), "{name}");
            typed = name.into();
        } else {
            let (name, value) = line.rsplit_once(' ').unwrap();
            let bare = name.split('{').next().unwrap();
            assert_eq!((bare, bare), (helped.as_str(), typed.as_str()));
            let is_new = samples
                .insert(name.into(), value.parse().unwrap())
                .is_none();
            assert!(is_new, "{name} twice");
        }
    }
    samples
}

#[test]
fn whether_it_is_well() {
    let (session, server) = Session::start(None);
    let got = get(&server, "/healthz");
    assert_eq!((got.status, got.text.as_str()), (200, "ok\n"));
    session.fail("the tissue's thread panicked");
    let got = get(&server, "/healthz");
    assert_eq!(got.status, 503);
    assert!(got.text.contains("panicked"));
    let samples = parse_metrics(&get(&server, "/metrics").text);
    assert_eq!(samples["palpa_up"], 0.0);
}

#[test]
fn the_page_of_the_api_lists_every_operation() {
    let (_session, server) = Session::start(None);
    let document: Value = serde_json::from_str(&get(&server, "/api/openapi.json").text).unwrap();
    assert_eq!(document["openapi"], "3.1.0");
    let page = get(&server, "/api").text;
    let mut n_operations = 0;
    for (path, methods) in document["paths"].as_object().unwrap() {
        for method in methods.as_object().unwrap().keys() {
            let operation = format!("<code>{} {path}</code>", method.to_uppercase());
            assert!(page.contains(&operation), "{operation}");
            n_operations += 1;
        }
    }
    assert!(n_operations >= 10, "{n_operations} operations");
    let links: Vec<_> = page.split("href=\"").skip(1).collect();
    assert!(links.len() == 1 && links[0].starts_with("/api/openapi.json\""));
}

/// Every way that the document names is there.
#[test]
fn the_document_is_true() {
    let (_session, server) = Session::start(None);
    let document: Value = serde_json::from_str(&get(&server, "/api/openapi.json").text).unwrap();
    for (path, methods) in document["paths"].as_object().unwrap() {
        if methods.get("get").is_some() && path != "/ws" {
            let status = get(&server, path).status.to_string();
            let known = &methods["get"]["responses"];
            assert!(known.get(&status).is_some(), "{path}: {status}");
        }
    }
}
