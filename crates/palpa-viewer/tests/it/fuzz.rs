//! Whatever comes in, nothing breaks and the server still answers.

use crate::{
    http::{get, post},
    page::{Page, socket_url},
    session::Session,
};
use futures_util::{SinkExt, StreamExt};
use palpa_testkit::cases;
use palpa_viewer::{Server, control::Request};
use proptest::{collection::vec, prelude::*};
use serde_json::{Value, json};
use std::{
    io::{ErrorKind, Read, Write},
    net::{Shutdown, TcpStream},
    time::Duration,
};
use tokio_tungstenite::{connect_async, tungstenite};

/// JSON that is often nearly a request.
fn nearly() -> impl Strategy<Value = String> {
    let types = prop::sample::select(vec![
        "take_control",
        "hand",
        "lift",
        "load_scene",
        "load_text",
        "edit",
        "run_motion",
        "seek",
        "play",
        "show_field",
        "start_game",
        "next_round",
        "mark",
        "reveal",
        "inject",
        "restart",
        "Hand",
        "",
    ]);
    let keys = prop::sample::select(vec![
        "id", "point", "normal", "depth", "key", "text", "edits", "path", "value", "time", "on",
        "field", "seed", "n_lumps", "level", "n_rounds", "fault", "type",
    ]);
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        any::<i64>().prop_map(Value::from),
        any::<f64>().prop_map(Value::from),
        ".{0,12}".prop_map(Value::from),
        Just(json!([0.0, 0.0, 1.0])),
        Just(json!([1e308, -1e308, 5e-324])),
        Just(json!([{ "path": "/layer/0/tissue/young", "value": "9 kPa" }])),
    ];
    let value = leaf.prop_recursive(4, 24, 5, |inner| {
        prop_oneof![
            vec(inner.clone(), 0..5).prop_map(Value::from),
            vec((".{0,6}", inner), 0..5).prop_map(|pairs| pairs.into_iter().collect()),
        ]
    });
    (types, vec((keys, value), 0..6)).prop_map(|(kind, pairs)| {
        let mut object = json!({ "type": kind });
        for (key, value) in pairs {
            object[key] = value;
        }
        object.to_string()
    })
}

fn message() -> impl Strategy<Value = tungstenite::Message> {
    prop_oneof![
        4 => nearly().prop_map(tungstenite::Message::text),
        2 => (nearly(), 0..200usize).prop_map(|(text, n)| {
            let n = text.floor_char_boundary(n);
            tungstenite::Message::text(&text[..n])
        }),
        1 => ".{0,200}".prop_map(tungstenite::Message::text),
        1 => vec(any::<u8>(), 0..200).prop_map(tungstenite::Message::binary),
        1 => vec(any::<u8>(), 0..125).prop_map(|b| tungstenite::Message::Ping(b.into())),
        1 => vec(any::<u8>(), 0..125).prop_map(|b| tungstenite::Message::Pong(b.into())),
    ]
}

/// The server is well, and does what a page asks.
async fn still_answers(server: &Server) {
    assert_eq!(get(server, "/healthz").status, 200);
    let mut page = Page::open(server).await;
    assert_eq!(page.ask(Request::TakeControl).await, None);
    assert_eq!(page.ask(Request::Lift).await, None);
}

#[test]
fn any_messages_on_a_socket() {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let (_session, server) = Session::start(None);
    proptest!(ProptestConfig::with_cases(cases(64)), |(messages in vec(message(), 1..40), is_polite: bool)| {
        runtime.block_on(async {
            let (mut socket, _) = connect_async(socket_url(server.address())).await.unwrap();
            for message in messages {
                if socket.send(message).await.is_err() {
                    break;
                }
            }
            if is_polite {
                let _ = socket.close(None).await;
                while let Some(Ok(_)) = socket.next().await {}
            }
        });
    });
    runtime.block_on(still_answers(&server));
}

#[test]
fn any_bytes_instead_of_http_and_of_frames() {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let (_session, server) = Session::start(None);
    let upgrade = format!(
        "GET /ws HTTP/1.1\r\nHost: {}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
        server.address()
    );
    proptest!(ProptestConfig::with_cases(cases(64)), |(bytes in vec(any::<u8>(), 0..400), is_socket: bool)| {
        let mut stream = TcpStream::connect(server.address()).unwrap();
        // Only turns a hang into a failure.
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        if is_socket {
            stream.write_all(upgrade.as_bytes()).unwrap();
        }
        // It may be closed under our hands.
        let _ = stream.write_all(&bytes);
        let _ = stream.shutdown(Shutdown::Write);
        // Whoever has said all is answered, or not, and let go.
        if let Err(error) = stream.read_to_end(&mut vec![]) {
            prop_assert!(!matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut), "{}", error);
        }
    });
    runtime.block_on(still_answers(&server));
}

#[test]
fn any_body_of_a_request() {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let (_session, server) = Session::start(None);
    let body = prop_oneof![
        3 => nearly().prop_map(String::into_bytes),
        1 => vec(any::<u8>(), 0..400),
    ];
    proptest!(ProptestConfig::with_cases(cases(128)), |(body in body)| {
        let status = post(&server, &body).status;
        prop_assert!([200, 400, 409, 429].contains(&status), "{}", status);
    });
    runtime.block_on(still_answers(&server));
}
