//! Find the lump: lumps hidden at random places, the user's marks, and the result.

use std::time::Instant;

use anyhow::bail;
use palpa_mesh::Vec3;
use palpa_scene::{Lump, LumpPlace, LumpShape, Scene, Target, catalogue};
use palpa_viewer::control::{FoundLump, GameInfo, GameResult, LumpInfo};

use crate::hand::Skin;
use crate::world::World;

/// Radii of hidden lumps, m.
const RADII: std::ops::RangeInclusive<f64> = 4.5e-3..=7e-3;
/// Least depth of tissue above and below a hidden lump, m.
const COVER: f64 = 2.5e-3;
const BASE: f64 = 1.5e-3;
/// Least distance of hidden lumps from each other, and from the rims where the body was cut, m.
const APART: f64 = 30e-3;
const FROM_RIM: f64 = 25e-3;
/// Tissue of hidden lumps, a name in the catalogue.
const TISSUE: &str = "fibrous lump";
/// Least force that counts as a touch, N.
const TOUCH: f64 = 0.05;
/// Touches closer together than this count as one, m.
const GRAIN: f64 = 2e-3;
const MOST_TOUCHES: usize = 4000;
/// Radius around a touch that counts as explored, m.
const REACH: f64 = 8e-3;
/// Largest seed: the largest whole number that a page can represent.
const MOST_SEED: u64 = (1 << 53) - 1;
/// Largest number of marks, more than there can be lumps.
const MOST_MARKS: usize = 10;

/// A round of the game.
#[derive(Debug)]
pub(super) struct Game {
    seed: u64,
    n_lumps: u32,
    marks: Vec<Vec3>,
    began: Option<Instant>,
    /// Places on the skin (m) and the largest force at each, N.
    touches: Vec<(Vec3, f64)>,
    max_force: f64,
    /// Integral of the force over time, N s, and time in contact, s.
    impulse: f64,
    contact_time: f64,
    result: Option<(f64, GameResult)>,
    /// The scene without the hidden lumps, restored when the game ends.
    pub(super) before: Scene,
}

impl Game {
    /// Hides lumps in a scene. Returns the round, and the scene to build.
    ///
    /// # Errors
    /// When the body has no room for them.
    pub(super) fn hide(
        world: &World,
        before: &Scene,
        seed: Option<u64>,
        n_lumps: u32,
    ) -> anyhow::Result<(Self, Scene)> {
        if !(1..=3).contains(&n_lumps) {
            bail!("{n_lumps} lumps cannot be hidden; choose 1 to 3");
        }
        if world.spring_body().is_some() {
            bail!("lumps can be hidden in the continuum model only; choose a scene without bars");
        }
        if seed.is_some_and(|seed| seed > MOST_SEED) {
            bail!("a seed is a whole number up to {MOST_SEED}");
        }
        let seed = seed.unwrap_or_else(|| fastrand::u64(..1_000_000));
        let mut random = fastrand::Rng::with_seed(seed);
        let Some(tissue) = catalogue().iter().find(|t| t.name == TISSUE) else {
            bail!("the catalogue has no \"{TISSUE}\"");
        };
        let mut scene = before.clone();
        scene.lumps.clear();
        let mut places: Vec<Vec3> = Vec::new();
        for k in 0..n_lumps {
            let Some((place, radius, depth)) = hiding_place(&world.skin, &places, &mut random)
            else {
                bail!(
                    "the body has no room for {n_lumps} hidden lumps; choose fewer, or a larger body"
                );
            };
            places.push(place);
            scene.lumps.push(Lump {
                name: format!("hidden {}", k + 1),
                shape: LumpShape::Sphere { radius },
                place: LumpPlace::Below {
                    target: Target::Point(place.into()),
                    depth,
                },
                axis: None,
                tissue: tissue.clone(),
                transition: 0.5e-3,
            });
        }
        let game = Self {
            seed,
            n_lumps,
            marks: Vec::new(),
            began: None,
            touches: Vec::new(),
            max_force: 0.0,
            impulse: 0.0,
            contact_time: 0.0,
            result: None,
            before: before.clone(),
        };
        Ok((game, scene))
    }

    /// Starts the clock when the body is ready.
    pub(super) fn begin(&mut self) {
        self.began.get_or_insert_with(Instant::now);
    }

    /// Whether the lumps are revealed.
    pub(super) fn is_revealed(&self) -> bool {
        self.result.is_some()
    }

    /// Records a force (N) on a place of the skin for `dt` seconds.
    pub(super) fn feel(&mut self, place: Vec3, force: f64, dt: f64) {
        if self.is_revealed() || force < TOUCH {
            return;
        }
        self.max_force = self.max_force.max(force);
        self.impulse += force * dt;
        self.contact_time += dt;
        let near = (self.touches.iter()).position(|(p, _)| (p - place).norm() < GRAIN);
        if let Some(near) = near {
            self.touches[near].1 = self.touches[near].1.max(force);
        } else if self.touches.len() < MOST_TOUCHES {
            self.touches.push((place, force));
        }
    }

    /// Marks a point of the skin where the user suspects a lump.
    ///
    /// # Errors
    /// When the lumps are revealed, or there are [`MOST_MARKS`] marks.
    pub(super) fn mark(&mut self, point: Vec3) -> anyhow::Result<()> {
        if self.is_revealed() {
            bail!("the lumps are revealed already; begin a new round");
        }
        if self.marks.len() >= MOST_MARKS {
            bail!("{MOST_MARKS} marks are enough; take one back first");
        }
        self.marks.push(point);
        Ok(())
    }

    /// Takes the last mark back.
    pub(super) fn unmark(&mut self) {
        if !self.is_revealed() {
            self.marks.pop();
        }
    }

    /// Reveals the lumps and computes the result. Marks are matched to lumps one to one, the
    /// nearest pair first.
    pub(super) fn reveal(&mut self, world: &World) {
        if self.is_revealed() {
            return;
        }
        let overs: Vec<Vec3> = world.lumps.iter().map(|lump| over(world, lump)).collect();
        let errors = matched(&overs, &self.marks);
        let n_matched = errors.iter().flatten().count();
        let lumps = world.lumps.iter().zip(&overs).zip(errors);
        let result = GameResult {
            lumps: lumps
                .map(|((lump, over), error)| FoundLump {
                    lump: lump.clone(),
                    over: (*over).into(),
                    error,
                })
                .collect(),
            n_stray_marks: (self.marks.len() - n_matched) as u32,
            max_force: self.max_force,
            mean_force: self.impulse / self.contact_time.max(1e-9),
            contact_seconds: self.contact_time,
            covered: self.covered(&world.skin),
            coverage: self
                .touches
                .iter()
                .map(|(p, f)| [p.x, p.y, p.z, *f])
                .collect(),
        };
        self.result = Some((self.seconds(), result));
    }

    /// Share of the skin's area within [`REACH`] of a touch, 0 to 1. Skin near the rims does not
    /// count.
    fn covered(&self, skin: &Skin) -> f64 {
        let (mut all, mut pressed) = (0.0, 0.0);
        for (point, area, _) in skin.away_from_rim(FROM_RIM) {
            all += area;
            if (self.touches.iter()).any(|(p, _)| (p - point).norm() < REACH) {
                pressed += area;
            }
        }
        pressed / f64::max(all, f64::MIN_POSITIVE)
    }

    fn seconds(&self) -> f64 {
        match &self.result {
            Some((seconds, _)) => *seconds,
            None => self
                .began
                .map_or(0.0, |began| began.elapsed().as_secs_f64()),
        }
    }

    /// The round for the state; the result only once the lumps are revealed.
    pub(super) fn info(&self) -> GameInfo {
        GameInfo {
            seed: self.seed,
            n_lumps: self.n_lumps,
            marks: self.marks.iter().map(|&mark| mark.into()).collect(),
            seconds: self.seconds(),
            result: self.result.as_ref().map(|(_, result)| result.clone()),
        }
    }
}

/// The point of the skin nearest to the centre of a lump, m.
fn over(world: &World, lump: &LumpInfo) -> Vec3 {
    let centre = Vec3::from(lump.centre);
    world
        .skin
        .nearest(centre)
        .map_or(centre, |place| place.point)
}

/// Distance of each place from the mark matched to it, m.
fn matched(places: &[Vec3], marks: &[Vec3]) -> Vec<Option<f64>> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, place) in places.iter().enumerate() {
        for (j, mark) in marks.iter().enumerate() {
            pairs.push(((place - mark).norm(), i, j));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut errors = vec![None; places.len()];
    let mut is_used = vec![false; marks.len()];
    for (error, i, j) in pairs {
        if errors[i].is_none() && !is_used[j] {
            errors[i] = Some(error);
            is_used[j] = true;
        }
    }
    errors
}

/// A random place of the skin with room for a lump. Returns the place, and the radius and depth of
/// the lump's centre, m.
fn hiding_place(
    skin: &Skin,
    others: &[Vec3],
    random: &mut fastrand::Rng,
) -> Option<(Vec3, f64, f64)> {
    let mut places: Vec<(Vec3, f64)> = skin
        .away_from_rim(FROM_RIM)
        .map(|(point, _, thickness)| (point, thickness))
        .collect();
    random.shuffle(&mut places);
    let share = random.f64();
    let radius = RADII.start() + share * (RADII.end() - RADII.start());
    let room = |thickness: f64| thickness - 2.0 * radius - COVER - BASE;
    let is_apart = |p: Vec3| others.iter().all(|q| (p - q).norm() > APART);
    let &(place, thickness) =
        (places.iter()).find(|(p, thickness)| room(*thickness) > 0.0 && is_apart(*p))?;
    // In the upper half of the room: close to the bone, a lump could not be told from the bone.
    let depth = COVER + radius + 0.5 * random.f64() * room(thickness);
    Some((place, radius, depth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_lump_gets_the_mark_that_was_meant_for_it() {
        let places = [Vec3::zeros(), Vec3::x() * 0.03];
        let marks = [Vec3::x() * 0.028, Vec3::x() * 0.1, Vec3::x() * 0.005];
        let errors = matched(&places, &marks);
        assert!((errors[0].unwrap() - 0.005).abs() < 1e-12);
        assert!((errors[1].unwrap() - 0.002).abs() < 1e-12);
        assert_eq!(matched(&places, &marks[..1]), [None, Some(0.03 - 0.028)]);
    }

    #[test]
    fn the_same_seed_hides_at_the_same_place_and_inside_the_tissue() {
        let scene = Scene::embedded();
        let world = World::build(&scene).unwrap();
        let hide = |seed| Game::hide(&world, &scene, Some(seed), 2).unwrap().1;
        assert_eq!(hide(5), hide(5));
        assert_ne!(hide(5).lumps, hide(6).lumps);
        for seed in 0..20 {
            for lump in hide(seed).lumps {
                let (LumpShape::Sphere { radius }, LumpPlace::Below { target, depth }) =
                    (lump.shape, lump.place)
                else {
                    panic!("a ball under a place");
                };
                let Target::Point(point) = target else {
                    panic!("a point")
                };
                let thickness = world.skin.nearest(point.into()).unwrap().thickness;
                assert!(depth - radius >= COVER - 1e-9 && depth + radius <= thickness);
            }
        }
    }
}
