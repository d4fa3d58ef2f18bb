//! How the server starts and ends.

use crate::{
    page::{Page, Told, socket_url},
    session::{Session, TOKEN, params},
};
use palpa_viewer::{Server, ServerError, ServerParams};
use std::{
    net::{Ipv4Addr, TcpListener},
    time::Duration,
};
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;

fn refusal(params: &ServerParams) -> ServerError {
    let (session, _server) = Session::start(None);
    Server::start(params, session).unwrap_err()
}

#[tokio::test]
async fn a_port_in_use_is_told_with_what_to_do() {
    let there = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = there.local_addr().unwrap().port();
    let why = refusal(&ServerParams {
        port,
        ..params(None)
    });
    assert!(matches!(why, ServerError::PortInUse { port: p, .. } if p == port));
    let words = why.to_string();
    assert!(words.contains(&port.to_string()) && words.contains("--port 0"));
}

#[test]
fn a_network_needs_a_token_that_cannot_be_guessed() {
    let open = |token: Option<&str>| ServerParams {
        bind: Ipv4Addr::UNSPECIFIED.into(),
        ..params(token)
    };
    let words = refusal(&open(None)).to_string();
    assert!(words.contains("--bind 0.0.0.0") && words.contains("--token"));
    for token in ["", "1234567"] {
        let why = refusal(&open(Some(token)));
        assert!(matches!(why, ServerError::ShortToken { found } if found == token.len()));
    }
    let (session, _server) = Session::start(None);
    let server = Server::start(&open(Some(TOKEN)), session).unwrap();
    let port = server.address().port();
    assert_eq!(
        server.url(),
        format!("http://127.0.0.1:{port}/?token=sesame%2C%20open%20%26%20shut")
    );
    assert!(!format!("{:?}", open(Some(TOKEN))).contains("sesame"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn dropping_it_lets_all_go() {
    let (session, server) = Session::start(None);
    session.show_mesh(1);
    let publisher = server.publisher();
    let address = server.address();
    let mut pages = vec![];
    for _ in 0..3 {
        pages.push(Page::open(&server).await);
    }
    let ending = tokio::task::spawn_blocking(move || drop(server));
    for page in &mut pages {
        assert!(matches!(page.end().await, Told::Closed(CloseCode::Away, _)));
    }
    drop(pages);
    // Only turns a hang into a failure.
    let ended = tokio::time::timeout(Duration::from_mins(1), ending).await;
    ended.expect("the server ends").unwrap();
    assert!(Page::open_url(&socket_url(address)).await.is_err());
    // Who publishes need not know.
    session.show_frame(1, 6);
    assert_eq!(publisher.n_clients(), 0);
    assert_eq!(session.told.borrow().last().unwrap().n, 0);
}

#[tokio::test]
async fn a_hundred_connections_leave_nothing_behind() {
    let (session, server) = Session::start(None);
    session.show_mesh(1);
    session.show_frame(1, 1000);
    for i in 0..100 {
        let mut page = Page::open(&server).await;
        page.state().await;
        if i % 2 == 0 {
            page.socket.close(None).await.unwrap();
        }
    }
    session.until_clients(0).await;
    // Every place is free again.
    let mut pages = vec![];
    for _ in 0..32 {
        pages.push(Page::open(&server).await);
    }
    assert_eq!(server.publisher().n_clients(), 32);
}
