//! A fine mesh that moves with the tool over a forearm with a lump, against a mesh that is fine
//! along the whole way, in simulated time.

use std::path::Path;

use palpa::live::{LiveScene, RehearsalParams, RehearsalTick, rehearse};
use palpa_device::{DeviceModel, Path as Way, Scripted, Vec3};
use palpa_scene::Scene;

const FOREARM: &str = include_str!("../../../palpa-scene/scenes/forearm_loop.toml");
/// The way: from above the skin down, along the limb over the lump, then still. m, m/s
const ABOVE: f64 = 5e-3;
const DEPTH: f64 = 4e-3;
const HALF: f64 = 30e-3;
const SPEED: f64 = 0.05;
/// The law lets its whole force through half a second after the start. s
const START: f64 = 0.8;

/// The ticks of the stroke, and how many meshes there were.
fn stroke(moves: bool) -> (Vec<RehearsalTick>, u64) {
    let mut scene: toml::Table = FOREARM.parse().unwrap();
    scene["motion"]["length"] = "60 mm".into();
    let mesh = toml::Table::from_iter([("moves".to_owned(), moves.into())]);
    scene.insert("mesh".to_owned(), mesh.into());
    let scene = Scene::parse(&scene.to_string(), Path::new("")).unwrap();
    let live = LiveScene::build(&scene).unwrap();
    let [from, to] = [-HALF, HALF].map(|x| Vec3::x() * x);
    let down = -Vec3::z() * (ABOVE + DEPTH);
    let way = Way::from(from).hold(START).to(from + down, SPEED).hold(0.2);
    let begins = (way.duration() / 1e-3).ceil() as usize;
    let way = way.to(to + down, SPEED).hold(0.3);
    let params = RehearsalParams {
        duration: way.duration(),
        ..RehearsalParams::default()
    };
    let mut tissue = live.tissue().unwrap();
    let mut device = Scripted::new(way, DeviceModel::IDEAL.spec);
    let ticks = rehearse(&mut tissue, &mut device, &params, |_, _, _| {}).split_off(begins);
    let [n_meshes, n_refused] = tissue.n_meshes();
    assert_eq!(n_refused, 0);
    (ticks, n_meshes)
}

#[test]
fn a_mesh_that_moves_feels_as_one_that_is_fine_everywhere() {
    let (along, n) = stroke(false);
    assert_eq!(n, 1);
    let (moving, n_meshes) = stroke(true);
    assert!(n_meshes > 3, "{n_meshes} meshes");
    assert_eq!(moving.len(), along.len());
    assert!(moving.len() > 1000, "{} ticks", moving.len());
    let pairs = moving.iter().zip(&along);
    let errors = pairs.map(|(a, b)| ((a.force - b.force).norm(), b.force.norm()));
    let (mut worst, mut at) = (0.0_f64, 0.0);
    for (k, (error, force)) in errors.enumerate() {
        if error > worst {
            (worst, at) = (error, moving[k].position.x * 1e3);
        }
        assert!(
            error < (0.05 * force).max(0.02),
            "{error} of {force} N at {} mm",
            moving[k].position.x * 1e3
        );
    }
    let change = |ticks: &[RehearsalTick]| {
        let steps = ticks.windows(2).map(|w| (w[1].force - w[0].force).norm());
        steps.fold(0.0, f64::max)
    };
    println!(
        "{n_meshes} meshes; worst {worst:.4} N at {at:.1} mm; force changes by at most {:.4} N a tick, {:.4} on one mesh",
        change(&moving),
        change(&along)
    );
    assert!(change(&moving) < 0.02, "{}", change(&moving));
}
