//! A session of ten seconds with the tests' bed of springs and scripted hand: what the loop, the
//! hand-over and the recorder cost on this machine, and a log to look at.
//!
//! `cargo run --release -p palpa-rt --example session -- session.mcap`
#![expect(
    clippy::disallowed_macros,
    reason = "prints its result; it is no part of the 1 kHz path"
)]
#![expect(dead_code, reason = "the tests use more of their devices")]

#[path = "../tests/it/devices.rs"]
mod devices;
#[path = "../tests/it/toy.rs"]
mod toy;

use palpa_rt::{
    Clock, Engine, EngineParams, Log, Quantiles, RealClock, RecorderParams, ReplayParams, replay,
};
use std::{error::Error, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let path = PathBuf::from(
        std::env::args()
            .nth(1)
            .unwrap_or_else(|| "session.mcap".to_owned()),
    );
    let recorder = RecorderParams {
        path: Some(path.clone()),
        ..RecorderParams::default()
    };
    let device = Box::new(devices::Scripted::new(&devices::Hand::default()));
    let engine = Engine::start(
        toy::Bed::new(),
        vec![device],
        &EngineParams::default(),
        &recorder,
    )?;
    RealClock::new(0.0).wait_until(10.0);
    let report = engine.stop();
    for granted in &report.granted {
        println!("{granted}");
    }
    println!("memory locked: {:?}", report.memory_locked);
    println!(
        "{} ticks, {} left out; {:.0} steps/s",
        report.ticks, report.skipped, report.step_rate
    );
    print("tick, CPU", &report.tick_cpu);
    print("tick, lateness", &report.lateness);
    print("step, CPU", &report.step_cpu);
    print("job, CPU", &report.jobs);
    println!("{:?}", report.forces);
    for event in report.warnings() {
        println!("{:9.3} s  {}", event.time, event.what);
    }
    let again = replay(
        &Log::open(&path)?,
        toy::Bed::new(),
        &ReplayParams::default(),
    );
    println!(
        "replay: {:?}, {} ticks, {} steps, {} jobs",
        again.verdict, again.ticks, again.steps, again.jobs
    );
    Ok(())
}

fn print(what: &str, q: &Quantiles) {
    let us = |s: f64| s * 1e6;
    println!(
        "{what:16} p50 {:7.1}  p99 {:7.1}  p99.9 {:7.1}  max {:7.1} us",
        us(q.p50),
        us(q.p99),
        us(q.p999),
        us(q.max)
    );
}
