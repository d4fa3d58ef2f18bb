//! The palpation map of a session: what the hand feels, what pages see of it, and its files.

use std::fmt::Write as _;

use palpa::map::{PalpationMap, Touch};
use palpa_mesh::{Surface, Vec3};
use palpa_plot::vtu::Grid;
use palpa_viewer::control::MapSight;
use palpa_viewer::wire::{FrameSnapshot, MapSnapshot};

use crate::world::World;

/// Time between two maps sent to pages, s.
const PERIOD: f64 = 0.25;
/// Spots that are compared with their surroundings in one frame. A thousand neighbours take 0.3 ms a spot.
const SPOTS_A_FRAME: usize = 12;
/// Radius of the contact of a tool that holds a single node, m.
const NODE: f64 = 4e-3;
/// Longest edge of the map's file where the skin was felt, m, and the distance from spots that counts as felt.
const FILE_EDGE: f64 = 2e-3;
const FELT: f64 = 12e-3;

/// The map, and how much of it pages have.
#[derive(Debug, Default)]
pub(crate) struct Palpation {
    map: PalpationMap,
    /// Revision that pages have.
    sent: u64,
    unsent_for: f64,
}

impl Palpation {
    /// Takes a tick of the live body, `dt` seconds after the last one.
    pub(crate) fn feel(&mut self, frame: &FrameSnapshot, world: &World, dt: f64) {
        let touch = touch(frame, world);
        self.map.feel(touch.as_ref(), dt);
        self.map.update(SPOTS_A_FRAME);
    }

    /// Forgets what was felt.
    pub(crate) fn clear(&mut self) {
        self.map.clear();
        // At once: an old map on a new body would be wrong.
        self.unsent_for = PERIOD;
    }

    /// The map for pages, as much as they may see, if that has changed and is due; `dt` seconds after the last
    /// call.
    pub(crate) fn news(&mut self, sight: MapSight, dt: f64) -> Option<MapSnapshot> {
        self.unsent_for += dt;
        let revision = match sight {
            MapSight::Nothing => 0,
            MapSight::Stiffness => 1 + 2 * self.map.revision(),
            MapSight::Everything => 2 + 2 * self.map.revision(),
        };
        if self.unsent_for < PERIOD || self.sent == revision {
            return None;
        }
        self.sent = revision;
        self.unsent_for = 0.0;
        Some(match sight {
            MapSight::Nothing => MapSnapshot::default(),
            MapSight::Stiffness => MapSnapshot {
                shares: vec![f32::NAN; self.map.spots().len()],
                has_finding: 0,
                finding: [0.0; 3],
                finding_share: 0.0,
                ..snapshot(&self.map)
            },
            MapSight::Everything => snapshot(&self.map),
        })
    }

    /// By how much a place of the skin is stiffer than its surroundings, as a share of them; none if too little was
    /// felt there.
    pub(crate) fn share_at(&self, point: Vec3, normal: Vec3) -> Option<f64> {
        let shares = self.map.against_surroundings();
        Some(self.map.value_at(&point, &normal, shares)?.0)
    }

    /// The map for a file, with every spot compared with its surroundings.
    pub(crate) fn whole(&self) -> PalpationMap {
        let mut map = self.map.clone();
        while !map.update(usize::MAX) {}
        map
    }
}

/// What the tool feels in a frame; none away from the skin.
fn touch(frame: &FrameSnapshot, world: &World) -> Option<Touch> {
    let tip = Vec3::from(frame.tool);
    let place = world.skin.nearest(tip)?;
    let depth = place.normal.dot(&(place.point - tip));
    let shape = world.tool.shape;
    Some(Touch {
        point: place.point,
        normal: place.normal,
        depth,
        force: place.normal.dot(&Vec3::from(frame.tissue_force)),
        radius: shape.map_or(NODE, |shape| shape.contact_radius_at(depth.max(0.0))),
        // Converged, and without anything that holds the force back.
        is_sound: frame.step_status == 0 && frame.faults == 0 && frame.gain >= 1.0,
    })
}

fn snapshot(map: &PalpationMap) -> MapSnapshot {
    let spots = map.spots();
    let flat = |of: fn(&palpa::map::Spot) -> Vec3| {
        let all = spots.iter().map(of);
        all.flat_map(|v| [v.x as f32, v.y as f32, v.z as f32])
            .collect()
    };
    let finding = map.finding();
    MapSnapshot {
        revision: map.revision() as u32,
        points: flat(|spot| spot.point),
        normals: flat(|spot| spot.normal),
        stiffness: spots.iter().map(|spot| spot.stiffness as f32).collect(),
        shares: map
            .against_surroundings()
            .iter()
            .map(|x| *x as f32)
            .collect(),
        widths: spots.iter().map(|spot| spot.width() as f32).collect(),
        has_finding: u32::from(finding.is_some()),
        finding: finding.map_or([0.0; 3], |found| found.point.into()),
        finding_share: finding.map_or(0.0, |found| found.share),
        n_forgotten: map.n_forgotten() as u32,
    }
}

/// The spots as a table.
pub(crate) fn table(map: &PalpationMap) -> String {
    let mut out = "x_mm,y_mm,z_mm,stiffness_n_per_mm,against_surroundings,depth_mm,force_n,contact_radius_mm,touches\n".to_owned();
    for (spot, share) in map.spots().iter().zip(map.against_surroundings()) {
        let [x, y, z] = (spot.point * 1e3).into();
        // Where nothing is known of the surroundings, the cell is empty.
        let share = if share.is_finite() {
            format!("{share:.4}")
        } else {
            String::new()
        };
        let _ = writeln!(
            out,
            "{x:.3},{y:.3},{z:.3},{:.5},{share},{:.3},{:.4},{:.2},{}",
            spot.stiffness * 1e-3,
            spot.depth * 1e3,
            spot.force,
            spot.radius * 1e3,
            spot.n_touches
        );
    }
    out
}

/// The map on the skin at rest, finer where it was felt. Point arrays: `stiffness` (N/m) and
/// `against_surroundings` (share), NaN where nothing was felt, and `coverage` (0 to 1).
///
/// # Errors
/// When the grid cannot be written.
pub(crate) fn grid(map: &PalpationMap, skin: &Surface) -> std::io::Result<Vec<u8>> {
    let (surface, normals) = refined(map, skin);
    let stiffness = map.stiffness();
    let at = |values: &[f64]| -> Vec<(f64, f64)> {
        (surface.points.iter().zip(&normals))
            .map(|(p, n)| map.value_at(p, n, values).unwrap_or((f64::NAN, 0.0)))
            .collect()
    };
    let (felt, above) = (at(&stiffness), at(map.against_surroundings()));
    let mut out = Vec::new();
    Grid::of_surface(&surface)
        .with_point_scalars("stiffness", felt.iter().map(|(v, _)| *v).collect())
        .with_point_scalars(
            "against_surroundings",
            above.iter().map(|(v, _)| *v).collect(),
        )
        .with_point_scalars("coverage", felt.iter().map(|(_, c)| *c).collect())
        .write(&mut out)?;
    Ok(out)
}

/// The skin with triangles near spots divided into equal parts, and normals of its points. Triangles share no
/// points: only pictures are made of them.
fn refined(map: &PalpationMap, skin: &Surface) -> (Surface, Vec<Vec3>) {
    let vertex_normals = skin.vertex_normals();
    let (mut points, mut triangles, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    for (t, &corners) in skin.triangles.iter().enumerate() {
        let at = skin.corners(t);
        let at: [Vec3; 3] = [at[0], at[1], at[2]];
        let middle = (at[0] + at[1] + at[2]) / 3.0;
        let reach = FELT + at.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max);
        let is_felt = map
            .spots()
            .iter()
            .any(|spot| (spot.point - middle).norm() < reach);
        let longest = (0..3)
            .map(|k| (at[k] - at[(k + 1) % 3]).norm())
            .fold(0.0, f64::max);
        let parts = if is_felt {
            (longest / FILE_EDGE).ceil().clamp(1.0, 24.0) as u32
        } else {
            1
        };
        let first = points.len() as u32;
        let index = |i: u32, j: u32| first + i * (i + 1) / 2 + j;
        for i in 0..=parts {
            for j in 0..=i {
                let [b, c] = [i - j, j].map(|k| f64::from(k) / f64::from(parts));
                let weights = [1.0 - b - c, b, c];
                let mean =
                    |of: [Vec3; 3]| -> Vec3 { of.iter().zip(weights).map(|(v, w)| v * w).sum() };
                points.push(mean(at));
                normals.push(mean(corners.map(|v| vertex_normals[v as usize])));
            }
        }
        for i in 0..parts {
            for j in 0..=i {
                triangles.push([index(i, j), index(i + 1, j), index(i + 1, j + 1)]);
                if j < i {
                    triangles.push([index(i, j), index(i + 1, j + 1), index(i, j + 1)]);
                }
            }
        }
    }
    (Surface { points, triangles }, normals)
}
