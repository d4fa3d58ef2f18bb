//! A hand that strokes over the skin of a scene: five strokes along x, 6 mm apart and 50 mm long.

use nalgebra::Point3;
use palpa::live::LiveScene;
use palpa_device::Vec3;
use palpa_mesh::{Surface, SurfaceIndex};

/// Duration of a step of the tissue, s.
pub(crate) const STEP_TIME: f64 = 4e-3;
const DEPTH: f64 = 6e-3;
const ABOVE: f64 = 4e-3;
const HALF: f64 = 25e-3;
/// Between two strokes, m.
const APART: f64 = 6e-3;
/// Speeds, m/s: down and up, and in the air.
const DOWN: f64 = 0.04;
const AIR: f64 = 0.1;

/// Five strokes at a speed, m/s: places (along, across, depth), m, one for each step.
pub(crate) fn strokes(speed: f64) -> Vec<[f64; 3]> {
    let mut way = vec![[-HALF, -2.0 * APART, -ABOVE]; 200];
    let go = |to: [f64; 3], speed: f64, way: &mut Vec<[f64; 3]>| {
        let from = *way.last().unwrap();
        let length = (0..3)
            .map(|c| (to[c] - from[c]).powi(2))
            .sum::<f64>()
            .sqrt();
        let n = (length / (speed * STEP_TIME)).ceil().max(1.0) as usize;
        way.extend((1..=n).map(|k| {
            let share = k as f64 / n as f64;
            [0, 1, 2].map(|c| from[c] + share * (to[c] - from[c]))
        }));
    };
    for k in -2..=2 {
        let across = f64::from(k) * APART;
        let (from, to) = if k % 2 == 0 {
            (-HALF, HALF)
        } else {
            (HALF, -HALF)
        };
        go([from, across, -ABOVE], AIR, &mut way);
        go([from, across, DEPTH], DOWN, &mut way);
        go([to, across, DEPTH], speed, &mut way);
        go([to, across, -ABOVE], DOWN, &mut way);
    }
    way
}

/// The skin of a scene, to find places on it.
pub(crate) struct Skin {
    surface: Surface,
    index: SurfaceIndex,
    normals: Vec<Vec3>,
}

impl Skin {
    pub(crate) fn of(live: &LiveScene) -> Self {
        let surface = live.prepared.grown.growth.body.skin.clone();
        Self {
            index: SurfaceIndex::build(&surface),
            normals: surface.vertex_normals(),
            surface,
        }
    }

    /// The positions of a hand on its way, m, in the device's frame.
    pub(crate) fn tips(&self, live: &LiveScene, way: &[[f64; 3]]) -> Vec<Vec3> {
        let frame = live.scene_from_device;
        let (home, up) = self.nearest((frame * Point3::origin()).coords);
        let along = Vec3::x();
        let across = up.cross(&along).normalize();
        way.iter()
            .map(|[x, y, depth]| {
                let (point, normal) = self.nearest(home + along * *x + across * *y + up * 5e-3);
                (frame.inverse() * Point3::from(point - normal * *depth)).coords
            })
            .collect()
    }

    /// The nearest point of the skin, and its normal.
    pub(crate) fn nearest(&self, point: Vec3) -> (Vec3, Vec3) {
        let closest = self.index.closest(point).unwrap();
        let corners = self.surface.triangles[closest.triangle as usize];
        let normal: Vec3 = (corners.iter().zip(closest.weights))
            .map(|(&v, w)| self.normals[v as usize] * w)
            .sum();
        (closest.point, normal.normalize())
    }
}
