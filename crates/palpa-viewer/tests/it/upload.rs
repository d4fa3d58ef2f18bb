//! A user's own files: who may send them, how large they may be, and what comes back.

use crate::{
    http::{agent, get},
    page::Page,
    session::{Session, TOKEN, mesh_of},
};
use palpa_viewer::{
    Server,
    control::{Request, UPLOAD_LIMITS, Uploaded},
};
use std::io::{Read as _, repeat};

const BYTES: &str = "application/octet-stream";

/// Status and text of the answer to a file.
fn send(server: &Server, query: &str, headers: &[(&str, &str)], bytes: &[u8]) -> (u16, String) {
    let url = format!("http://{}/api/upload{query}", server.address());
    let mut request = agent().post(url);
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    let mut response = request.send(bytes).unwrap();
    let status = response.status().as_u16();
    (status, response.body_mut().read_to_string().unwrap())
}

fn send_plain(server: &Server, query: &str) -> (u16, String) {
    send(server, query, &[("Content-Type", BYTES)], b"solid")
}

#[test]
fn a_file_is_taken_and_can_be_checked_and_drawn() {
    let (_session, server) = Session::start(None);
    let (status, text) = send_plain(&server, "?name=left%20arm.stl");
    assert_eq!(status, 200, "{text}");
    let uploaded: Uploaded = serde_json::from_str(&text).unwrap();
    assert_eq!(uploaded.name, "left arm.stl, 5 bytes");
    let checked = get(&server, "/api/upload/check?id=7&unit=mm");
    assert_eq!(checked.status, 200, "{}", checked.text);
    assert!(checked.text.contains("Mm"));
    let url = format!("http://{}/api/upload/mesh?id=7", server.address());
    let mut mesh = agent().get(url).call().unwrap();
    assert_eq!(mesh.body_mut().read_to_vec().unwrap(), mesh_of(7).encode());
    for path in ["/api/upload/check?id=8&unit=mm", "/api/upload/mesh?id=8"] {
        let gone = get(&server, path);
        assert_eq!(gone.status, 404);
        assert!(gone.text.contains("send its file again"), "{}", gone.text);
    }
    for path in [
        "/api/upload/check?id=7&unit=miles",
        "/api/upload/mesh?id=-1",
        "/api/upload/check",
    ] {
        assert_eq!(get(&server, path).status, 400, "{path}");
    }
}

#[tokio::test]
async fn only_who_controls_may_send_a_file() {
    let (_session, server) = Session::start(None);
    let first = Page::open(&server).await;
    let mut second = Page::open(&server).await;
    let of = |page: &Page| format!("?name=a.stl&client={}", page.client);
    assert_eq!(send_plain(&server, &of(&first)).0, 200);
    for query in [
        of(&second),
        "?name=a.stl".to_owned(),
        "?name=a.stl&client=99".to_owned(),
    ] {
        let (status, why) = send_plain(&server, &query);
        assert_eq!(status, 409);
        assert!(why.contains("take control"), "{why}");
    }
    assert_eq!(second.ask(Request::TakeControl).await, None);
    assert_eq!(send_plain(&server, &of(&second)).0, 200);
    assert_eq!(send_plain(&server, &of(&first)).0, 409);
}

#[test]
fn other_sites_and_strangers_may_not_send_files() {
    let (_session, server) = Session::start(Some(TOKEN));
    let query = "?name=a.stl";
    let token = format!("Bearer {TOKEN}");
    let good = [("Content-Type", BYTES), ("Authorization", &token)];
    assert_eq!(send(&server, query, &good, b"solid").0, 200);
    assert_eq!(send_plain(&server, query).0, 401);
    let foreign = [good[0], good[1], ("Origin", "http://evil.example")];
    assert_eq!(send(&server, query, &foreign, b"solid").0, 403);
    // A form can send these without permission.
    for kind in [
        "text/plain",
        "multipart/form-data",
        "application/x-www-form-urlencoded",
    ] {
        let form = [("Content-Type", kind), good[1]];
        assert_eq!(send(&server, query, &form, b"solid").0, 415, "{kind}");
    }
}

#[test]
fn bad_files_are_refused_in_words() {
    let (_session, server) = Session::start(None);
    let kind = [("Content-Type", BYTES)];
    let (status, why) = send(&server, "?name=a.stl", &kind, b"");
    assert_eq!((status, why.as_str()), (422, "a.stl is empty\n"));
    assert_eq!(send_plain(&server, "").0, 400);
    assert_eq!(send_plain(&server, "?name=").0, 400);
    let long = format!("?name={}", "x".repeat(300));
    assert_eq!(send_plain(&server, &long).0, 400);
}

#[test]
fn a_file_is_no_larger_than_the_limit_whether_its_length_is_said_or_not() {
    let (_session, server) = Session::start(None);
    let url = format!("http://{}/api/upload?name=a.stl", server.address());
    let large = || repeat(b'x').take(UPLOAD_LIMITS.bytes + 1);
    let request = || agent().post(&url).header("Content-Type", BYTES);
    let announced = request()
        .header("Content-Length", (UPLOAD_LIMITS.bytes + 1).to_string())
        .header("Expect", "100-continue");
    // A server that closes early may break the sending.
    let answers = [
        announced.send(ureq::SendBody::from_owned_reader(large())),
        request().send(ureq::SendBody::from_owned_reader(large())),
    ];
    for mut response in answers.into_iter().flatten() {
        assert_eq!(response.status().as_u16(), 413);
        let why = response.body_mut().read_to_string().unwrap();
        assert!(why.contains("64 MB") && why.contains("thin"), "{why}");
    }
    // The next one is taken, so nothing is held.
    assert_eq!(send_plain(&server, "?name=a.stl").0, 200);
}
