//! Find the lump: lumps hidden at random places, the user's marks, and the results of rounds.
//!
//! [`hide`] has the levels and draws the lumps, [`geodesic`] measures along the skin, [`score`] matches
//! marks to lumps and scores, [`table`] writes the results with their answers.

mod geodesic;
mod hide;
mod score;
mod table;

use std::time::Instant;

use anyhow::bail;
use palpa_mesh::Vec3;
use palpa_scene::Scene;
use palpa_viewer::control::{
    FoundLump, GameInfo, GameResult, Level, LevelInfo, LumpForm, LumpInfo, MapSight, RoundInfo,
    SeriesInfo,
};

use self::geodesic::{Way, Ways};
use self::score::Tally;
use crate::palpation::Palpation;
use crate::world::World;

/// Least force that counts as a touch, N. A contact ends when the force stays below [`LIFTED`] (N) for
/// [`LIFTED_FOR`] (s).
const TOUCH: f64 = 0.05;
const LIFTED: f64 = 0.02;
const LIFTED_FOR: f64 = 0.2;
/// Touches closer together than this count as one, m.
const GRAIN: f64 = 2e-3;
const MOST_TOUCHES: usize = 4000;
/// Radius around a touch that counts as explored, m.
const REACH: f64 = 8e-3;
/// Largest seed: the largest whole number that a page can represent.
const MOST_SEED: u64 = (1 << 53) - 1;
/// Seeds that are drawn are below this, so that people can read them out.
const DRAWN_SEEDS: u64 = 1_000_000;
/// Largest number of marks, more than there can be lumps.
const MOST_MARKS: usize = 10;
const MOST_ROUNDS: u32 = 20;

/// The levels for pages.
pub(crate) fn levels() -> Vec<LevelInfo> {
    hide::LEVELS.map(hide::info).to_vec()
}

/// Parameters of a game.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GameParams {
    /// None draws one.
    pub(crate) seed: Option<u64>,
    /// Lumps in each round, 1 to 3.
    pub(crate) n_lumps: u32,
    /// Level of all rounds; none draws one for each.
    pub(crate) level: Option<Level>,
    /// Number of rounds, 1 to [`MOST_ROUNDS`].
    pub(crate) n_rounds: u32,
}

/// A game: a round, and the series to which it belongs.
#[derive(Debug)]
pub(crate) struct Game {
    series: SeriesInfo,
    n_lumps: u32,
    /// Seeds and levels of the rounds.
    plan: Vec<(u64, Level)>,
    round: Round,
    /// The scene without the hidden lumps, restored when the game ends.
    pub(crate) before: Scene,
}

/// A round of the game.
#[derive(Debug)]
struct Round {
    seed: u64,
    level: Level,
    is_either_side: bool,
    /// Stiffness of each lump in multiples of that of the layer around it.
    times: Vec<f64>,
    marks: Vec<Vec3>,
    began: Option<Instant>,
    /// Places on the skin (m) and the largest force at each, N.
    touches: Vec<(Vec3, f64)>,
    max_force: f64,
    /// Integral of the force over time, N s, and time in contact, s.
    impulse: f64,
    contact_time: f64,
    n_presses: u32,
    /// The contact under way: for how long the force has been small, s.
    contact: Option<f64>,
    result: Option<(f64, GameResult)>,
}

impl Game {
    /// Hides the lumps of the first round in a scene. Returns the game, and the scene to build.
    ///
    /// # Errors
    /// When a number is out of range, or the body has no room for the lumps.
    pub(crate) fn start(
        world: &World,
        before: &Scene,
        params: GameParams,
    ) -> anyhow::Result<(Self, Scene)> {
        let GameParams {
            n_lumps,
            n_rounds,
            level,
            ..
        } = params;
        if !(1..=3).contains(&n_lumps) {
            bail!("{n_lumps} lumps cannot be hidden; choose 1 to 3");
        }
        if !(1..=MOST_ROUNDS).contains(&n_rounds) {
            bail!("a series has 1 to {MOST_ROUNDS} rounds, not {n_rounds}");
        }
        if world.spring_body().is_some() {
            bail!("lumps can be hidden in the continuum model only; choose a scene without bars");
        }
        if params.seed.is_some_and(|seed| seed > MOST_SEED) {
            bail!("a seed is a whole number up to {MOST_SEED}");
        }
        let seed = (params.seed).unwrap_or_else(|| fastrand::u64(..DRAWN_SEEDS));
        let plan = plan(seed, level, n_rounds);
        let (round, scene) = Round::hide(world, before, plan[0], n_lumps)?;
        let game = Self {
            series: SeriesInfo {
                seed,
                level,
                n_rounds,
                rounds: Vec::new(),
            },
            n_lumps,
            plan,
            round,
            before: before.clone(),
        };
        Ok((game, scene))
    }

    /// Hides the lumps of the next round. Returns the scene to build.
    ///
    /// # Errors
    /// When the round is not revealed, or was the last one.
    pub(crate) fn next_round(&mut self, world: &World) -> anyhow::Result<Scene> {
        if !self.is_revealed() {
            bail!("the lumps of this round are still hidden; reveal them first");
        }
        let Some(&next) = self.plan.get(self.series.rounds.len()) else {
            bail!("this was the last round; start a new game");
        };
        let (round, scene) = Round::hide(world, &self.before, next, self.n_lumps)?;
        self.round = round;
        Ok(scene)
    }

    /// Starts the clock when the body is ready.
    pub(crate) fn begin(&mut self, now: Instant) {
        self.round.began.get_or_insert(now);
    }

    /// Whether the lumps are revealed.
    pub(crate) fn is_revealed(&self) -> bool {
        self.round.result.is_some()
    }

    /// What the palpation map shows while the lumps are hidden.
    pub(crate) fn map_sight(&self) -> MapSight {
        hide::info(self.round.level).map
    }

    /// Records a force (N) on a place of the skin for `dt` seconds.
    pub(crate) fn feel(&mut self, place: Vec3, force: f64, dt: f64) {
        if !self.is_revealed() {
            self.round.feel(place, force, dt);
        }
    }

    /// Marks a point of the skin where the user suspects a lump.
    ///
    /// # Errors
    /// When the lumps are revealed, or there are [`MOST_MARKS`] marks.
    pub(crate) fn mark(&mut self, point: Vec3) -> anyhow::Result<()> {
        if self.is_revealed() {
            bail!("the lumps are revealed already; begin a new round");
        }
        if self.round.marks.len() >= MOST_MARKS {
            bail!("{MOST_MARKS} marks are enough; take one back first");
        }
        self.round.marks.push(point);
        Ok(())
    }

    /// Takes the last mark back.
    pub(crate) fn unmark(&mut self) {
        if !self.is_revealed() {
            self.round.marks.pop();
        }
    }

    /// Reveals the lumps and computes the result. `felt` is the palpation map of the round.
    pub(crate) fn reveal(&mut self, world: &World, felt: &Palpation, now: Instant) {
        if self.is_revealed() {
            return;
        }
        let round = &mut self.round;
        let seconds = round.seconds(now);
        let result = round.result(world, felt, seconds);
        self.series.rounds.push(RoundInfo {
            seed: round.seed,
            level: round.level,
            seconds,
            marks: round.marks.iter().map(|&mark| mark.into()).collect(),
            result: GameResult {
                coverage: Vec::new(),
                lumps: (result.lumps.iter())
                    .map(|found| FoundLump {
                        path: Vec::new(),
                        ..found.clone()
                    })
                    .collect(),
                ..result.clone()
            },
        });
        round.result = Some((seconds, result));
    }

    /// The revealed rounds as a table, and their number. `scene` is the name of the scene.
    pub(crate) fn table(&self, scene: &str) -> (String, u32) {
        let table = table::table(scene, &self.series);
        (table, self.series.rounds.len() as u32)
    }

    /// The game for the state; the result only once the lumps are revealed.
    pub(crate) fn info(&self, now: Instant) -> GameInfo {
        let round = &self.round;
        GameInfo {
            seed: round.seed,
            level: round.level,
            n_lumps: self.n_lumps,
            is_either_side: round.is_either_side,
            marks: round.marks.iter().map(|&mark| mark.into()).collect(),
            seconds: round.seconds(now),
            result: round.result.as_ref().map(|(_, result)| result.clone()),
            series: self.series.clone(),
        }
    }
}

/// Seeds and levels of the rounds. A single round has the seed itself.
fn plan(seed: u64, level: Option<Level>, n_rounds: u32) -> Vec<(u64, Level)> {
    let mut random = fastrand::Rng::with_seed(seed);
    (0..n_rounds)
        .map(|_| {
            let drawn = (
                random.u64(..DRAWN_SEEDS),
                hide::LEVELS[random.usize(..hide::LEVELS.len())],
            );
            let seed = if n_rounds == 1 { seed } else { drawn.0 };
            (seed, level.unwrap_or(drawn.1))
        })
        .collect()
}

impl Round {
    fn hide(
        world: &World,
        before: &Scene,
        (seed, level): (u64, Level),
        n_lumps: u32,
    ) -> anyhow::Result<(Self, Scene)> {
        let (scene, times) = hide::hide(world, before, seed, level, n_lumps)?;
        let round = Self {
            seed,
            level,
            is_either_side: hide::is_either_side(world, level),
            times,
            marks: Vec::new(),
            began: None,
            touches: Vec::new(),
            max_force: 0.0,
            impulse: 0.0,
            contact_time: 0.0,
            n_presses: 0,
            contact: None,
            result: None,
        };
        Ok((round, scene))
    }

    fn feel(&mut self, place: Vec3, force: f64, dt: f64) {
        if force < TOUCH {
            if let Some(lifted_for) = &mut self.contact {
                *lifted_for = if force < LIFTED {
                    *lifted_for + dt
                } else {
                    0.0
                };
                if *lifted_for >= LIFTED_FOR {
                    self.contact = None;
                }
            }
            return;
        }
        if self.contact.replace(0.0).is_none() {
            self.n_presses += 1;
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

    fn is_explored(&self, point: Vec3) -> bool {
        (self.touches.iter()).any(|(p, _)| (p - point).norm() < REACH)
    }

    /// Share of the area under which lumps may be hidden within [`REACH`] of a touch, 0 to 1.
    fn covered(&self, world: &World) -> f64 {
        let (mut all, mut pressed) = (0.0, 0.0);
        for spot in hide::area(world, self.level) {
            all += spot.area;
            if self.is_explored(spot.point) {
                pressed += spot.area;
            }
        }
        pressed / f64::max(all, f64::MIN_POSITIVE)
    }

    fn seconds(&self, now: Instant) -> f64 {
        match (&self.result, self.began) {
            (Some((seconds, _)), _) => *seconds,
            (None, Some(began)) => now.saturating_duration_since(began).as_secs_f64(),
            (None, None) => 0.0,
        }
    }

    fn result(&self, world: &World, felt: &Palpation, seconds: f64) -> GameResult {
        let ways = Ways::new(world.skin.surface());
        let overs: Vec<Vec3> = world.lumps.iter().map(|lump| over(world, lump)).collect();
        let mut to: Vec<Vec<Option<Way>>> = overs
            .iter()
            .map(|over| ways.from(*over, &self.marks))
            .collect();
        let lengths: Vec<Vec<Option<f64>>> = (to.iter())
            .map(|row| row.iter().map(|way| Some(way.as_ref()?.length)).collect())
            .collect();
        let marks = score::matched(&lengths);
        let lumps: Vec<FoundLump> = (world.lumps.iter().enumerate())
            .map(|(i, lump)| {
                let way = marks[i].and_then(|mark| to[i][mark].take());
                let times = self.times.get(i).copied().unwrap_or_default();
                self.found(world, felt, lump, overs[i], times, marks[i], way)
            })
            .collect();
        let n_matched = marks.iter().flatten().count();
        let n_found = lumps.iter().filter(|found| found.is_found).count() as u32;
        let covered = self.covered(world);
        GameResult {
            n_found,
            n_stray_marks: (self.marks.len() - n_matched) as u32,
            max_force: self.max_force,
            mean_force: self.impulse / self.contact_time.max(1e-9),
            contact_seconds: self.contact_time,
            n_presses: self.n_presses,
            covered,
            coverage: (self.touches.iter())
                .map(|(p, f)| [p.x, p.y, p.z, *f])
                .collect(),
            score: score::score(&Tally {
                n_lumps: lumps.len() as u32,
                n_found,
                n_marks: self.marks.len() as u32,
                seconds,
                max_force: self.max_force,
                n_presses: self.n_presses,
                covered,
            }),
            lumps,
        }
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "all that is known of a lump and its mark"
    )]
    fn found(
        &self,
        world: &World,
        felt: &Palpation,
        lump: &LumpInfo,
        over: Vec3,
        times: f64,
        mark: Option<usize>,
        way: Option<Way>,
    ) -> FoundLump {
        let radius = radius(lump);
        let tolerance = score::tolerance(radius);
        let error = way.as_ref().map(|way| way.length);
        let normal_at = |point: Vec3| world.skin.nearest(point).map(|place| place.normal);
        let normal = normal_at(over).unwrap_or_default();
        let at_mark = mark.and_then(|mark| normal_at(self.marks[mark]));
        FoundLump {
            lump: lump.clone(),
            radius,
            depth: (Vec3::from(lump.centre) - over).norm(),
            times,
            over: over.into(),
            normal: normal.into(),
            mark: mark.map(|mark| mark as u32),
            error,
            tolerance,
            is_found: error.is_some_and(|error| error <= tolerance),
            is_other_side: at_mark.is_some_and(|at_mark| at_mark.dot(&normal) < 0.0),
            path: way.map_or(Vec::new(), |way| {
                way.points.into_iter().map(Into::into).collect()
            }),
            is_explored: self.is_explored(over),
            felt: felt.share_at(over, normal),
        }
    }
}

/// The point of the skin nearest to the centre of a lump, m.
fn over(world: &World, lump: &LumpInfo) -> Vec3 {
    let centre = Vec3::from(lump.centre);
    let place = world.skin.nearest(centre);
    place.map_or(centre, |place| place.point)
}

/// Radius of a lump; hidden ones are balls.
fn radius(lump: &LumpInfo) -> f64 {
    match lump.shape {
        LumpForm::Ellipsoid { radii } => radii.into_iter().fold(0.0, f64::max),
        LumpForm::Capsule { radius, .. } | LumpForm::Mesh { radius } => radius,
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    /// The body with the lumps of a game in it.
    fn hidden(params: GameParams) -> (Game, World) {
        let scene = Scene::embedded();
        let world = World::build(&scene).unwrap();
        let (game, scene) = Game::start(&world, &scene, params).unwrap();
        (game, World::build(&scene).unwrap())
    }

    const ONE: GameParams = GameParams {
        seed: Some(7),
        n_lumps: 1,
        level: Some(Level::Medium),
        n_rounds: 1,
    };

    fn reveal(game: &mut Game, world: &World, now: Instant) -> GameResult {
        game.reveal(world, &Palpation::default(), now);
        game.info(now).result.unwrap()
    }

    #[test]
    fn a_mark_over_the_lump_finds_it_and_one_on_the_other_side_does_not() {
        let (mut game, world) = hidden(ONE);
        let over = over(&world, &world.lumps[0]);
        let now = Instant::now();
        game.begin(now);
        game.feel(over, 1.0, 0.02);
        game.mark(over).unwrap();
        let result = reveal(&mut game, &world, now + Duration::from_secs(30));
        let found = &result.lumps[0];
        assert!(found.is_found && found.error.unwrap() < 1e-6 && !found.is_other_side);
        assert!(found.is_explored);
        assert_eq!(
            (result.n_found, result.n_stray_marks, result.n_presses),
            (1, 0, 1)
        );
        assert!(result.score.total > 70, "{:?}", result.score);
        assert!((game.info(now).seconds - 30.0).abs() < 1e-9);

        let (mut game, world) = hidden(ONE);
        // Through the body.
        let axis = Vec3::from(world.lumps[0].centre) - over;
        let other = world.skin.nearest(over + axis.normalize() * 0.2).unwrap();
        game.mark(other.point).unwrap();
        let result = reveal(&mut game, &world, now);
        let missed = &result.lumps[0];
        assert!(!missed.is_found && missed.is_other_side && !missed.is_explored);
        let through = (other.point - over).norm();
        let along = missed.error.unwrap();
        assert!(along > 1.2 * through, "{along} along, {through} through");
        let path = &missed.path;
        assert!((Vec3::from(path[0]) - other.point).norm() < 1e-9);
        assert!((Vec3::from(path[path.len() - 1]) - over).norm() < 1e-9);
        assert_eq!((result.n_found, result.score.total), (0, 0));
    }

    #[test]
    fn the_verdict_changes_at_radius_and_five_millimetres() {
        let (_, world) = hidden(ONE);
        let over = over(&world, &world.lumps[0]);
        let normal = world.skin.nearest(over).unwrap().normal;
        let aside = normal
            .cross(&world.skin.nearest(over).unwrap().point.normalize())
            .normalize();
        let tolerance = score::tolerance(radius(&world.lumps[0]));
        assert!((tolerance - radius(&world.lumps[0]) - 5e-3).abs() < 1e-12);
        for (share, is_found) in [(0.9, true), (1.15, false)] {
            let (mut game, world) = hidden(ONE);
            let point = world
                .skin
                .nearest(over + aside * share * tolerance)
                .unwrap()
                .point;
            game.mark(point).unwrap();
            let found = reveal(&mut game, &world, Instant::now()).lumps.remove(0);
            assert_eq!(found.is_found, is_found, "{share}: {:?}", found.error);
        }
    }

    #[test]
    fn presses_are_contacts_and_a_short_dip_of_the_force_ends_none() {
        let (mut game, _) = hidden(ONE);
        let place = Vec3::zeros();
        let mut press = |forces: &[(f64, u32)]| {
            for &(force, n) in forces {
                for _ in 0..n {
                    game.feel(place, force, 0.02);
                }
            }
            game.round.n_presses
        };
        assert_eq!(press(&[(0.0, 20)]), 0);
        assert_eq!(press(&[(0.5, 20), (0.0, 5), (0.5, 20)]), 1);
        assert_eq!(press(&[(0.03, 50), (0.5, 5)]), 1, "the tool still touches");
        assert_eq!(press(&[(0.0, 11), (0.5, 1), (0.0, 11), (0.5, 1)]), 3);
    }

    #[test]
    fn a_series_goes_on_after_each_result_and_its_seed_gives_it_again() {
        let params = GameParams {
            level: None,
            n_rounds: 3,
            ..ONE
        };
        let (mut game, mut world) = hidden(params);
        let before = game.before.clone();
        let now = Instant::now();
        let mut seen = Vec::new();
        for round in 1..=3 {
            assert!(game.next_round(&world).is_err(), "not before the result");
            let info = game.info(now);
            assert_eq!(
                info.series.rounds.len(),
                round - 1,
                "no answer before the result"
            );
            reveal(&mut game, &world, now);
            seen.push((info.seed, info.level, world.lumps[0].clone()));
            if round < 3 {
                world = World::build(&game.next_round(&world).unwrap()).unwrap();
            }
        }
        assert!(
            game.next_round(&world)
                .unwrap_err()
                .to_string()
                .contains("last round")
        );
        let rounds = game.info(now).series.rounds;
        for ((seed, level, lump), round) in seen.iter().zip(&rounds) {
            assert_eq!((round.seed, round.level), (*seed, *level));
            assert_eq!(round.result.lumps[0].lump, *lump);
            assert!(round.result.coverage.is_empty() && round.result.lumps[0].path.is_empty());
            // Each round can be played again by itself.
            let single = GameParams {
                seed: Some(*seed),
                level: Some(*level),
                ..ONE
            };
            let (_, again) = Game::start(&world, &before, single).unwrap();
            let again = World::build(&again).unwrap();
            assert_eq!(again.lumps[0], *lump);
        }
        assert_eq!(plan(7, None, 3), game.plan);
        let many = plan(7, None, 20);
        for level in hide::LEVELS {
            assert!(
                many.iter().any(|(_, drawn)| *drawn == level),
                "{level:?} is drawn"
            );
        }
    }

    #[test]
    fn the_table_has_a_row_for_each_lump_with_its_answer() {
        let (mut game, world) = hidden(GameParams { n_lumps: 2, ..ONE });
        let over = over(&world, &world.lumps[1]);
        game.feel(over, 1.25, 0.02);
        game.mark(over).unwrap();
        let now = Instant::now();
        game.begin(now);
        reveal(&mut game, &world, now + Duration::from_millis(12_300));
        let (text, n_rounds) = game.table("a, \"b\"");
        assert_eq!(n_rounds, 1);
        let mut lines = text.lines();
        let head: Vec<&str> = lines.next().unwrap().split(',').collect();
        let rows: Vec<Vec<&str>> = lines
            .map(|line| {
                let rest = line.strip_prefix("\"a, \"\"b\"\"\"").unwrap();
                rest.split(',').collect()
            })
            .collect();
        assert_eq!(rows.len(), 2);
        let cell = |row: usize, name: &str| {
            let at = head.iter().position(|cell| *cell == name).unwrap();
            assert_eq!(rows[row].len(), head.len());
            rows[row][at]
        };
        assert_eq!(
            (cell(0, "verdict"), cell(1, "verdict")),
            ("unmarked", "found")
        );
        assert_eq!((cell(0, "error_mm"), cell(0, "mark_x_mm")), ("", ""));
        assert_eq!(
            (cell(1, "error_mm"), cell(1, "max_force_n")),
            ("0.00", "1.250")
        );
        assert_eq!(
            (cell(1, "seed"), cell(1, "level"), cell(1, "lump")),
            ("7", "medium", "2")
        );
        assert_eq!((cell(1, "time_s"), cell(1, "presses")), ("12.3", "1"));
        assert_eq!(cell(1, "mark_x_mm"), format!("{:.2}", 1e3 * over.x));
        let centre = world.lumps[1].centre;
        assert_eq!(cell(1, "lump_z_mm"), format!("{:.2}", 1e3 * centre[2]));
        let young = format!("{:.2}", 1e-3 * world.lumps[1].stiffness);
        assert_eq!(cell(1, "lump_young_kpa"), young);
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let scene = Scene::embedded();
        let world = World::build(&scene).unwrap();
        for (params, words) in [
            (GameParams { n_lumps: 4, ..ONE }, "1 to 3"),
            (GameParams { n_rounds: 0, ..ONE }, "1 to 20 rounds"),
            (
                GameParams {
                    n_rounds: 21,
                    ..ONE
                },
                "1 to 20 rounds",
            ),
            (
                GameParams {
                    seed: Some(MOST_SEED + 1),
                    ..ONE
                },
                "seed",
            ),
        ] {
            let error = Game::start(&world, &scene, params).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
