//! The state that all routes share: the board, the session, and the access rules.

use crate::{
    board::{Board, Controller},
    control::Request,
    guard::Guard,
    host::{Clients, Host},
    limits::{Gate, MAX_CLIENTS, MAX_FILES, MAX_UPLOADS},
};
use std::{
    hash::{BuildHasher, RandomState},
    sync::{Arc, Mutex, PoisonError},
    time::Instant,
};
use tokio::sync::{Semaphore, watch};

/// The state that all routes share.
pub(crate) struct Hub {
    pub(crate) board: Arc<Board>,
    pub(crate) host: Arc<dyn Host>,
    pub(crate) guard: Guard,
    /// One permit per client.
    pub(crate) places: Arc<Semaphore>,
    /// One permit per file that is being made.
    pub(crate) files: Arc<Semaphore>,
    /// One permit per file that a client sends.
    pub(crate) uploads: Arc<Semaphore>,
    /// Name of this run of the program, by which pages notice a restart.
    pub(crate) run: String,
    /// True when the server shall end.
    pub(crate) closing: watch::Receiver<bool>,
    /// Rate limit for requests through `/api/control`, all programs together.
    pub(crate) programs: Mutex<Gate>,
    /// The clients as the session last heard of them. Locked during the call to the session, so
    /// that the calls stay in order.
    told: Mutex<Clients>,
}

impl Hub {
    pub(crate) fn new(
        board: Arc<Board>,
        host: Arc<dyn Host>,
        guard: Guard,
        closing: watch::Receiver<bool>,
    ) -> Self {
        Self {
            board,
            host,
            guard,
            places: Arc::new(Semaphore::new(MAX_CLIENTS)),
            files: Arc::new(Semaphore::new(MAX_FILES)),
            uploads: Arc::new(Semaphore::new(MAX_UPLOADS)),
            // The keys of a hasher are random.
            run: format!("{:016x}", RandomState::new().hash_one(0)),
            closing,
            programs: Mutex::new(Gate::new(Instant::now())),
            told: Mutex::default(),
        }
    }

    /// Tells the session which clients are connected, if that has changed.
    pub(crate) fn tell_clients(&self) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let clients = self.board.clients();
        if *told != clients {
            *told = clients;
            self.host.clients(clients);
        }
    }

    /// Carries out the request if `who` is allowed to make it. `answer` is called once, here or
    /// later on any thread.
    pub(crate) fn ask<F>(self: &Arc<Self>, who: Controller, request: Request, answer: F)
    where
        F: FnOnce(Result<(), String>) + Send + 'static,
    {
        self.board.counts.requests.add(1);
        if request == Request::TakeControl {
            self.board.take_control(who);
            self.tell_clients();
            return answer(Ok(()));
        }
        if let Err(why) = self.may_ask(who) {
            self.board.counts.refused.add(1);
            return answer(Err(why.to_owned()));
        }
        let board = Arc::clone(&self.board);
        let once = Once(Some(move |outcome: Result<(), String>| {
            if outcome.is_err() {
                board.counts.refused.add(1);
            }
            answer(outcome);
        }));
        self.host
            .request(request, Box::new(move |outcome| once.call(outcome)));
    }

    /// Refuses a client that may not make requests now.
    pub(crate) fn may_ask(&self, who: Controller) -> Result<(), &'static str> {
        match (who, self.board.controller()) {
            (who, controller) if who == controller => Ok(()),
            // A program may act without control while nobody is in control: it disturbs nobody.
            (Controller::Program, Controller::Nobody) => Ok(()),
            (_, Controller::Page(_)) => {
                Err("another page controls and this one watches; take control first")
            }
            (_, Controller::Program) => {
                Err("a program controls and this page watches; take control first")
            }
            (_, Controller::Nobody) => Err("nobody controls; take control first"),
        }
    }
}

/// Calls its function once: with the result, or with an error if it is dropped before.
struct Once<F: FnOnce(Result<(), String>)>(Option<F>);

impl<F: FnOnce(Result<(), String>)> Once<F> {
    fn call(mut self, outcome: Result<(), String>) {
        if let Some(answer) = self.0.take() {
            answer(outcome);
        }
    }
}

impl<F: FnOnce(Result<(), String>)> Drop for Once<F> {
    fn drop(&mut self) {
        if let Some(answer) = self.0.take() {
            answer(Err("the engine gave no answer; it may be stopping".into()));
        }
    }
}
