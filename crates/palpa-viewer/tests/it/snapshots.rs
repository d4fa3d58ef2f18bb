//! What is shown: in order, as new as each client can take it, and at nobody's cost.

use crate::{
    page::{Page, Told},
    session::Session,
};
use palpa_viewer::control::{EngineFigures, EventKind, Message, Notice, NoticeKind, NoticeLevel};

#[tokio::test]
async fn a_new_page_is_told_all_in_order() {
    let (session, server) = Session::start(None);
    session.show_mesh(5);
    let frame = session.show_frame(5, 6);
    let mut page = Page::open(&server).await;
    let Told::Message(Message::State(state)) = page.hear().await else {
        panic!("expected the state after hello");
    };
    assert_eq!((state.controller, state.n_clients), (Some(page.client), 1));
    assert!(matches!(page.hear().await, Told::Mesh(5)));
    assert!(matches!(page.hear().await, Told::Frame(5, f) if f == frame));
}

#[tokio::test]
async fn a_mesh_comes_before_its_frames_and_once() {
    let (session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    session.show_frame(1, 6);
    session.show_mesh(1);
    let mut last = 0;
    for mesh in 1..=5 {
        if mesh > 1 {
            session.show_mesh(mesh);
        }
        // One of the mesh before comes late, and is shown to nobody.
        session.show_frame(mesh - 1, 6);
        let mut known = 0;
        for _ in 0..10 {
            let shown = session.show_frame(mesh, 6);
            loop {
                match page.hear().await {
                    Told::Mesh(m) => {
                        assert_ne!(m, known, "sent twice");
                        known = m;
                    }
                    Told::Frame(m, f) => {
                        assert_eq!((m, m), (known, mesh));
                        assert!(f > last);
                        last = f;
                        if f == shown {
                            break;
                        }
                    }
                    Told::Message(_) => {}
                    end => panic!("{end:?}"),
                }
            }
        }
        assert_eq!(known, mesh);
    }
    // The same number again, as after a restart, is another mesh.
    session.show_mesh(5);
    assert!(matches!(page.hear().await, Told::Mesh(5)));
}

#[tokio::test]
async fn figures_and_notices_are_told() {
    let (_session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    page.state().await;
    let publisher = server.publisher();
    publisher.engine(EngineFigures {
        tissue_rate: 120.0,
        ..EngineFigures::default()
    });
    assert!(
        matches!(page.hear().await, Told::Message(Message::Engine(e)) if e.tissue_rate == 120.0)
    );
    let notice = Notice {
        level: NoticeLevel::Warning,
        what: NoticeKind::Engine {
            event: EventKind::TimeLost { seconds: 0.02 },
        },
    };
    publisher.notice(notice.clone());
    assert!(matches!(page.hear().await, Told::Message(Message::Notice(n)) if n == notice));
}

#[tokio::test]
async fn each_change_of_the_state_is_told_and_the_revision_grows() {
    let (_session, server) = Session::start(None);
    let mut page = Page::open(&server).await;
    let first = page.state().await;
    let _other = Page::open(&server).await;
    let second = page.state().await;
    assert!(second.revision > first.revision);
    assert_eq!(second.n_clients, 2);
}

/// A page that reads nothing holds neither the publisher nor other pages, and is let go. Takes as
/// long as its patience: what the sleeper has not read fills the system's buffers within a few
/// dozen frames, and from then on it would hold up whoever waits for it.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_page_that_does_not_read_is_left_behind_slow() {
    let (session, server) = Session::start(None);
    session.show_mesh(1);
    let sleeper = Page::open(&server).await;
    let mut page = Page::open(&server).await;
    let before = resident();
    assert!(before > 0 || !cfg!(target_os = "linux"));
    let mut n_beside_the_sleeper = 0;
    // 20,000 nodes: 120 kB, 360 MB in all.
    for n in 0..3000 {
        let shown = session.show_frame(1, 20_000);
        loop {
            match page.hear().await {
                Told::Frame(_, f) if f == shown => break,
                Told::Closed(code, why) => panic!("{code} {why}"),
                Told::Lost => panic!("lost"),
                _ => {}
            }
        }
        if server.publisher().n_clients() == 2 {
            n_beside_the_sleeper = n;
        }
    }
    assert!(n_beside_the_sleeper > 200, "{n_beside_the_sleeper} frames");
    let grown = resident().saturating_sub(before);
    assert!(grown < 100 << 20, "{grown} bytes more");
    session.until_clients(1).await;
    assert_eq!(server.publisher().n_clients(), 1);
    drop(sleeper);
}

/// Memory of this process, bytes; 0 where the system does not say.
fn resident() -> usize {
    std::fs::read_to_string("/proc/self/statm")
        .ok()
        .and_then(|text| text.split(' ').nth(1)?.parse::<usize>().ok())
        .map_or(0, |pages| 4096 * pages)
}
