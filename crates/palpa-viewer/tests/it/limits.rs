//! Messages that are malformed, huge or too many, and pages that are too many or silent.

use crate::{
    page::{Page, Told, socket_url},
    session::Session,
};
use futures_util::{SinkExt, StreamExt};
use palpa_viewer::control::{Message, NoticeKind, NoticeLevel, Request};
use std::time::Duration;
use tokio::time::timeout;
use tokio_tungstenite::{
    connect_async,
    tungstenite::{self, Bytes, protocol::frame::coding::CloseCode},
};

#[tokio::test]
async fn what_is_malformed_is_told_and_the_connection_goes_on() {
    let (_session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    for (text, id, expected) in [
        ("", None, "line 1 column 0"),
        ("{\n  \"type\" 1}", None, "line 2 column 10"),
        (
            r#"{"id": 4, "type": "fly"}"#,
            Some(4),
            "unknown variant `fly`",
        ),
        (r#"{"id": 5}"#, Some(5), "missing field `type`"),
        (
            r#"{"id": 6, "type": "seek"}"#,
            Some(6),
            "missing field `time`",
        ),
        (
            r#"{"id": 7, "type": "hand", "point": [1, 2], "normal": [0, 0, 1], "depth": 0}"#,
            Some(7),
            "length 2",
        ),
        (
            r#"{"id": 8, "type": "seek", "time": 1e999}"#,
            Some(8),
            "out of range",
        ),
        (r#"["x"]"#, None, "expected struct Envelope"),
    ] {
        page.say(text).await;
        let reply = page.reply().await;
        let why = reply.error.unwrap();
        assert!(why.contains(expected), "{text}: {why}");
        assert!(why.contains("expected a request"), "{why}");
        assert_eq!(reply.id, id, "{text}");
    }
    let deep = "[".repeat(50_000);
    page.say(format!(
        r#"{{"type": "edit", "edits": [{{"path": "/x", "value": {deep}"#
    ))
    .await;
    assert!(page.reply().await.error.unwrap().contains("recursion"));
    let name = format!(r#"{{"type": "{}"}}"#, "x".repeat(50_000));
    page.say(name).await;
    assert!(page.reply().await.error.unwrap().len() < 1500);
    assert_eq!(page.ask(Request::Lift).await, None);
}

#[tokio::test]
async fn twenty_malformed_ones_in_a_row_are_the_end() {
    let (_session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    for _ in 0..3 {
        for _ in 0..19 {
            page.say("{").await;
            assert!(page.reply().await.error.is_some());
        }
        assert_eq!(page.ask(Request::Lift).await, None);
    }
    for _ in 0..20 {
        page.say("{").await;
    }
    assert!(matches!(
        page.end().await,
        Told::Closed(CloseCode::Policy, _)
    ));
}

#[tokio::test]
async fn bytes_are_refused() {
    let (_session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    let bytes = tungstenite::Message::Binary(Bytes::from_static(b"\0\x01"));
    page.socket.send(bytes).await.unwrap();
    let why = page.reply().await.error.unwrap();
    assert!(why.contains("JSON"), "{why}");
    assert_eq!(page.ask(Request::Lift).await, None);
}

#[tokio::test]
async fn scenes_may_be_long_and_other_requests_not() {
    let (_session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    let text = "x".repeat(900_000);
    assert_eq!(
        page.ask(Request::LoadText {
            text,
            files: vec![]
        })
        .await,
        None
    );
    let key = "x".repeat(100_000);
    let why = page.ask(Request::LoadScene { key }).await.unwrap();
    assert!(why.contains("at most 65536"), "{why}");
}

#[tokio::test]
async fn what_is_huge_is_the_end() {
    let (session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    let text = tungstenite::Message::text("x".repeat((1 << 20) + 1));
    // The server may end it before all is sent.
    let _ = page.socket.send(text).await;
    match page.end().await {
        Told::Closed(code, why) => {
            assert_eq!(
                (code, why.as_str()),
                (CloseCode::Size, "a message is longer than 1 MiB")
            );
        }
        Told::Lost => {}
        told => panic!("{told:?}"),
    }
    session.until_clients(0).await;
    let mut page = Page::open(&server).await;
    assert_eq!(page.ask(Request::Lift).await, None);
}

#[tokio::test]
async fn too_many_requests_are_left_out_and_then_the_end() {
    let (session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    for _ in 0..500 {
        page.say(r#"{"type": "lift"}"#).await;
    }
    loop {
        if let Told::Message(Message::Notice(notice)) = page.hear().await {
            assert_eq!(notice.level, NoticeLevel::Warning);
            assert_eq!(notice.what, NoticeKind::TooManyRequests);
            break;
        }
    }
    for _ in 0..2000 {
        let text = tungstenite::Message::text(r#"{"type": "lift"}"#);
        if page.socket.send(text).await.is_err() {
            break;
        }
    }
    assert!(matches!(
        page.end().await,
        Told::Closed(CloseCode::Policy, _) | Told::Lost
    ));
    session.until_clients(0).await;
}

#[tokio::test]
async fn thirty_two_pages_and_no_more() {
    let (session, server) = Session::start(None);
    let mut pages = vec![];
    for _ in 0..32 {
        pages.push(Page::open(&server).await);
    }
    let Err(tungstenite::Error::Http(refusal)) = connect_async(socket_url(server.address())).await
    else {
        panic!("a 33rd page");
    };
    assert_eq!(refusal.status(), 503);
    let words = String::from_utf8(refusal.into_body().unwrap()).unwrap();
    assert!(words.contains("32 pages"), "{words}");
    pages.pop();
    session.until_clients(31).await;
    // Its place is free when it has said good-bye.
    let again = async { while Page::open_url(&socket_url(server.address())).await.is_err() {} };
    // Only turns a hang into a failure.
    let again = timeout(Duration::from_mins(1), again).await;
    assert!(again.is_ok(), "its place was kept");
}

/// A page takes silence for a lost connection. While the session says nothing, it hears the state
/// again. How soon, the limits' own tests say.
#[tokio::test]
async fn a_page_hears_something_though_the_session_is_silent_slow() {
    let (_session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    let first = page.state().await;
    for _ in 0..2 {
        assert_eq!(page.state().await, first);
    }
}

/// A page that answers pings stays though it says nothing; one that does not goes, after three
/// pings. Takes as long as the patience.
#[tokio::test]
async fn who_is_silent_is_let_go_slow() {
    let (session, server) = Session::start(None);
    let mut quiet = Page::open(&server).await;
    let dead = Page::open(&server).await;
    session.until_clients(2).await;
    let mut n_pings = 0;
    let gone = session.until_clients(1);
    tokio::pin!(gone);
    loop {
        tokio::select! {
            () = &mut gone => break,
            // Reading answers pings.
            message = quiet.socket.next() => {
                n_pings += u32::from(message.unwrap().unwrap().is_ping());
            }
        }
    }
    assert!(n_pings >= 2, "{n_pings} pings");
    assert_eq!(quiet.ask(Request::TakeControl).await, None);
    drop(dead);
}
