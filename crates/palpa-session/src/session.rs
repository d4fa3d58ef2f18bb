//! The session and its thread: takes orders and makes up to sixty frames a second.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use palpa_scene::Scene;
use palpa_viewer::Publisher;

use crate::bars::Bars;
use crate::desk::{Desk, Workers};
use crate::own::Shelf;
use crate::publish::Fields;
use crate::remote::{Order, Remote};
use crate::world::BEFORE_THE_BROWSER;

/// Time between two frames.
const PERIOD: Duration = Duration::from_micros(16_667);
/// Longest time by which a frame moves the hand on, s, so that the hand does not jump after a
/// delay.
const LONGEST_FRAME: f64 = 0.1;
/// Largest number of orders taken between two frames: more than arrive in a second. A page may send
/// more requests than there are frames.
const MOST_ORDERS: u32 = 1000;
/// Time between two messages with the engine's figures.
const FIGURES_PERIOD: Duration = Duration::from_millis(500);

/// Parameters of a session.
#[derive(Debug, Clone)]
pub struct SessionParams {
    /// The scene.
    pub scene: Scene,
    /// The scene's key, if it is of the gallery.
    pub gallery_key: Option<String>,
    /// The folder for recordings.
    pub out: PathBuf,
    /// Seed of the first round of "find the lump", if the page gives none. Later rounds count up.
    pub seed: Option<u64>,
    /// Whether pages may cause faults on purpose.
    pub allows_faults: bool,
}

/// A session that has not started.
#[derive(Debug)]
pub struct Session {
    params: SessionParams,
    inbox: Receiver<Order>,
    orders: Sender<Order>,
    problem: Arc<Mutex<Option<String>>>,
    shelf: Shelf,
}

/// A running session. When dropped, it stops: the engine ramps the force down and a recording is
/// closed.
#[derive(Debug)]
pub struct Handle {
    orders: Sender<Order>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Handle {
    fn drop(&mut self) {
        let _ = self.orders.send(Order::Stop);
        if let Some(thread) = self.thread.take() {
            // A panic has been reported where it happened.
            let _ = thread.join();
        }
    }
}

impl Session {
    /// Creates a session, and the server's end of it.
    pub fn new(params: SessionParams) -> (Self, Arc<Remote>) {
        let (orders, inbox) = channel();
        let problem = Arc::<Mutex<Option<String>>>::default();
        let shelf = Shelf::default();
        let remote = Arc::new(Remote {
            orders: orders.clone(),
            problem: Arc::clone(&problem),
            curve: Mutex::default(),
            shelf: shelf.clone(),
        });
        let session = Self {
            params,
            inbox,
            orders,
            problem,
            shelf,
        };
        (session, remote)
    }

    /// Runs the session on a thread of its own.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub fn start(self, publisher: Publisher) -> anyhow::Result<Handle> {
        let orders = self.orders.clone();
        let workers = Workers {
            fields: Fields::start()?,
            bars: Bars::start()?,
        };
        let thread = thread::Builder::new()
            .name("palpa-session".to_owned())
            .spawn(move || {
                // This thread moves the hand. It gets the same priority as the tissue's thread, if
                // the system grants it.
                BEFORE_THE_BROWSER.ask("palpa-session");
                let desk = Desk::new(
                    self.params,
                    self.orders,
                    self.problem,
                    publisher,
                    workers,
                    self.shelf,
                );
                run(desk, &self.inbox);
            })?;
        Ok(Handle {
            orders,
            thread: Some(thread),
        })
    }
}

/// The session's thread: takes orders as they arrive, and makes a frame when one is due.
fn run(mut desk: Desk, inbox: &Receiver<Order>) {
    desk.build();
    let mut due = Instant::now();
    let mut figures_due = due;
    let mut last = due;
    loop {
        let rest = due.saturating_duration_since(Instant::now());
        let mut next = match inbox.recv_timeout(rest) {
            Err(RecvTimeoutError::Disconnected) => return desk.end(),
            next => next.ok(),
        };
        let mut n_left = MOST_ORDERS;
        while let Some(order) = next {
            if matches!(order, Order::Stop) {
                return desk.end();
            }
            desk.obey(order);
            n_left -= 1;
            next = if n_left > 0 {
                inbox.try_recv().ok()
            } else {
                None
            };
        }
        let now = Instant::now();
        if now < due {
            continue;
        }
        due = (due + PERIOD).max(now);
        desk.advance((now - last).as_secs_f64().min(LONGEST_FRAME), now);
        last = now;
        if now >= figures_due {
            figures_due = now + FIGURES_PERIOD;
            desk.tell_figures();
        }
        desk.tell_state();
    }
}
