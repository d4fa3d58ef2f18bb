//! What the routes share: the board, the session, and who may ask it.

use crate::{
    board::{Board, Controller},
    control::Request,
    guard::Guard,
    host::{Clients, Host},
    limits::{Gate, MAX_CLIENTS, MAX_FILES},
};
use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Instant,
};
use tokio::sync::{Semaphore, watch};

/// What the routes share.
pub(crate) struct Hub {
    pub(crate) board: Arc<Board>,
    pub(crate) host: Arc<dyn Host>,
    pub(crate) guard: Guard,
    /// A permit per client.
    pub(crate) places: Arc<Semaphore>,
    /// A permit per file that is being made.
    pub(crate) files: Arc<Semaphore>,
    /// Whether the server is to end.
    pub(crate) closing: watch::Receiver<bool>,
    /// Counts what programs ask by `/api/control`, all together.
    pub(crate) programs: Mutex<Gate>,
    /// What the session knows of the clients. Held while it is told, so that it is told in order.
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
            closing,
            programs: Mutex::new(Gate::new(Instant::now())),
            told: Mutex::default(),
        }
    }

    /// Tells the session who is connected, if it does not know.
    pub(crate) fn tell_clients(&self) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let clients = self.board.clients();
        if *told != clients {
            *told = clients;
            self.host.clients(clients);
        }
    }

    /// Does what is asked, if who asks may ask it. `answer` is called once, here or later on any thread.
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

    fn may_ask(&self, who: Controller) -> Result<(), &'static str> {
        match (who, self.board.controller()) {
            (who, controller) if who == controller => Ok(()),
            // A program needs no leave where there is nobody to disturb.
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

/// Calls what it holds once: with the outcome, or with words that there was none.
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
