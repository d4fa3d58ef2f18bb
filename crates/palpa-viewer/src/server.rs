//! The server. It runs on a thread of its own and ends when it is dropped.

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
/// Minimum length of a token, in characters. Shorter ones can be guessed.
const MIN_TOKEN: usize = 8;
/// Largest number of threads that make files.
const FILE_THREADS: usize = 2;
/// Connections that may wait to be accepted.
const BACKLOG: u32 = 128;
/// Time that answers under way may still take when the server ends.
const LAST_ANSWERS: Duration = Duration::from_secs(1);

/// The server's address and access rules.
#[derive(Clone, PartialEq, Eq)]
pub struct ServerParams {
    /// The address to listen on. Any address except loopback needs a token.
    pub bind: IpAddr,
    /// The port; 0 for any free port.
    pub port: u16,
    /// The token that every client must present.
    pub token: Option<String>,
}

/// Why the server cannot start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServerError {
    /// Without a token, everyone in the network could connect.
    #[error(
        "--bind {bind} lets everyone in the network see and control the session; give --token, or bind to 127.0.0.1"
    )]
    NoToken {
        /// The address.
        bind: IpAddr,
    },
    /// The token is short enough to be guessed.
    #[error(
        "the token has {found} bytes; give one of {MIN_TOKEN} or more, such as the output of `openssl rand -hex 16`"
    )]
    ShortToken {
        /// Its length.
        found: usize,
    },
    /// Another program listens on this port.
    #[error(
        "port {port} of {bind} is in use, maybe by another `palpa view`; end it, or give --port 0 for any free one"
    )]
    PortInUse {
        /// The address.
        bind: IpAddr,
        /// The port.
        port: u16,
    },
    /// The system does not allow listening on this address.
    #[error("cannot listen at {address}: {source}; give another --port or --bind")]
    Listen {
        /// The address.
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

/// A running server. When it is dropped, it closes all connections and ends.
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
    /// [`ServerError`]: the address is not available, or needs a token.
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
                // Dropping the runtime would block, which is not allowed inside a caller's own
                // runtime.
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

    /// The address that the server listens on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The handle through which the session sends to pages.
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

    /// The same URL, with the address `ip` under which another machine reaches this one.
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
            // A panic has been reported where it happened.
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

/// Hides the token.
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
    // As in the standard library: reuse a port whose last connections are still closing. On other
    // systems the option has another meaning.
    if cfg!(unix) {
        socket.set_reuseaddr(true)?;
    }
    // Accepted connections inherit the size. Data that waits in a large system buffer is old when
    // it arrives.
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.bind(address)?;
    let listener = socket.listen(BACKLOG)?;
    let address = listener.local_addr()?;
    Ok((listener, address))
}

fn run(runtime: Runtime, listener: TcpListener, hub: &Arc<Hub>) {
    runtime.block_on(serve(listener, hub));
    // Do not wait longer than this for files that are being made.
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
    // Wait until each connection is closed.
    let all = hub.places.acquire_many(MAX_CLIENTS as u32);
    let _ = timeout(2 * CLOSE_WAIT, all).await;
}
