//! One client, a page or a program, at the other end of a WebSocket.
//!
//! ```text
//!  hello, state, mesh, frame │ then, whatever is new and as fast as the client takes it:
//!                            │ ping, answers, state, notices, engine, mesh before its frames
//! ```
//! One task per client reads and writes. Nobody waits for a slow client: it misses frames, and
//! after a while the server closes its connection.

use crate::{
    board::{Board, Controller, Picture, json},
    control::{
        Envelope, Hello, Message, Notice, NoticeKind, NoticeLevel, Reply, Request, UPLOAD_LIMITS,
    },
    hub::Hub,
    limits::{
        CLOSE_WAIT, Gate, HEIR_WAIT, MAX_ANSWERS, MAX_MALFORMED, MAX_SMALL_MESSAGE, PING_EVERY,
        QUIET, SEND_WAIT, SILENCE, Verdict,
    },
    wire::SNAPSHOT_VERSION,
};
use axum::{
    body::Bytes,
    extract::ws::{self, CloseFrame, Utf8Bytes, WebSocket, close_code},
};
use futures_util::{
    SinkExt, StreamExt,
    stream::{SplitSink, SplitStream},
};
use serde::Deserialize;
use std::{error::Error, io, iter::successors, sync::Arc, time::Instant};
use tokio::{
    runtime::Handle,
    select,
    sync::{OwnedSemaphorePermit, broadcast::error::RecvError, mpsc, watch},
    time::{MissedTickBehavior, interval, sleep, timeout},
};

type Sink = SplitSink<WebSocket, ws::Message>;
type Answers = mpsc::Sender<Utf8Bytes>;

/// Serves a client until the client or the server ends the connection.
pub(crate) async fn serve(socket: WebSocket, hub: Arc<Hub>, place: OwnedSemaphorePermit) {
    let seat = Seat::take(hub);
    let (mut sink, mut stream) = socket.split();
    let (answers, mut to_send) = mpsc::channel(MAX_ANSWERS);
    let end = select! {
        biased;
        () = is_closing(seat.hub.closing.clone()) => End::new(close_code::AWAY, "the program ends"),
        end = read(&mut stream, &seat, &answers) => end,
        end = write(&mut sink, &seat, &mut to_send) => end,
    };
    if end.is_our_choice() {
        seat.hub.board.counts.dropped.add(1);
    }
    drop(seat);
    say_good_bye(sink, stream, end).await;
    drop(place);
}

/// Returns when the server shall end.
pub(crate) async fn is_closing(mut closing: watch::Receiver<bool>) {
    // An error means that the server is gone already.
    let _ = closing.wait_for(|&is_closing| is_closing).await;
}

/// A client's place among the connected clients.
struct Seat {
    hub: Arc<Hub>,
    client: u64,
}

impl Seat {
    fn take(hub: Arc<Hub>) -> Self {
        hub.board.counts.connections.add(1);
        let client = hub.board.enter();
        hub.tell_clients();
        Self { hub, client }
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let has_controlled = self.hub.board.leave(self.client);
        self.hub.tell_clients();
        if has_controlled && let Ok(runtime) = Handle::try_current() {
            let hub = Arc::clone(&self.hub);
            runtime.spawn(async move {
                sleep(HEIR_WAIT).await;
                hub.board.inherit();
                hub.tell_clients();
            });
        }
    }
}

/// Why a connection ends.
enum End {
    /// The client closed the connection.
    Gone,
    /// The server closes the connection.
    Close { code: u16, reason: Utf8Bytes },
}

impl End {
    /// WebSocket allows 123 bytes for a reason.
    fn new(code: u16, reason: &str) -> Self {
        Self::Close {
            code,
            reason: cut(reason, 120).into(),
        }
    }

    fn is_our_choice(&self) -> bool {
        matches!(self, Self::Close { code, .. } if *code != close_code::AWAY)
    }
}

async fn say_good_bye(mut sink: Sink, mut stream: SplitStream<WebSocket>, end: End) {
    let good_bye = async {
        match end {
            End::Gone => {
                let _ = sink.close().await;
            }
            End::Close { code, reason } => {
                let frame = CloseFrame { code, reason };
                if sink.send(ws::Message::Close(Some(frame))).await.is_ok() {
                    // Discard what the client sent before it read the close frame.
                    while let Some(Ok(_)) = stream.next().await {}
                }
            }
        }
    };
    // If the client does not answer the close frame, drop the connection.
    let _ = timeout(CLOSE_WAIT, good_bye).await;
}

/// Reads from a client until it is gone, is silent for too long, or sends too much.
async fn read(stream: &mut SplitStream<WebSocket>, seat: &Seat, answers: &Answers) -> End {
    let mut gate = Gate::new(Instant::now());
    let mut n_malformed = 0;
    loop {
        let message = match timeout(SILENCE, stream.next()).await {
            Err(_) => return End::new(close_code::POLICY, "no sign of life"),
            Ok(None | Some(Ok(ws::Message::Close(_)))) => return End::Gone,
            Ok(Some(Err(error))) => return unreadable(&error),
            Ok(Some(Ok(message))) => message,
        };
        let n_bytes = match &message {
            ws::Message::Text(text) => text.len(),
            ws::Message::Binary(bytes) | ws::Message::Ping(bytes) | ws::Message::Pong(bytes) => {
                bytes.len()
            }
            ws::Message::Close(_) => 0,
        };
        let heard = match gate.ask(n_bytes, Instant::now()) {
            Verdict::TooMuch => return End::new(close_code::POLICY, TOO_MANY),
            Verdict::Refused { tell } => {
                seat.hub.board.counts.refused.add(1);
                if tell { warn(answers) } else { Ok(()) }
            }
            Verdict::Taken => match message {
                ws::Message::Text(text) => match understand(&text) {
                    Ok(envelope) => {
                        n_malformed = 0;
                        ask(seat, answers, envelope);
                        Ok(())
                    }
                    Err(reply) => {
                        n_malformed += 1;
                        seat.hub.board.counts.malformed.add(1);
                        send_answer(answers, reply)
                    }
                },
                ws::Message::Binary(_) => {
                    n_malformed += 1;
                    seat.hub.board.counts.malformed.add(1);
                    let error = "bytes are not understood here; requests are JSON in text messages";
                    send_answer(answers, refusal(None, error.into()))
                }
                _ => Ok(()),
            },
        };
        if heard.is_err() {
            return End::new(close_code::POLICY, "answers are not read");
        }
        if n_malformed >= MAX_MALFORMED {
            let reason = "20 messages in a row were not understood";
            return End::new(close_code::POLICY, reason);
        }
    }
}

const TOO_MANY: &str = "too many requests; at most 200 a second";

fn unreadable(error: &axum::Error) -> End {
    let words = error.to_string();
    let is_io = successors(error.source(), |&e| e.source()).any(<dyn Error>::is::<io::Error>);
    if is_io || words.contains("without closing handshake") {
        End::Gone
    } else if words.contains("too long") {
        End::new(close_code::SIZE, "a message is longer than 1 MiB")
    } else {
        End::new(close_code::PROTOCOL, &words)
    }
}

/// Parses a request, or makes the refusal.
pub(crate) fn understand(text: &str) -> Result<Envelope, Reply> {
    /// Only the number, so that the refusal of a malformed request can repeat it.
    #[derive(Deserialize)]
    struct Numbered {
        #[serde(default)]
        id: Option<u32>,
    }
    let envelope: Envelope = serde_json::from_str(text).map_err(|error| {
        let id = serde_json::from_str(text).map_or(None, |numbered: Numbered| numbered.id);
        let error = error.to_string();
        let error = format!(
            "not understood: {}; expected a request as {{\"id\": 1, \"type\": \"lift\"}}, see /api",
            cut(&error, 1000)
        );
        refusal(id, error)
    })?;
    let is_scene = matches!(
        envelope.request,
        Request::LoadText { .. } | Request::LoadTable { .. }
    );
    if text.len() > MAX_SMALL_MESSAGE && !is_scene {
        let error = format!(
            "a request of {} bytes; at most {MAX_SMALL_MESSAGE} but for load_text and load_table, which may have 1 MiB",
            text.len()
        );
        return Err(refusal(envelope.id, error));
    }
    Ok(envelope)
}

fn refusal(id: Option<u32>, error: String) -> Reply {
    Reply {
        id,
        error: Some(error),
    }
}

fn ask(seat: &Seat, answers: &Answers, Envelope { id, request }: Envelope) {
    let answers = answers.clone();
    let who = Controller::Page(seat.client);
    seat.hub.ask(who, request, move |outcome| {
        let error = outcome.err();
        if id.is_some() || error.is_some() {
            // Ignore errors: a client that is gone needs no answer, and the writer drops a client
            // that does not read.
            let _ = send_answer(&answers, Reply { id, error });
        }
    });
}

fn send_answer(answers: &Answers, reply: Reply) -> Result<(), ()> {
    answers
        .try_send(json(&Message::Reply(reply)))
        .map_err(|_| ())
}

fn warn(answers: &Answers) -> Result<(), ()> {
    let notice = Notice {
        level: NoticeLevel::Warning,
        what: NoticeKind::TooManyRequests,
    };
    answers
        .try_send(json(&Message::Notice(notice)))
        .map_err(|_| ())
}

/// Sends all news to a client until it no longer takes them.
async fn write(sink: &mut Sink, seat: &Seat, answers: &mut mpsc::Receiver<Utf8Bytes>) -> End {
    let board = &*seat.hub.board;
    let mut out = Outlet::new(sink, board);
    let mut notices = board.notices.subscribe();
    let mut state = board.state.subscribe();
    let mut picture = board.picture.subscribe();
    let mut engine = board.engine.subscribe();
    let hello = Message::Hello(Hello {
        palpa: env!("CARGO_PKG_VERSION").into(),
        snapshot_version: SNAPSHOT_VERSION,
        client: seat.client,
        run: seat.hub.run.clone(),
        upload_limits: UPLOAD_LIMITS,
    });
    if let Err(end) = out.text(json(&hello)).await {
        return end;
    }
    // Everything already on the board is news to a new client.
    state.mark_changed();
    picture.mark_changed();
    engine.mark_changed();
    let mut ping = interval(PING_EVERY);
    ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
    ping.reset();
    loop {
        // The picture comes last, because a newer one always follows.
        let sent = select! {
            biased;
            _ = ping.tick() => {
                // A page's script does not see pings. If nothing was sent for a while, send the
                // state as a sign of life.
                let is_silent = out.spoke_at.elapsed() > QUIET;
                let text = is_silent.then(|| state.borrow().clone()).flatten();
                match out.some(text).await {
                    Ok(()) => out.send(ws::Message::Ping(Bytes::new())).await,
                    end => end,
                }
            }
            Some(answer) = answers.recv() => out.text(answer).await,
            Ok(()) = state.changed() => {
                let text = state.borrow_and_update().clone();
                out.some(text).await
            }
            notice = notices.recv() => match notice {
                Ok(notice) => out.text(notice).await,
                Err(RecvError::Lagged(_) | RecvError::Closed) => Ok(()),
            },
            Ok(()) = engine.changed() => {
                let text = engine.borrow_and_update().as_ref().map(|(_, text)| text.clone());
                out.some(text).await
            }
            Ok(()) = picture.changed() => {
                let newest = picture.borrow_and_update().clone();
                out.picture(newest).await
            }
            else => Err(End::Gone),
        };
        if let Err(end) = sent {
            return end;
        }
    }
}

/// Sends messages and remembers which picture the client has.
struct Outlet<'a> {
    sink: &'a mut Sink,
    board: &'a Board,
    /// Serial number of the mesh that the client has.
    mesh: u64,
    /// Serial number of the last frame sent; at first, of the one before the first frame.
    frame: u64,
    /// Serial number of the map that the client has.
    map: u64,
    /// Time of the last text or binary message.
    spoke_at: Instant,
}

impl<'a> Outlet<'a> {
    fn new(sink: &'a mut Sink, board: &'a Board) -> Self {
        let before = board
            .picture
            .borrow()
            .frame
            .as_ref()
            .map_or(0, |f| f.serial - 1);
        Self {
            sink,
            board,
            mesh: 0,
            frame: before,
            map: 0,
            spoke_at: Instant::now(),
        }
    }

    async fn send(&mut self, message: ws::Message) -> Result<(), End> {
        let n_bytes = match &message {
            ws::Message::Text(text) => text.len(),
            ws::Message::Binary(bytes) => bytes.len(),
            _ => 0,
        };
        match timeout(SEND_WAIT, self.sink.send(message)).await {
            Err(_) => Err(End::new(close_code::POLICY, "messages are not read")),
            Ok(Err(_)) => Err(End::Gone),
            Ok(Ok(())) => {
                self.board.counts.bytes_sent.add(n_bytes as u64);
                if n_bytes > 0 {
                    self.spoke_at = Instant::now();
                }
                Ok(())
            }
        }
    }

    async fn text(&mut self, text: Utf8Bytes) -> Result<(), End> {
        self.send(ws::Message::Text(text)).await
    }

    async fn some(&mut self, text: Option<Utf8Bytes>) -> Result<(), End> {
        match text {
            Some(text) => self.text(text).await,
            None => Ok(()),
        }
    }

    /// Sends map and mesh if the client lacks them, then the frame if it belongs to that mesh.
    async fn picture(&mut self, Picture { mesh, frame, map }: Picture) -> Result<(), End> {
        if let Some(map) = map.filter(|map| map.serial != self.map) {
            self.map = map.serial;
            self.send(ws::Message::Binary(map.bytes)).await?;
        }
        let Some(mesh) = mesh else {
            return Ok(());
        };
        let counts = &self.board.counts;
        if mesh.serial != self.mesh {
            self.send(ws::Message::Binary(mesh.bytes)).await?;
            self.mesh = mesh.serial;
            counts.meshes_sent.add(1);
        }
        if let Some(frame) = frame
            && frame.mesh == mesh.mesh
            && frame.serial != self.frame
        {
            self.send(ws::Message::Binary(frame.bytes)).await?;
            counts.frames_sent.add(1);
            counts.frames_dropped.add(frame.serial - self.frame - 1);
            self.frame = frame.serial;
        }
        Ok(())
    }
}

/// The beginning of a text, at most `n_bytes` long.
fn cut(text: &str, n_bytes: usize) -> &str {
    &text[..text.floor_char_boundary(n_bytes)]
}
