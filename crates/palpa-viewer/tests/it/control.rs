//! Who controls, and what becomes of requests.

use crate::{
    page::Page,
    session::{Session, hand},
};
use palpa_viewer::{
    Clients,
    control::{Edit, Request},
};
use serde_json::json;

fn young(value: &str) -> Request {
    Request::Edit {
        edits: vec![Edit {
            path: "/layer/0/tissue/young".into(),
            value: json!(value),
        }],
    }
}

#[tokio::test]
async fn a_request_is_done_and_seen() {
    let (_session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    assert_eq!(page.ask(young("30 kPa")).await, None);
    let state = page.state_where(|s| s.layers[0].stiffness > 12e3).await;
    assert_eq!(state.layers[0].stiffness, 30e3);
    assert_eq!(state.scene["layer"][0]["tissue"]["young"], "30 kPa");
    let why = page.ask(young("thirty")).await.unwrap();
    assert!(why.contains("expected 0.1 kPa"), "{why}");
    assert_eq!(page.ask(Request::Hand(hand(1e-3))).await, None);
    // Answered on another thread, and not at all.
    assert_eq!(page.ask(Request::Seek { time: 1.0 }).await, None);
    let why = page.ask(Request::Unmark).await.unwrap();
    assert!(why.contains("no answer"), "{why}");
}

#[tokio::test]
async fn what_has_no_number_is_answered_when_it_is_refused() {
    let (_session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    page.say(r#"{"type": "lift"}"#).await;
    page.say(r#"{"type": "edit", "edits": [{"path": "/x", "value": 1}]}"#)
        .await;
    let reply = page.reply().await;
    assert_eq!(reply.id, None);
    assert_eq!(reply.error.unwrap(), "/x: there is no such key");
}

#[tokio::test]
async fn one_controls_the_others_watch_and_hand_over() {
    let (session, server) = Session::start(None);
    let mut first = Page::open(&server).await;
    let mut second = Page::open(&server).await;
    let state = second.state_where(|s| s.n_clients == 2).await;
    assert_eq!(state.controller, Some(first.client));

    let why = second.ask(Request::Lift).await.unwrap();
    assert!(why.contains("take control"), "{why}");
    assert_eq!(second.ask(Request::TakeControl).await, None);
    let state = first
        .state_where(|s| s.controller != Some(first_of(&session)))
        .await;
    assert_eq!(state.controller, Some(second.client));
    assert_eq!(second.ask(Request::Lift).await, None);
    assert!(first.ask(Request::Lift).await.is_some());

    // Who controls leaves; of two that are left nobody controls, and of one that is left it does
    // after a while.
    let mut third = Page::open(&server).await;
    drop(second);
    let state = first
        .state_where(|s| s.n_clients == 2 && s.controller.is_none())
        .await;
    assert!(state.revision > 0);
    let why = third.ask(Request::Lift).await.unwrap();
    assert!(why.contains("nobody controls"), "{why}");
    assert_eq!(third.ask(Request::TakeControl).await, None);
    drop(third);
    first
        .state_where(|s| s.n_clients == 1 && s.controller == Some(first_of(&session)))
        .await;
    assert_eq!(first.ask(Request::Lift).await, None);

    let expected = [
        (1, Some(1)),
        (2, Some(1)),
        (2, Some(2)),
        (3, Some(2)),
        (2, None),
        (2, Some(3)),
        (1, None),
        (1, Some(1)),
    ];
    let expected = expected.map(|(n, controller)| Clients { n, controller });
    assert_eq!(*session.told.borrow(), expected);
}

/// The number of the first connection of a session.
fn first_of(session: &Session) -> u64 {
    session.told.borrow()[0].controller.unwrap()
}

#[tokio::test]
async fn a_page_that_is_loaded_again_controls_again() {
    let (_session, server) = Session::start(None);
    for _ in 0..3 {
        let mut page = Page::open(&server).await;
        let me = page.client;
        page.state_where(|s| s.controller == Some(me) && s.n_clients == 1)
            .await;
        page.socket.close(None).await.unwrap();
    }
}

#[tokio::test]
async fn a_page_that_is_loaded_again_does_not_lose_control_to_one_that_watches() {
    let (_session, server) = Session::start(None);
    let first = Page::open(&server).await;
    let mut watching = Page::open(&server).await;
    watching.state_where(|s| s.n_clients == 2).await;
    drop(first);
    watching.state_where(|s| s.n_clients == 1).await;
    let mut again = Page::open(&server).await;
    let me = again.client;
    again
        .state_where(|s| s.controller == Some(me) && s.n_clients == 2)
        .await;
    assert_eq!(again.ask(Request::Lift).await, None);
    assert!(watching.ask(Request::Lift).await.is_some());
}
