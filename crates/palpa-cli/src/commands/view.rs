//! `palpa view`: the body under one's own hand, in a browser.

use std::net::{IpAddr, Ipv4Addr, UdpSocket};
use std::path::PathBuf;
use std::time::Duration;

use palpa_scene::Scene;
use palpa_viewer::{Host as _, Server, ServerParams};
use serde::Serialize;

use super::Outcome;
use crate::cli::Context;
use palpa_session::{Session, SessionParams, gallery};

/// Touch a body in a browser: see it deform, read and feel the force
///
/// Starts the engine (tissue, 1 kHz loop, a simulated haptic device) and a web server on this machine, opens the page, and runs
/// until Ctrl-C. Without a SCENE, a forearm is shown; the page has more. Recordings go to the output folder.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene file (TOML), or the key of a scene of the gallery: forearm, `forearm_lump`, limb, block, `patch_bars`, `patch_tissue`
    scene: Option<PathBuf>,
    /// Do not open a browser
    #[arg(long)]
    no_open: bool,
    /// Port to listen at; 0 takes any that is free [default: 7750, or any if that is in use]
    #[arg(long, value_name = "PORT")]
    port: Option<u16>,
    /// Address to listen at; any but this machine's own (127.0.0.1) needs --token
    #[arg(long, default_value = "127.0.0.1", value_name = "IP", value_parser = address)]
    bind: IpAddr,
    /// What a page must know to come in: 8 characters or more
    #[arg(long, value_name = "TEXT", env = "PALPA_TOKEN", hide_env_values = true)]
    token: Option<String>,
    /// Seed of the lumps that "find the lump" hides, for the same places again; the rounds after the first count on
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Let the page ask for faults of the engine, for drills and tests
    #[arg(long)]
    allow_faults: bool,
}

/// An address as a person writes it.
fn address(text: &str) -> Result<IpAddr, String> {
    if text == "localhost" {
        return Ok(Ipv4Addr::LOCALHOST.into());
    }
    (text.parse()).map_err(|_| {
        "expected an IP address as 127.0.0.1, 0.0.0.0 (all of this machine's) or ::1".to_owned()
    })
}

/// Where the page is, for machines.
#[derive(Debug, Serialize)]
struct Started {
    url: String,
    /// The same for other machines, if the server listens at all of this one's addresses.
    url_elsewhere: Option<String>,
    port: u16,
}

/// Where the page is when nothing else is said.
const PORT: u16 = 7750;

/// Runs the command.
///
/// # Errors
/// On a scene that cannot be read, and when the server cannot listen where it should.
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
        // Who did not ask for a port is not to be held up by another viewer.
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

/// The address by which this machine goes out, and others reach it.
fn outward(bind: IpAddr) -> Option<IpAddr> {
    // Nothing is sent: a socket is asked which address it would send from. These are addresses for examples.
    let example = match bind {
        IpAddr::V4(_) => "192.0.2.1:9",
        IpAddr::V6(_) => "[2001:db8::1]:9",
    };
    let socket = UdpSocket::bind((bind, 0)).ok()?;
    socket.connect(example).ok()?;
    let ip = socket.local_addr().ok()?.ip();
    (!ip.is_loopback()).then_some(ip)
}

fn scene_of(args: &Args) -> anyhow::Result<(Scene, Option<String>)> {
    let Some(path) = &args.scene else {
        return Ok((
            gallery::scene(gallery::FIRST)?,
            Some(gallery::FIRST.to_owned()),
        ));
    };
    let key = path.to_string_lossy();
    let is_key = !path.exists() && gallery::entries().iter().any(|entry| entry.key == key);
    let is_word = path.extension().is_none() && path.components().count() == 1;
    if is_key || !path.exists() && is_word {
        return Ok((gallery::scene(&key)?, Some(key.into_owned())));
    }
    Ok((Scene::load(path)?, None))
}
