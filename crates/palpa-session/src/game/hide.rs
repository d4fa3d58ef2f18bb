//! Levels, and where and which lumps are hidden.

use anyhow::{Context as _, bail};
use palpa_mesh::Vec3;
use palpa_scene::{
    Elastic, Energy, Law, Lump, LumpPlace, LumpShape, Scene, Sourced, Status, Stiffness, Target,
    catalogue,
};
use palpa_viewer::control::{Level, LevelInfo, MapSight};

use crate::world::World;

/// Least depth of tissue under a hidden lump, m.
const BASE: f64 = 1.5e-3;
/// Least distance of hidden lumps from each other, and from the rims where the body was cut, m.
const APART: f64 = 30e-3;
pub(super) const FROM_RIM: f64 = 25e-3;
/// A name in the catalogue. Hidden lumps have its Poisson's ratio, and a stiffness of their own.
const TISSUE: &str = "fibrous lump";
/// A place is on the side of the press point if the outward normals of the two have at least this
/// cosine: up to 60°.
const SAME_SIDE: f64 = 0.5;

/// The levels.
pub(crate) const LEVELS: [Level; 3] = [Level::Easy, Level::Medium, Level::Hard];

/// The ranges of a level. By `palpa press` on the forearm with a ball of 10 mm at 4 mm, the force above
/// the weakest, middle and strongest lump of a level grows by
///
/// | easy | 76 % | 182 % | 360 % |
/// | --- | --- | --- | --- |
/// | medium | 15 % | 36 % | 108 % |
/// | hard | 4 % | 9 % | 27 % |
pub(crate) fn info(level: Level) -> LevelInfo {
    let (radius, cover, times) = match level {
        Level::Easy => ([7e-3, 9e-3], [2.5e-3, 4e-3], [8.0, 16.0]),
        Level::Medium => ([5.5e-3, 7e-3], [3e-3, 6e-3], [4.0, 8.0]),
        Level::Hard => ([4.5e-3, 5.5e-3], [4e-3, 9e-3], [3.0, 4.0]),
    };
    LevelInfo {
        level,
        radius,
        cover,
        times,
        is_either_side: level != Level::Easy,
        map: match level {
            Level::Easy => MapSight::Everything,
            Level::Medium => MapSight::Stiffness,
            Level::Hard => MapSight::Nothing,
        },
    }
}

/// A place of the skin that is far enough from the rims.
pub(super) struct Spot {
    pub(super) point: Vec3,
    normal: Vec3,
    pub(super) area: f64,
    thickness: f64,
}

/// The places of the skin over the area in which a level hides lumps.
pub(super) fn area(world: &World, level: Level) -> Vec<Spot> {
    let is_near = |normal: &Vec3| normal.dot(&world.home.normal) >= SAME_SIDE;
    let spots = world.skin.away_from_rim(FROM_RIM);
    spots
        .filter_map(|(point, area, thickness)| {
            let normal = world.skin.nearest(point)?.normal;
            (info(level).is_either_side || is_near(&normal)).then_some(Spot {
                point,
                normal,
                area,
                thickness,
            })
        })
        .collect()
}

/// Whether a level hides lumps on the side that faces away from the press point too, and the body
/// has such a side.
pub(super) fn is_either_side(world: &World, level: Level) -> bool {
    (area(world, level).iter()).any(|spot| spot.normal.dot(&world.home.normal) < 0.0)
}

/// A scene with hidden lumps in place of its own, and the stiffness of each in multiples of that of
/// the layer around its centre.
///
/// # Errors
/// When the body has no room for them.
pub(super) fn hide(
    world: &World,
    before: &Scene,
    seed: u64,
    level: Level,
    n_lumps: u32,
) -> anyhow::Result<(Scene, Vec<f64>)> {
    let tissue = catalogue().iter().find(|t| t.name == TISSUE);
    let tissue = tissue.with_context(|| format!("the catalogue has no \"{TISSUE}\""))?;
    let spots = area(world, level);
    let mut random = fastrand::Rng::with_seed(seed);
    let mut scene = before.clone();
    scene.lumps.clear();
    let (mut places, mut all_times): (Vec<Vec3>, Vec<f64>) = Default::default();
    for k in 1..=n_lumps {
        let Some(drawn) = draw(world, &spots, level, &places, &mut random) else {
            bail!(
                "the body has no room for {n_lumps} lumps of this level; choose fewer, another level, or a larger body"
            );
        };
        places.push(drawn.place);
        all_times.push(drawn.times);
        let mut tissue = tissue.clone();
        if let Law::Elastic(Elastic { energy, .. }) = &mut tissue.law {
            *energy = Energy::NeoHookean {
                stiffness: Stiffness::Young(Sourced {
                    value: drawn.young,
                    status: Status::Given,
                    source: String::new(),
                }),
            };
        }
        scene.lumps.push(Lump {
            name: format!("hidden {k}"),
            shape: LumpShape::Sphere {
                radius: drawn.radius,
            },
            place: LumpPlace::Below {
                target: Target::Point(drawn.place.into()),
                depth: drawn.depth,
            },
            axis: None,
            tissue,
            transition: 0.5e-3,
        });
    }
    Ok((scene, all_times))
}

/// A lump that was drawn.
struct Drawn {
    /// The place of the skin over it, m.
    place: Vec3,
    radius: f64,
    /// Depth of its centre, m.
    depth: f64,
    /// Young's modulus, Pa, and in multiples of that of the layer around the centre.
    young: f64,
    times: f64,
}

/// Draws a place by its share of the area, and a lump that has room under it. Its radius comes first,
/// and leaves room for the thinnest cover.
fn draw(
    world: &World,
    spots: &[Spot],
    level: Level,
    others: &[Vec3],
    random: &mut fastrand::Rng,
) -> Option<Drawn> {
    let level = info(level);
    let ([least, most], [thin, thick]) = (level.radius, level.cover);
    let room = |spot: &Spot| spot.thickness - BASE;
    let is_possible = |spot: &&Spot| {
        room(spot) >= thin + 2.0 * least
            && others
                .iter()
                .all(|other| (other - spot.point).norm() > APART)
    };
    let possible: Vec<&Spot> = spots.iter().filter(is_possible).collect();
    let mut left = random.f64() * possible.iter().map(|spot| spot.area).sum::<f64>();
    let spot = possible.iter().find(|spot| {
        left -= spot.area;
        left <= 0.0
    });
    let spot = spot.or(possible.last())?;
    let mut within = |low: f64, high: f64| low + random.f64() * (high - low);
    let radius = within(least, most.min((room(spot) - thin) / 2.0));
    let cover = within(thin, thick.min(room(spot) - 2.0 * radius));
    let times = within(level.times[0], level.times[1]);
    let depth = cover + radius;
    Some(Drawn {
        place: spot.point,
        radius,
        depth,
        young: times * world.stiffness_below(spot.point, depth)?,
        times,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gallery;

    #[test]
    fn the_same_seed_and_level_hide_the_same_lumps() {
        let scene = Scene::embedded();
        let world = World::build(&scene).unwrap();
        let hide = |seed, level| hide(&world, &scene, seed, level, 2).unwrap();
        assert_eq!(hide(5, Level::Medium), hide(5, Level::Medium));
        assert_ne!(hide(5, Level::Medium).0, hide(6, Level::Medium).0);
        assert_ne!(hide(5, Level::Medium).0, hide(5, Level::Hard).0);
    }

    #[test]
    fn lumps_are_within_the_ranges_of_their_level_and_inside_the_tissue() {
        let scene = Scene::embedded();
        let world = World::build(&scene).unwrap();
        for level in LEVELS {
            let range = info(level);
            let (mut n_near, mut n_far) = (0, 0);
            for seed in 0..60 {
                let (scene, times) = hide(&world, &scene, seed, level, 2).unwrap();
                for (lump, times) in scene.lumps.iter().zip(times) {
                    let (LumpShape::Sphere { radius }, LumpPlace::Below { target, depth }) =
                        (&lump.shape, lump.place)
                    else {
                        panic!("a ball under a place");
                    };
                    let Target::Point(point) = target else {
                        panic!("a point")
                    };
                    let at = world.skin.nearest(point.into()).unwrap();
                    let is_in =
                        |[low, high]: [f64; 2], x: f64| (low - 1e-9..=high + 1e-9).contains(&x);
                    assert!(is_in(range.radius, *radius), "{level:?}: {radius}");
                    assert!(is_in(range.cover, depth - radius), "{level:?}: {depth}");
                    assert!(is_in(range.times, times), "{level:?}: {times}");
                    assert!(depth + radius <= at.thickness - BASE + 1e-9);
                    let around = world.stiffness_below(point.into(), depth).unwrap();
                    let young = lump.tissue.young().unwrap();
                    assert!((young / around - times).abs() < 1e-9 * times);
                    if at.normal.dot(&world.home.normal) >= SAME_SIDE {
                        n_near += 1;
                    } else if at.normal.dot(&world.home.normal) < 0.0 {
                        n_far += 1;
                    }
                }
            }
            assert!(
                n_near > 10,
                "{level:?}: {n_near} on the side of the press point"
            );
            if range.is_either_side {
                assert!(n_far > 20, "{level:?}: {n_far} on the other side");
            } else {
                assert_eq!(n_near, 120, "all on the side of the press point");
            }
            assert_eq!(is_either_side(&world, level), range.is_either_side);
        }
    }

    #[test]
    fn a_block_has_room_for_two_lumps_of_each_level_and_only_one_side() {
        let scene = gallery::scene("block").unwrap();
        let world = World::build(&scene).unwrap();
        for level in LEVELS {
            for seed in 0..10 {
                let (hidden, _) = hide(&world, &scene, seed, level, 2).unwrap();
                assert_eq!(hidden.lumps.len(), 2);
            }
            assert!(!is_either_side(&world, level));
        }
    }
}
