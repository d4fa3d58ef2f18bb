//! `palpa view`: touch the body in a browser.

use std::net::{IpAddr, Ipv4Addr, UdpSocket};
use std::path::PathBuf;
use std::time::Duration;

use palpa_scene::Scene;
use palpa_scene::built_in::VIEWED;
use palpa_viewer::{Host as _, Server, ServerParams};
use serde::Serialize;

use super::Outcome;
use crate::cli::Context;
use crate::named_scene;
use palpa_session::{Session, SessionParams};

/// Touch a body in a browser: see it deform and read the force
///
/// Starts the engine (tissue, 1 kHz loop, a simulated haptic device) and a web server on this
/// computer, opens the page, and runs until Ctrl-C. Without a SCENE, shows a forearm; the page
/// offers more scenes. Recordings go to the output folder.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene file (TOML), or the name of a built-in scene; see `palpa scenes` [default: forearm]
    scene: Option<PathBuf>,
    /// Do not open a browser
    #[arg(long)]
    no_open: bool,
    /// Port to listen on; 0 for any free one [default: 7750, or any free one if that is in use]
    #[arg(long, value_name = "PORT")]
    port: Option<u16>,
    /// Address to listen on; any address other than 127.0.0.1 needs --token
    #[arg(long, default_value = "127.0.0.1", value_name = "IP", value_parser = address)]
    bind: IpAddr,
    /// Token that a page needs to connect: 8 characters or more
    #[arg(long, value_name = "TEXT", env = "PALPA_TOKEN", hide_env_values = true)]
    token: Option<String>,
    /// Seed for the places of the hidden lumps in "find the lump". The same seed gives the same
    /// places, round by round
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Let the page trigger faults of the engine, for drills and tests
    #[arg(long)]
    allow_faults: bool,
}

/// Parses an address as a person writes it.
fn address(text: &str) -> Result<IpAddr, String> {
    if text == "localhost" {
        return Ok(Ipv4Addr::LOCALHOST.into());
    }
    (text.parse()).map_err(|_| {
        "expected an IP address as 127.0.0.1, 0.0.0.0 (all of this machine's) or ::1".to_owned()
    })
}

/// The address of the page, for machines.
#[derive(Debug, Serialize)]
struct Started {
    url: String,
    /// Address for other machines, if the server listens on all addresses of this machine.
    url_elsewhere: Option<String>,
    port: u16,
}

/// Default port of the page.
const PORT: u16 = 7750;

/// Runs the command.
///
/// # Errors
/// If the scene cannot be read, or the server cannot listen at the requested address.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let (scene, gallery_key) = scene_of(args)?;
    let out = context.out_dir()?;
    let (session, remote) = Session::new(SessionParams {
        scene,
        gallery_key,
        out: out.path().to_owned(),
        seed: args.seed,
        allows_faults: args.allow_faults,
    });
    let params = |port| ServerParams {
        bind: args.bind,
        port,
        token: args.token.clone(),
    };
    let server = match args.port {
        Some(port) => Server::start(&params(port), remote.clone())?,
        // Without --port, another viewer on the default port must not prevent the start.
        None => match Server::start(&params(PORT), remote.clone()) {
            Err(palpa_viewer::ServerError::PortInUse { .. }) => {
                Server::start(&params(0), remote.clone())?
            }
            started => started?,
        },
    };
    let handle = session.start(server.publisher())?;
    let url = server.url();
    context.say(format!("the viewer is at {url}  (Ctrl-C ends it)"))?;
    let elsewhere = args.bind.is_unspecified().then(|| outward(args.bind));
    let url_elsewhere = elsewhere.flatten().map(|ip| server.url_at(ip));
    if let Some(url) = &url_elsewhere {
        context.say(format!("from other machines: {url}"))?;
    }
    context.json(&Started {
        url: url.clone(),
        url_elsewhere,
        port: server.address().port(),
    })?;
    if !args.no_open
        && let Err(error) = open::that_detached(&url)
    {
        context.note(format!(
            "no browser could be opened ({error}); open {url} in one"
        ));
    }
    context.begin_recording();
    let mut told = None;
    while !context.is_interrupted() {
        std::thread::sleep(Duration::from_millis(50));
        let problem = remote.problem();
        if problem != told {
            if let Some(problem) = &problem {
                context.note(format!("there is no body: {problem}"));
            }
            told = problem;
        }
    }
    drop(handle);
    drop(server);
    Ok(Outcome::Done)
}

/// The address at which other machines can reach this one.
fn outward(bind: IpAddr) -> Option<IpAddr> {
    // Nothing is sent; the socket only reports the address from which it would send. The targets
    // are addresses reserved for examples.
    let example = match bind {
        IpAddr::V4(_) => "192.0.2.1:9",
        IpAddr::V6(_) => "[2001:db8::1]:9",
    };
    let socket = UdpSocket::bind((bind, 0)).ok()?;
    socket.connect(example).ok()?;
    let ip = socket.local_addr().ok()?.ip();
    (!ip.is_loopback()).then_some(ip)
}

/// The scene, and its key if it is of the gallery.
fn scene_of(args: &Args) -> anyhow::Result<(Scene, Option<String>)> {
    let named = named_scene::load_or(args.scene.as_deref(), VIEWED)?;
    let of_gallery = named.built_in.filter(|built_in| built_in.is_in_gallery);
    Ok((
        named.scene,
        of_gallery.map(|built_in| built_in.key.to_owned()),
    ))
}
