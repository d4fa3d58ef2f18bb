//! Five strokes of a hand with a Falcon over the forearm of the gallery: the palpation map finds the lump, and
//! nothing where there is none.

use nalgebra::Point3;
use palpa::live::{LiveScene, RehearsalParams, open_device, rehearse, servo_params};
use palpa::map::{PalpationMap, Touch};
use palpa_device::LiveTarget;
use palpa_mesh::SurfaceIndex;
use palpa_rt::StepStatus;
use palpa_scene::{BuiltIn, Scene};

use crate::strokes::{STEP_TIME, Skin, strokes};

/// A touch of the map every so many ticks, as a session makes them.
const EVERY: usize = 16;
/// Speed of the strokes, m/s.
const SPEED: f64 = 0.025;

fn map_of(scene: &Scene) -> PalpationMap {
    let live = LiveScene::build(scene).unwrap();
    let skin = Skin::of(&live);
    let frame = live.scene_from_device;
    let tips = skin.tips(&live, &strokes(SPEED));
    let target = LiveTarget::new(tips[0]);
    let mut device = open_device(&scene.device, target.clone()).unwrap();
    let params = RehearsalParams {
        step_time: STEP_TIME,
        duration: tips.len() as f64 * STEP_TIME,
        servo: servo_params(&*device),
        ..RehearsalParams::default()
    };
    let mut tissue = live.tissue_at(tips[0]).unwrap();
    let mut converged = Vec::new();
    let ticks = rehearse(&mut tissue, &mut *device, &params, |_, _, done| {
        target.set(tips[converged.len().min(tips.len() - 1)]);
        converged.push(done.status == StepStatus::Converged);
    });
    let per_step = (STEP_TIME / params.servo.period).round() as usize;
    let mut map = PalpationMap::default();
    for (k, tick) in ticks.iter().enumerate().step_by(EVERY) {
        let tool = &tick.report.tools[0];
        let tip = (frame * Point3::from(tick.position + tool.stretch)).coords;
        let (point, normal) = skin.nearest(tip);
        let depth = normal.dot(&(point - tip));
        let shape = scene.tool.contact().unwrap().shape;
        let touch = Touch {
            point,
            normal,
            depth,
            force: normal.dot(&(frame.rotation * tool.tissue_force)),
            radius: shape.contact_radius_at(depth.max(0.0)),
            is_sound: tick.report.faults.is_empty()
                && tick.report.gain >= 1.0
                && converged[(k / per_step).min(converged.len() - 1)],
        };
        map.feel(Some(&touch), EVERY as f64 * params.servo.period);
    }
    while !map.update(usize::MAX) {}
    map
}

#[test]
fn five_strokes_find_the_lump_and_nothing_without_it() {
    let scene = BuiltIn::find("forearm_lump").unwrap().scene().unwrap();
    let live = LiveScene::build(&scene).unwrap();
    let lump = live.prepared.lumps()[0].pose().translation.vector;
    let above = {
        let surface = &live.prepared.grown.growth.body.skin;
        SurfaceIndex::build(surface).closest(lump).unwrap().point
    };
    let mut without = scene.clone();
    without.lumps.clear();
    let (with, without) = (map_of(&scene), map_of(&without));
    let brightest = [("lump", &with), ("no lump", &without)].map(|(name, map)| {
        let shares = map.against_surroundings();
        let best = (map.spots().iter())
            .filter_map(|spot| {
                Some((
                    map.value_at(&spot.point, &spot.normal, shares)?.0,
                    spot.point,
                ))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap();
        println!(
            "{name}: {} spots, stiffness {:.3} to {:.3} N/mm, brightest {:+.1} %, {:.1} mm from the place above the lump",
            map.spots().len(),
            map.stiffness()
                .iter()
                .copied()
                .fold(f64::INFINITY, f64::min)
                * 1e-3,
            map.stiffness().iter().copied().fold(0.0, f64::max) * 1e-3,
            100.0 * best.0,
            (best.1 - above).norm() * 1e3,
        );
        best.1
    });
    assert!(with.spots().len() > 80);
    let found = with.finding().expect("the lump stands out");
    for place in [found.point, brightest[0]] {
        assert!((place - above).norm() < 5e-3, "{found:?}, {place:?}");
    }
    assert_eq!(without.finding(), None);
}
