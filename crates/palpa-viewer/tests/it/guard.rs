//! Who may come in.

use crate::{
    http::{get, get_with},
    page::{Page, socket_url},
    session::{Session, TOKEN},
};
use palpa_viewer::Server;
use std::{
    io::{Read, Write},
    net::TcpStream,
    time::Duration,
};
use tokio_tungstenite::{
    connect_async,
    tungstenite::{Error, client::IntoClientRequest},
};

/// The answer to a request as it is written.
fn raw(server: &Server, request: &str) -> String {
    let mut stream = TcpStream::connect(server.address()).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(5)))
        .unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

fn status(server: &Server, headers: &str) -> u16 {
    let answer = raw(
        server,
        &format!("GET /api/state HTTP/1.1\r\n{headers}Connection: close\r\n\r\n"),
    );
    answer.split(' ').nth(1).unwrap().parse().unwrap()
}

#[test]
fn strangers_pages_are_refused() {
    let (_session, server) = Session::start(None);
    let port = server.address().port();
    for (host, origin, expected) in [
        ("127.0.0.1:PORT", None, 200),
        ("localhost:PORT", None, 200),
        ("localhost:9", None, 200),
        ("evil.example:PORT", None, 403),
        ("127.0.0.1.evil.example", None, 403),
        ("127.0.0.1:PORT", Some("http://127.0.0.1:PORT"), 200),
        ("localhost:PORT", Some("http://localhost:PORT"), 200),
        ("127.0.0.1:PORT", Some("http://localhost:PORT"), 403),
        ("127.0.0.1:PORT", Some("http://127.0.0.1:1"), 403),
        ("127.0.0.1:PORT", Some("https://evil.example"), 403),
        ("127.0.0.1:PORT", Some("null"), 403),
    ] {
        let origin = origin.map_or(String::new(), |o| format!("Origin: {o}\r\n"));
        let headers = format!("Host: {host}\r\n{origin}").replace("PORT", &port.to_string());
        assert_eq!(status(&server, &headers), expected, "{headers}");
    }
    assert_eq!(status(&server, ""), 403);
    let twice = format!(
        "Host: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\nOrigin: http://e\r\n"
    );
    assert_eq!(status(&server, &twice), 403);
}

async fn socket_status(url: &str, headers: &[(&'static str, &str)]) -> u16 {
    let mut request = url.into_client_request().unwrap();
    for (name, value) in headers {
        request.headers_mut().insert(*name, value.parse().unwrap());
    }
    match connect_async(request).await {
        Ok(_) => 101,
        Err(Error::Http(response)) => response.status().as_u16(),
        Err(error) => panic!("{error}"),
    }
}

#[tokio::test]
async fn strangers_pages_have_no_socket() {
    let (_session, server) = Session::start(None);
    let url = socket_url(server.address());
    let own = format!("http://{}", server.address());
    assert_eq!(socket_status(&url, &[("origin", &own)]).await, 101);
    assert_eq!(socket_status(&url, &[]).await, 101);
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1"] {
        assert_eq!(socket_status(&url, &[("origin", origin)]).await, 403);
    }
    assert_eq!(socket_status(&url, &[("host", "evil.example")]).await, 403);
}

#[test]
fn what_needs_the_token() {
    let (_session, server) = Session::start(Some(TOKEN));
    for (path, free) in [
        ("/", true),
        ("/healthz", true),
        ("/api", false),
        ("/api/state", false),
        ("/api/openapi.json", false),
        ("/api/scene.toml", false),
        ("/api/recording.csv", false),
        ("/metrics", false),
        ("/ws", false),
    ] {
        let got = get(&server, path);
        assert_eq!(got.status != 401, free, "{path}");
        if !free {
            assert_eq!(got.headers["www-authenticate"], "Bearer");
            assert!(got.text.contains("token"), "{}", got.text);
        }
    }
    let bearer = format!("Bearer {TOKEN}");
    for (value, expected) in [
        (bearer.as_str(), 200),
        ("Bearer sesame", 401),
        ("Bearer ", 401),
        ("Bearer", 401),
        (TOKEN, 401),
        ("Basic eA==", 401),
    ] {
        let got = get_with(&server, "/api/state", &[("Authorization", value)]);
        assert_eq!(got.status, expected, "{value}");
    }
    let asked = "token=sesame%2C+open%20%26%20shut";
    assert_eq!(
        get(&server, &format!("/api/scene.toml?{asked}")).status,
        200
    );
    assert_eq!(get(&server, "/api/scene.toml?token=").status, 401);
    // What changes something brings it in the header.
    let url = format!("http://{}/api/control", server.address());
    let lift = |url: &str, bearer: &str| {
        crate::http::agent()
            .post(url)
            .header("Content-Type", "application/json")
            .header("Authorization", bearer)
            .send(r#"{"type": "lift"}"#)
            .unwrap()
            .status()
            .as_u16()
    };
    assert_eq!(lift(&format!("{url}?{asked}"), ""), 401);
    assert_eq!(lift(&url, &bearer), 200);
}

#[tokio::test]
async fn a_socket_needs_the_token() {
    let (_session, server) = Session::start(Some(TOKEN));
    let url = socket_url(server.address());
    assert_eq!(socket_status(&url, &[]).await, 401);
    assert_eq!(
        socket_status(&format!("{url}?token=wrong-one"), &[]).await,
        401
    );
    let query = server.url();
    let query = query.split_once('?').unwrap().1;
    let mut page = Page::open_url(&format!("{url}?{query}")).await.unwrap();
    assert_eq!(page.state().await.n_clients, 1);
}
