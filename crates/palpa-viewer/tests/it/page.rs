//! A page at a real WebSocket.

use futures_util::{SinkExt, StreamExt};
use palpa_viewer::{
    Server,
    control::{Envelope, Hello, Message, Reply, Request, State},
};
use std::{net::SocketAddr, time::Duration};
use tokio::{net::TcpStream, time::timeout};
use tokio_tungstenite::{
    MaybeTlsStream, WebSocketStream, connect_async,
    tungstenite::{self, protocol::frame::coding::CloseCode},
};

/// What a page is told.
#[derive(Debug)]
pub(crate) enum Told {
    Message(Message),
    /// A mesh's number.
    Mesh(u32),
    /// The number of its mesh, and its own.
    Frame(u32, u32),
    /// Good-bye.
    Closed(CloseCode, String),
    /// The end without good-bye.
    Lost,
}

pub(crate) struct Page {
    pub(crate) socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
    pub(crate) client: u64,
    next_id: u32,
}

pub(crate) fn socket_url(address: SocketAddr) -> String {
    format!("ws://{address}/ws")
}

impl Page {
    /// A page that has heard its name.
    pub(crate) async fn open(server: &Server) -> Self {
        Self::open_url(&socket_url(server.address())).await.unwrap()
    }

    pub(crate) async fn open_url(url: &str) -> Result<Self, tungstenite::Error> {
        let (socket, _) = connect_async(url).await?;
        let mut page = Self {
            socket,
            client: 0,
            next_id: 1,
        };
        let Told::Message(Message::Hello(Hello { client, .. })) = page.hear().await else {
            panic!("expected hello first");
        };
        page.client = client;
        Ok(page)
    }

    /// What comes next.
    pub(crate) async fn hear(&mut self) -> Told {
        loop {
            let message = timeout(Duration::from_secs(20), self.socket.next())
                .await
                .expect("nothing is heard");
            return match message {
                Some(Ok(tungstenite::Message::Text(text))) => {
                    Told::Message(serde_json::from_str(&text).unwrap())
                }
                Some(Ok(tungstenite::Message::Binary(bytes))) => {
                    let word =
                        |i: usize| u32::from_le_bytes(bytes[4 * i..4 * i + 4].try_into().unwrap());
                    match word(1) {
                        1 => Told::Mesh(word(2)),
                        2 => Told::Frame(word(2), word(3)),
                        kind => panic!("snapshot of kind {kind}"),
                    }
                }
                Some(Ok(tungstenite::Message::Close(Some(frame)))) => {
                    Told::Closed(frame.code, frame.reason.to_string())
                }
                Some(Ok(_)) => continue,
                Some(Err(_)) | None => Told::Lost,
            };
        }
    }

    /// The next state, whatever comes before it.
    pub(crate) async fn state(&mut self) -> State {
        loop {
            match self.hear().await {
                Told::Message(Message::State(state)) => return *state,
                Told::Closed(code, reason) => panic!("closed: {code} {reason}"),
                Told::Lost => panic!("lost"),
                _ => {}
            }
        }
    }

    /// States until one is as expected.
    pub(crate) async fn state_where(&mut self, is_it: impl Fn(&State) -> bool) -> State {
        loop {
            let state = self.state().await;
            if is_it(&state) {
                return state;
            }
        }
    }

    /// The next reply, whatever comes before it.
    pub(crate) async fn reply(&mut self) -> Reply {
        loop {
            match self.hear().await {
                Told::Message(Message::Reply(reply)) => return reply,
                Told::Closed(code, reason) => panic!("closed: {code} {reason}"),
                Told::Lost => panic!("lost"),
                _ => {}
            }
        }
    }

    /// How it is let go, whatever comes before that.
    pub(crate) async fn end(&mut self) -> Told {
        loop {
            let told = self.hear().await;
            if matches!(told, Told::Closed(..) | Told::Lost) {
                return told;
            }
        }
    }

    pub(crate) async fn say(&mut self, text: impl Into<String>) {
        let message = tungstenite::Message::text(text.into());
        self.socket.send(message).await.unwrap();
    }

    /// Asks, and hears why it is refused, if it is.
    pub(crate) async fn ask(&mut self, request: Request) -> Option<String> {
        let id = self.next_id;
        self.next_id += 1;
        let envelope = Envelope {
            id: Some(id),
            request,
        };
        self.say(serde_json::to_string(&envelope).unwrap()).await;
        let reply = self.reply().await;
        assert_eq!(reply.id, Some(id));
        reply.error
    }
}
