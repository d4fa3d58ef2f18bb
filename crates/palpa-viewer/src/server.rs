//! The server: a thread of its own, which ends when the server is dropped.

use crate::{
    board::{Board, Publisher},
    client::is_closing,
    connections::Connections,
    guard::Guard,
    host::Host,
    hub::Hub,
    limits::{CLOSE_WAIT, MAX_CLIENTS, SEND_BUFFER},
    routes,
};
use std::{
    fmt::{self, Write as _},
    io::{self, ErrorKind},
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr},
    sync::Arc,
    thread::{self, JoinHandle},
    time::Duration,
};
use tokio::{
    net::{TcpListener, TcpSocket},
    runtime::{Builder, Runtime},
    sync::watch,
    time::timeout,
};

const THREAD: &str = "palpa-web";
/// Shorter tokens can be guessed.
const MIN_TOKEN: usize = 8;
/// Threads that make files, at most.
const FILE_THREADS: usize = 2;
/// Connections that wait to be taken.
const BACKLOG: u32 = 128;
/// How long an answer that is under way may take when the server ends.
const LAST_ANSWERS: Duration = Duration::from_secs(1);

/// Where the server is, and who may come.
#[derive(Clone, PartialEq, Eq)]
pub struct ServerParams {
    /// The address to listen at; any but loopback needs a token.
    pub bind: IpAddr,
    /// The port; 0 is any that is free.
    pub port: u16,
    /// What who comes must know.
    pub token: Option<String>,
}

/// Why the server cannot start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServerError {
    /// Anyone could come.
    #[error(
        "--bind {bind} lets everyone in the network see and control the session; give --token, or bind to 127.0.0.1"
    )]
    NoToken {
        /// The address.
        bind: IpAddr,
    },
    /// The token can be guessed.
    #[error("a token of {found} bytes; expected {MIN_TOKEN} or more, as of `openssl rand -hex 16`")]
    ShortToken {
        /// Its length.
        found: usize,
    },
    /// Another program listens there.
    #[error(
        "port {port} of {bind} is in use, maybe by another `palpa view`; end it, or give --port 0 for any free one"
    )]
    PortInUse {
        /// The address.
        bind: IpAddr,
        /// The port.
        port: u16,
    },
    /// The system does not let us.
    #[error("cannot listen at {address}: {source}; give another --port or --bind")]
    Listen {
        /// Where.
        address: SocketAddr,
        /// The system's reason.
        source: io::Error,
    },
    /// No thread could be started.
    #[error("the server's thread cannot be started: {source}")]
    Thread {
        /// The system's reason.
        source: io::Error,
    },
}

/// A server that runs. Dropped, it lets its clients go and ends.
pub struct Server {
    address: SocketAddr,
    token: Option<String>,
    publisher: Publisher,
    closing: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Starts a server on a thread of its own.
    ///
    /// # Errors
    /// [`ServerError`]: an address that cannot be had, or one that must not without a token.
    pub fn start(params: &ServerParams, host: Arc<dyn Host>) -> Result<Self, ServerError> {
        let guard = params.guard()?;
        let at_thread = |source| ServerError::Thread { source };
        let runtime = Builder::new_current_thread()
            .enable_all()
            .thread_name("palpa-web-file")
            .max_blocking_threads(FILE_THREADS)
            .build()
            .map_err(at_thread)?;
        let address = SocketAddr::new(params.bind, params.port);
        let listening = {
            let _within = runtime.enter();
            listen(address)
        };
        let (listener, address) = match listening {
            Ok(listening) => listening,
            Err(source) => {
                // Dropped, it would wait, which one who calls from another runtime must not.
                runtime.shutdown_background();
                return Err(params.refusal(source));
            }
        };
        let board = Arc::new(Board::new());
        let (closing, is_closing) = watch::channel(false);
        let hub = Arc::new(Hub::new(Arc::clone(&board), host, guard, is_closing));
        let thread = thread::Builder::new()
            .name(THREAD.into())
            .spawn(move || run(runtime, listener, &hub))
            .map_err(at_thread)?;
        Ok(Self {
            address,
            token: params.token.clone(),
            publisher: Publisher::new(board),
            closing,
            thread: Some(thread),
        })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// What shows things to pages.
    pub fn publisher(&self) -> Publisher {
        self.publisher.clone()
    }

    /// Address to open in a browser, with the token if there is one.
    pub fn url(&self) -> String {
        self.url_at(match self.address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
            ip => ip,
        })
    }

    /// The same for who reaches this machine at that address.
    pub fn url_at(&self, ip: IpAddr) -> String {
        let mut url = format!("http://{}/", SocketAddr::new(ip, self.address.port()));
        if let Some(token) = &self.token {
            url.push_str("?token=");
            for byte in token.bytes() {
                if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
                    url.push(byte.into());
                } else {
                    let _ = write!(url, "%{byte:02X}");
                }
            }
        }
        url
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.closing.send_replace(true);
        if let Some(thread) = self.thread.take() {
            // A panic was reported where it happened.
            let _ = thread.join();
        }
    }
}

impl fmt::Debug for Server {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Server")
            .field("address", &self.address)
            .field("publisher", &self.publisher)
            .finish_non_exhaustive()
    }
}

impl ServerParams {
    fn guard(&self) -> Result<Guard, ServerError> {
        let is_loopback = self.bind.is_loopback();
        match &self.token {
            Some(token) if token.len() < MIN_TOKEN => {
                Err(ServerError::ShortToken { found: token.len() })
            }
            None if !is_loopback => Err(ServerError::NoToken { bind: self.bind }),
            token => Ok(Guard {
                is_loopback,
                token: token.clone(),
            }),
        }
    }

    fn refusal(&self, source: io::Error) -> ServerError {
        let &Self { bind, port, .. } = self;
        match source.kind() {
            ErrorKind::AddrInUse => ServerError::PortInUse { bind, port },
            _ => ServerError::Listen {
                address: SocketAddr::new(bind, port),
                source,
            },
        }
    }
}

/// The token is nobody's business.
impl fmt::Debug for ServerParams {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ServerParams")
            .field("bind", &self.bind)
            .field("port", &self.port)
            .field("token", &self.token.as_ref().map(|_| "…"))
            .finish()
    }
}

fn listen(address: SocketAddr) -> io::Result<(TcpListener, SocketAddr)> {
    let socket = match address {
        SocketAddr::V4(_) => TcpSocket::new_v4(),
        SocketAddr::V6(_) => TcpSocket::new_v6(),
    }?;
    // As std does: a port whose last connections still fade can be had again. Elsewhere the option means another thing.
    if cfg!(unix) {
        socket.set_reuseaddr(true)?;
    }
    // Connections inherit it. What waits in the system's buffers is old when it arrives.
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.bind(address)?;
    let listener = socket.listen(BACKLOG)?;
    let address = listener.local_addr()?;
    Ok((listener, address))
}

fn run(runtime: Runtime, listener: TcpListener, hub: &Arc<Hub>) {
    runtime.block_on(serve(listener, hub));
    // Files that are being made are not waited for longer than this.
    runtime.shutdown_timeout(LAST_ANSWERS);
    hub.tell_clients();
}

async fn serve(listener: TcpListener, hub: &Arc<Hub>) {
    let listener = Connections::new(listener);
    let closing = hub.closing.clone();
    let serving = axum::serve(listener, routes::router(hub))
        .with_graceful_shutdown(is_closing(closing.clone()));
    let mut serving = Box::pin(serving.into_future());
    tokio::select! {
        _ = &mut serving => {}
        () = is_closing(closing) => {
            // A download may be under way.
            let _ = timeout(LAST_ANSWERS, serving).await;
        }
    }
    // Each client says good-bye.
    let all = hub.places.acquire_many(MAX_CLIENTS as u32);
    let _ = timeout(2 * CLOSE_WAIT, all).await;
}
