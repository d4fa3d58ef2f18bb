//! Places drawn at random on the skin.

use fastrand::Rng;
use palpa::build::BuiltBody;
use palpa::live::LiveScene;
use palpa_mesh::{Surface, Vec3};
use palpa_scene::{Scene, Target};

use super::ShippedCase;

/// Range of the speed of the hand, m/s: drawn evenly in its logarithm.
const SPEEDS: [f64; 2] = [5e-3, 50e-3];
/// Most places that are tried for each one that is asked for: near a bone or a rim a stroke has no
/// room.
const MOST_TRIES: usize = 30;
const SEED: u64 = 2014;

/// A place with the direction and speed of a stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Place on the skin, m.
    pub at: Vec3,
    /// Direction of the stroke before it is laid into the skin.
    pub along: Vec3,
    /// Largest speed of the hand, m/s.
    pub speed: f64,
}

impl Spot {
    /// The scene with the stroke there.
    pub fn scene(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        scene.press.target = Target::Point(self.at.into());
        scene.press.direction = None;
        scene.motion.along = Some(self.along.into());
        scene.motion.speed = self.speed;
        scene
    }
}

/// Draws `n` places at which the scene can be felt, and sets up each. Fewer if there is not enough
/// room, or `goes_on`, which is asked before each, returns false.
///
/// # Errors
/// If the body cannot be grown.
pub fn draw_spots(
    case: &ShippedCase,
    n: usize,
    goes_on: impl Fn() -> bool,
) -> anyhow::Result<Vec<(Spot, LiveScene)>> {
    let built = palpa::build::build(&case.scene)?;
    let mut rng = Rng::with_seed(SEED);
    let skin = Drawing::new(case, &built);
    let mut found = Vec::new();
    for _ in 0..MOST_TRIES * n {
        if found.len() == n || !goes_on() {
            break;
        }
        let Some(spot) = skin.draw(&mut rng) else {
            break;
        };
        // Where there is too little room, another place is drawn.
        if let Ok(live) = LiveScene::build(&spot.scene(&case.scene)) {
            found.push((spot, live));
        }
    }
    Ok(found)
}

/// The triangles in which places are drawn.
struct Drawing<'a> {
    skin: &'a Surface,
    /// Triangles, each with the sum of the areas up to it, m².
    triangles: Vec<(usize, f64)>,
}

impl<'a> Drawing<'a> {
    fn new(case: &ShippedCase, built: &'a BuiltBody) -> Self {
        let body = &built.growth.body;
        let skin = &body.skin;
        let rims: Vec<Vec3> = (body.cut_faces.iter().flat_map(|face| &face.vertices))
            .map(|&v| skin.points[v as usize])
            .collect();
        let region = case.region;
        let mut sum = 0.0;
        let mut triangles = Vec::new();
        for (t, corners) in skin.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|v| skin.points[v as usize]);
            let middle = (a + b + c) / 3.0;
            let is_near = (middle - built.press_at).norm() <= region.radius;
            let is_off_rim = (rims.iter()).all(|rim| (rim - middle).norm() >= region.off_rim);
            if is_near && is_off_rim {
                sum += 0.5 * (b - a).cross(&(c - a)).norm();
                triangles.push((t, sum));
            }
        }
        Self { skin, triangles }
    }

    fn draw(&self, rng: &mut Rng) -> Option<Spot> {
        let (_, whole) = self.triangles.last()?;
        let wanted = rng.f64() * whole;
        let at = self.triangles.partition_point(|(_, sum)| *sum < wanted);
        let (t, _) = self.triangles.get(at)?;
        let corners = self.skin.triangles[*t].map(|v| self.skin.points[v as usize]);
        let (mut u, mut v) = (rng.f64(), rng.f64());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let [a, b, c] = corners;
        let angle = rng.f64() * std::f64::consts::TAU;
        let (first, second) = ((b - a).normalize(), (c - a).normalize());
        let across = (second - first * first.dot(&second)).normalize();
        let [slow, fast] = SPEEDS.map(f64::ln);
        Some(Spot {
            at: a + (b - a) * u + (c - a) * v,
            along: first * angle.cos() + across * angle.sin(),
            speed: (slow + (fast - slow) * rng.f64()).exp(),
        })
    }
}
