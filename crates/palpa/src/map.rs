//! The palpation map: the skin remembers how stiff it felt, place by place.
//!
//! Each settled press and each 2 mm of a stroke leave a *spot*: the secant stiffness, force along the skin's normal
//! over depth. What a hand looks for is not the stiffness itself, which grows where bone is near, but a place that
//! is stiffer than its surroundings: [`PalpationMap::against_surroundings`] takes away a smooth trend.
//! [`PalpationMap::finding`] says which place stands out, if one does.
//!
//! ```text
//! touch, 60 Hz ──► settled, or 2 mm farther? ──► spots ──► trend and bump at each spot ──► share above the trend
//!                                                  └────► value_at: smooth spots on the skin
//! ```

use nalgebra::{SMatrix, SVector};
use palpa_mesh::Vec3;

/// Distance along the skin after which a stroke leaves a spot, m.
const SPACING: f64 = 2e-3;
/// Spots nearer than this become one, m.
const MERGE: f64 = 1e-3;
/// Touches that are less deep leave no spot, m: the skin's exact place matters too much.
const LEAST_DEPTH: f64 = 1e-3;
/// Smaller forces leave no spot, N.
const LEAST_FORCE: f64 = 0.03;
/// A press has settled when its depth and place have moved by less than this, m, in this time, s.
const STILL_WAY: f64 = 2e-4;
const STILL_TIME: f64 = 0.15;
/// A stroke leaves no spot while it sinks or rises faster, m/s.
const STROKE_SINK: f64 = 15e-3;
/// A new spot replaces an old one at the same place by this share at least, so that the map follows a body that
/// was changed.
const LEAST_SHARE: f64 = 0.25;
/// Largest number of spots. Beyond it, the oldest is forgotten.
const MOST_SPOTS: usize = 4000;
/// Width of a spot on the map (standard deviation), as a share of the contact's radius.
const SPOT_WIDTH: f64 = 0.5;
/// The trend: standard deviation of its weights, m, and the distance at which they end.
const TREND: f64 = 25e-3;
const TREND_REACH: f64 = 2.0 * TREND;
/// Resistance of the trend to slope and curvature, as a share of the weights: just enough along a single stroke,
/// where nothing is known of the direction across. More of it would flatten the trend beside bone.
const STIFF_SLOPE: f64 = 1e-4;
const STIFF_CURVATURE: f64 = 1e-3;
/// Width of a lump's bump (standard deviation), as a share of the contact's radius. A contact spreads what a lump adds
/// over its own width.
const BUMP_WIDTH: f64 = 1.3;
/// Resistance of a bump to its height, in spots' weights: a spread of 5 % against heights of 15 %. It keeps the ends of
/// strokes from standing out, where bump and trend can hardly be told apart.
const STIFF_BUMP: f64 = 0.11;
/// Fewest neighbours from which a trend is known, and the least width of the touched area around it, m.
const LEAST_NEIGHBOURS: usize = 8;
const LEAST_WIDTH: f64 = 20e-3;
/// A place stands out if its bump is at least this share of the trend, and if it is so many times the standard deviation
/// of the bumps that are left around it once its own is taken away. Measured with five strokes over a forearm made by
/// formula, meshes of 7 to 12 mm, two speeds and slow jobs: 3.5 to 5.0 with a lump, 0.9 to 2.7 without it.
const STANDS_OUT: f64 = 0.025;
const STANDS_OUT_BY: f64 = 3.1;
/// Of how many places around it at most this is taken.
const MOST_AROUND: usize = 150;

/// What a tool feels at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// The place of the skin at rest under the tool, m.
    pub point: Vec3,
    /// The outward normal there.
    pub normal: Vec3,
    /// Depth of the tool's tip below that place, m.
    pub depth: f64,
    /// Force of the tissue along the normal, N.
    pub force: f64,
    /// Radius of the contact, m.
    pub radius: f64,
    /// Whether the force can be trusted: the tissue keeps up, and nothing holds the force back.
    pub is_sound: bool,
}

/// A place of the skin that was felt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// The place on the skin at rest, m.
    pub point: Vec3,
    /// The outward normal there.
    pub normal: Vec3,
    /// Secant stiffness: force along the normal over depth, N/m.
    pub stiffness: f64,
    /// Depth of the touch, m.
    pub depth: f64,
    /// Force along the normal, N.
    pub force: f64,
    /// Radius of the contact, m.
    pub radius: f64,
    /// Number of touches in it.
    pub n_touches: u32,
}

impl Spot {
    /// Width on the map (standard deviation), m.
    pub fn width(&self) -> f64 {
        SPOT_WIDTH * self.radius
    }

    /// Distance to another spot, m, if that belongs to the surroundings.
    fn distance(&self, other: &Self) -> Option<f64> {
        let far = (other.point - self.point).norm();
        (far < TREND_REACH && other.normal.dot(&self.normal) > 0.0).then_some(far)
    }
}

/// The place that stands out from its surroundings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// The place on the skin at rest, m.
    pub point: Vec3,
    /// By how much it is stiffer than its surroundings, as a share of them.
    pub share: f64,
}

/// The contact under way.
#[derive(Debug, Clone, Copy)]
struct Contact {
    /// Where it began, or where it last left a spot.
    left: Vec3,
    /// Whether it has left a spot.
    has_left: bool,
    /// Place and depth since which it is still, and for how long, s.
    still: (Vec3, f64),
    still_for: f64,
    depth: f64,
}

/// The map of one body.
#[derive(Debug, Clone, Default)]
pub struct PalpationMap {
    spots: Vec<Spot>,
    /// By how much each spot is stiffer than the trend around it. `[n_spots]`
    shares: Vec<f64>,
    /// Height of the bump that fits best on each spot, as a share of the trend below it. `[n_spots]`
    bumps: Vec<f64>,
    /// The place that stands out, and its bump; the trend is fitted without it.
    found: Option<(Finding, Bump)>,
    /// Spots whose surroundings have changed since. `[n_spots]`
    is_due: Vec<bool>,
    /// Where the search for due spots goes on.
    next: usize,
    contact: Option<Contact>,
    revision: u64,
    /// The revision in which it was judged what stands out.
    judged: u64,
    n_forgotten: u64,
}

impl PalpationMap {
    /// The spots, oldest first.
    pub fn spots(&self) -> &[Spot] {
        &self.spots
    }

    /// By how much each spot is stiffer than its surroundings, as a share of them; NaN where too little around it
    /// was felt. Up to date after [`Self::update`]. `[n_spots]`
    pub fn against_surroundings(&self) -> &[f64] {
        &self.shares
    }

    /// Compares at most `most` spots with their surroundings, of those whose surroundings have changed. Returns
    /// whether all are up to date. Cost of a spot: a fit to its neighbours, of which there are up to a thousand where
    /// strokes are dense; when all are compared, a hundred and fifty more.
    pub fn update(&mut self, most: usize) -> bool {
        let n = self.spots.len();
        let mut left = most;
        loop {
            for _ in 0..n {
                let i = self.next % n;
                if self.is_due[i] {
                    if left == 0 {
                        return false;
                    }
                    left -= 1;
                    self.is_due[i] = false;
                    self.compare(i);
                }
                self.next = i + 1;
            }
            // What stands out depends on the spots alone, so a second round is the last one.
            if self.judged == self.revision || !self.look_for_findings() {
                return true;
            }
        }
    }

    fn compare(&mut self, i: usize) {
        let spot = &self.spots[i];
        let around = Around::of(spot, &self.spots, self.found.as_ref().map(|(_, bump)| bump));
        let trend = around.as_ref().and_then(Around::trend);
        self.shares[i] = trend.map_or(f64::NAN, |trend| spot.stiffness / trend - 1.0);
        self.bumps[i] = around.and_then(|a| a.bump(&a.right)).unwrap_or(f64::NAN);
        self.revision += 1;
    }

    /// Judges which place stands out. Returns whether that changes the trend anywhere; the spots there are due then.
    fn look_for_findings(&mut self) -> bool {
        self.judged = self.revision;
        let found = self.stands_out();
        let is_same = match (&self.found, &found) {
            (Some((_, old)), Some((_, new))) => {
                (old.point - new.point).norm() < MERGE
                    && (old.height - new.height).abs() < 0.05 * new.height
            }
            (None, None) => true,
            _ => false,
        };
        if is_same {
            return false;
        }
        let old = std::mem::replace(&mut self.found, found);
        for place in [old, found].into_iter().flatten() {
            self.look_again_around(&place.0.point);
        }
        true
    }

    fn look_again_around(&mut self, point: &Vec3) {
        for (spot, is_due) in self.spots.iter().zip(&mut self.is_due) {
            *is_due |= (spot.point - point).norm() < TREND_REACH;
        }
    }

    /// Grows with every change.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Number of spots that were forgotten, because there were too many.
    pub fn n_forgotten(&self) -> u64 {
        self.n_forgotten
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        let revision = self.revision + 1;
        *self = Self {
            revision,
            ..Self::default()
        };
    }

    /// Takes what the tool feels, `dt` seconds after the last touch; `None` away from the skin. Returns whether it
    /// left a spot.
    pub fn feel(&mut self, touch: Option<&Touch>, dt: f64) -> bool {
        let Some(touch) = touch.filter(|touch| touch.depth > 0.0) else {
            self.contact = None;
            return false;
        };
        let contact = self.contact.get_or_insert(Contact {
            left: touch.point,
            has_left: false,
            still: (touch.point, touch.depth),
            still_for: 0.0,
            depth: touch.depth,
        });
        let sink = (touch.depth - contact.depth).abs() / dt.max(1e-6);
        contact.depth = touch.depth;
        let (point, depth) = contact.still;
        if (point - touch.point).norm() < STILL_WAY && (depth - touch.depth).abs() < STILL_WAY {
            contact.still_for += dt;
        } else {
            contact.still = (touch.point, touch.depth);
            contact.still_for = 0.0;
        }
        if !touch.is_sound || touch.depth < LEAST_DEPTH || touch.force < LEAST_FORCE {
            return false;
        }
        let way = (touch.point - contact.left).norm();
        let is_stroke = way >= SPACING && sink < STROKE_SINK;
        let has_settled = contact.still_for >= STILL_TIME && (!contact.has_left || way > STILL_WAY);
        if !is_stroke && !has_settled {
            return false;
        }
        contact.left = touch.point;
        contact.has_left = true;
        self.leave(touch);
        true
    }

    fn leave(&mut self, touch: &Touch) {
        self.revision += 1;
        let new = Spot {
            point: touch.point,
            normal: touch.normal,
            stiffness: touch.force / touch.depth,
            depth: touch.depth,
            force: touch.force,
            radius: touch.radius,
            n_touches: 1,
        };
        let is_near = |old: &Spot| {
            (old.point - new.point).norm() < MERGE && old.normal.dot(&new.normal) > 0.0
        };
        if let Some(old) = self.spots.iter_mut().find(|old| is_near(old)) {
            let share = (1.0 / f64::from(old.n_touches + 1)).max(LEAST_SHARE);
            let mean = |a: f64, b: f64| a + share * (b - a);
            *old = Spot {
                point: old.point.lerp(&new.point, share),
                normal: old.normal,
                stiffness: mean(old.stiffness, new.stiffness),
                depth: mean(old.depth, new.depth),
                force: mean(old.force, new.force),
                radius: mean(old.radius, new.radius),
                n_touches: old.n_touches.saturating_add(1),
            };
        } else {
            if self.spots.len() >= MOST_SPOTS {
                self.spots.remove(0);
                self.shares.remove(0);
                self.bumps.remove(0);
                self.is_due.remove(0);
                self.n_forgotten += 1;
            }
            self.spots.push(new);
            self.shares.push(f64::NAN);
            self.bumps.push(f64::NAN);
            self.is_due.push(true);
        }
        self.look_again_around(&new.point);
    }

    /// The secant stiffness of each spot, N/m. `[n_spots]`
    pub fn stiffness(&self) -> Vec<f64> {
        self.spots.iter().map(|spot| spot.stiffness).collect()
    }

    /// The smooth value of `values` at a place of the skin, and how well it is covered by spots, 0 to 1. `values`
    /// has one value for each spot; those that are NaN do not count. `None` where nothing was felt.
    pub fn value_at(&self, point: &Vec3, normal: &Vec3, values: &[f64]) -> Option<(f64, f64)> {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (spot, value) in self.spots.iter().zip(values) {
            let off = (spot.point - point).norm_squared() / spot.width().powi(2);
            if off < 9.0 && value.is_finite() && spot.normal.dot(normal) > 0.0 {
                let weight = (-0.5 * off).exp();
                sum += weight * value;
                weights += weight;
            }
        }
        (weights > 0.02).then(|| (sum / weights, weights.min(1.0)))
    }

    /// The place that stands out most from its surroundings; `None` if none stands out enough. Up to date after
    /// [`Self::update`].
    pub fn finding(&self) -> Option<Finding> {
        self.found.map(|(finding, _)| finding)
    }

    fn stands_out(&self) -> Option<(Finding, Bump)> {
        let (at, share) = (self.bumps.iter().copied().enumerate())
            .filter(|(_, share)| share.is_finite())
            .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        if share < STANDS_OUT {
            return None;
        }
        let found = &self.spots[at];
        let bump = Bump::on(found, found.stiffness * share / (1.0 + share));
        // The bumps that are left around it when its own is taken away are what a bump is worth here.
        let around: Vec<&Spot> = (self.spots.iter())
            .filter(|spot| found.distance(spot).is_some())
            .collect();
        let left: Vec<f64> = (around.iter())
            .step_by(around.len().div_ceil(MOST_AROUND))
            .filter_map(|spot| {
                let around = Around::of(spot, &self.spots, Some(&bump))?;
                around.bump(&around.right_without)
            })
            .collect();
        let n = left.len() as f64;
        let mean = left.iter().sum::<f64>() / n;
        let square = left.iter().map(|share| (share - mean).powi(2)).sum::<f64>() / n;
        let finding = Finding {
            point: found.point,
            share,
        };
        (share >= STANDS_OUT_BY * square.sqrt()).then_some((finding, bump))
    }
}

/// A round place that is stiffer, as the contact feels it.
#[derive(Debug, Clone, Copy)]
struct Bump {
    point: Vec3,
    /// Added stiffness in the middle, N/m.
    height: f64,
    /// Standard deviation, m.
    width: f64,
}

impl Bump {
    fn on(spot: &Spot, height: f64) -> Self {
        Self {
            point: spot.point,
            height,
            width: (BUMP_WIDTH * spot.radius).max(SPACING),
        }
    }

    fn at(&self, point: &Vec3) -> f64 {
        let off = (point - self.point).norm_squared() / self.width.powi(2);
        self.height * (-0.5 * off).exp()
    }
}

/// Terms of the trend, and of a fit: the trend and a bump.
const TREND_TERMS: usize = 6;
const TERMS: usize = TREND_TERMS + 1;

/// The normal equations of a trend of second degree and a bump on a spot, from the spots around it. Fitted together, a
/// lump does not raise its own surroundings.
struct Around {
    matrix: SMatrix<f64, TERMS, TERMS>,
    right: SVector<f64, TERMS>,
    /// The same with the bump of a place that stands out taken away.
    right_without: SVector<f64, TERMS>,
}

impl Around {
    /// `None` where too little was felt.
    fn of(spot: &Spot, spots: &[Spot], without: Option<&Bump>) -> Option<Self> {
        let u = (if spot.normal.x.abs() < 0.7 {
            Vec3::x()
        } else {
            Vec3::y()
        })
        .cross(&spot.normal)
        .try_normalize(1e-9)?;
        let v = spot.normal.cross(&u);
        let bump = Bump::on(spot, 1.0);
        let mut matrix = SMatrix::zeros();
        let (mut right, mut right_without) = (SVector::zeros(), SVector::zeros());
        let (mut sum, mut n, mut reach) = (0.0, 0, 0.0_f64);
        for other in spots {
            let Some(far) = spot.distance(other) else {
                continue;
            };
            let off = other.point - spot.point;
            let (x, y) = (off.dot(&u) / TREND, off.dot(&v) / TREND);
            let weight = (-0.5 * (far / TREND).powi(2)).exp();
            let row = SVector::from([1.0, x, y, x * x, x * y, y * y, bump.at(&other.point)]);
            let taken = without.map_or(0.0, |bump| bump.at(&other.point));
            matrix += row * row.transpose() * weight;
            right += row * (weight * other.stiffness);
            right_without += row * (weight * (other.stiffness - taken));
            sum += weight;
            n += 1;
            reach = reach.max(x.hypot(y) * TREND);
        }
        if n < LEAST_NEIGHBOURS || reach < 0.5 * LEAST_WIDTH {
            return None;
        }
        let stiff = [
            0.0,
            STIFF_SLOPE * sum,
            STIFF_SLOPE * sum,
            STIFF_CURVATURE * sum,
            STIFF_CURVATURE * sum,
            STIFF_CURVATURE * sum,
            STIFF_BUMP,
        ];
        matrix += SMatrix::from_diagonal(&SVector::from(stiff));
        Some(Self {
            matrix,
            right,
            right_without,
        })
    }

    /// The trend in the middle, N/m.
    fn trend(&self) -> Option<f64> {
        let matrix = self.matrix.fixed_view::<TREND_TERMS, TREND_TERMS>(0, 0);
        let right = self.right_without.fixed_rows::<TREND_TERMS>(0);
        let trend = matrix.clone_owned().cholesky()?.solve(&right)[0];
        (trend > 0.0 && trend.is_finite()).then_some(trend)
    }

    /// Height of the bump in the middle, as a share of the trend below it.
    fn bump(&self, right: &SVector<f64, TERMS>) -> Option<f64> {
        let fit = self.matrix.cholesky()?.solve(right);
        let share = fit[TREND_TERMS] / fit[0];
        (fit[0] > 0.0 && share.is_finite()).then_some(share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1.0 / 60.0;
    const LUMP: Vec3 = Vec3::new(6e-3, 3e-3, 0.0);

    /// A plane skin over a bone along x, so that stiffness grows towards y = 40 mm, with a bump of `bump` at
    /// [`LUMP`] and noise of 1 %. N/m.
    fn stiffness(at: &Vec3, bump: f64, seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let noise = (*seed >> 40) as f64 / f64::from(1 << 24) - 0.5;
        let bone = 160.0 * (1.0 + 0.5 * (at.y / 25e-3 + 1.0).powi(2));
        let off = (at - LUMP).norm() / 8e-3;
        bone * (1.0 + bump * (-0.5 * off * off).exp()) * (1.0 + 0.02 * noise)
    }

    fn touch(point: Vec3, stiffness: f64) -> Touch {
        Touch {
            point,
            normal: Vec3::z(),
            depth: 5e-3,
            force: stiffness * 5e-3,
            radius: 8e-3,
            is_sound: true,
        }
    }

    /// Strokes along x at 30 mm/s, `apart` metres from each other.
    fn stroked(n: i32, apart: f64, bump: f64) -> PalpationMap {
        let mut map = PalpationMap::default();
        let mut seed = 3;
        for k in 0..n {
            let y = apart * f64::from(k - n / 2);
            for i in 0..=160 {
                let point = Vec3::new(-40e-3 + f64::from(i) * 0.5e-3, y, 0.0);
                let stiffness = stiffness(&point, bump, &mut seed);
                map.feel(Some(&touch(point, stiffness)), DT);
            }
            map.feel(None, DT);
        }
        while !map.update(7) {}
        map
    }

    #[test]
    fn a_lump_of_eight_per_cent_is_found_beside_bone_and_none_without_it() {
        let map = stroked(5, 6e-3, 0.08);
        assert!(
            (170..=210).contains(&map.spots().len()),
            "{}",
            map.spots().len()
        );
        let shares = map.against_surroundings();
        let found = map.finding().unwrap();
        assert!((found.point - LUMP).norm() < 5e-3, "{found:?}");
        assert!((0.03..0.08).contains(&found.share), "{found:?}");
        // The bone is the stiffest place by far, and does not stand out.
        let absolute = map.stiffness();
        let value = |y: f64, values: &[f64]| {
            (map.value_at(&Vec3::new(-20e-3, y, 0.0), &Vec3::z(), values))
                .unwrap()
                .0
        };
        assert!(value(12e-3, &absolute) > 1.4 * value(-12e-3, &absolute));
        let bone = value(12e-3, shares);
        assert!(bone.abs() < 0.02, "{bone}");
        let without = stroked(5, 6e-3, 0.0);
        assert_eq!(without.finding(), None);
    }

    #[test]
    fn a_settled_press_leaves_one_spot_and_one_that_moves_or_is_not_sound_none() {
        let mut map = PalpationMap::default();
        let press = |depth: f64, is_sound: bool| Touch {
            depth,
            force: 200.0 * depth,
            is_sound,
            ..touch(Vec3::zeros(), 0.0)
        };
        // Down at 40 mm/s: nothing has settled.
        for k in 1..=8 {
            assert!(!map.feel(Some(&press(f64::from(k) * 0.67e-3, true)), DT));
        }
        let n = (0..60)
            .filter(|_| map.feel(Some(&press(5.4e-3, true)), DT))
            .count();
        assert_eq!((n, map.spots().len()), (1, 1));
        let spot = map.spots()[0];
        assert!((spot.stiffness - 200.0).abs() < 1e-9 && spot.n_touches == 1);
        map.feel(None, DT);
        for touch in [press(5e-3, false), press(0.5e-3, true)] {
            assert!((0..60).all(|_| !map.feel(Some(&touch), DT)));
            map.feel(None, DT);
        }
        // A second press at the same place joins the first.
        (0..60).for_each(|_| {
            map.feel(Some(&press(4e-3, true)), DT);
        });
        assert_eq!((map.spots().len(), map.spots()[0].n_touches), (1, 2));
        let before = map.revision();
        map.clear();
        assert!(map.spots().is_empty() && map.revision() > before);
    }

    #[test]
    fn too_little_is_known_of_few_spots_and_of_the_other_side() {
        let mut map = stroked(1, 0.0, 0.5);
        let mut few = PalpationMap::default();
        for k in 0..4 {
            few.leave(&touch(Vec3::new(f64::from(k) * 2e-3, 0.0, 0.0), 100.0));
        }
        assert!(few.update(100) && few.against_surroundings().iter().all(|x| x.is_nan()));
        assert_eq!(few.finding(), None);
        // A change asks for the spots around it only.
        map.leave(&touch(Vec3::new(-40e-3, 0.0, 0.0), 100.0));
        let n_due = map.is_due.iter().filter(|due| **due).count();
        assert!((15..=25).contains(&n_due), "{n_due}");
        let values = vec![1.0; map.spots().len()];
        assert!(map.value_at(&Vec3::zeros(), &Vec3::z(), &values).is_some());
        assert!(map.value_at(&Vec3::zeros(), &-Vec3::z(), &values).is_none());
        assert!(
            map.value_at(&Vec3::new(0.0, 0.05, 0.0), &Vec3::z(), &values)
                .is_none()
        );
    }

    #[test]
    fn the_number_of_spots_is_bounded_and_what_is_forgotten_is_counted() {
        let mut map = PalpationMap::default();
        for k in 0..MOST_SPOTS + 10 {
            let at = Vec3::new((k % 100) as f64 * 2e-3, (k / 100) as f64 * 2e-3, 0.0);
            map.leave(&touch(at, 100.0));
        }
        assert_eq!((map.spots().len(), map.n_forgotten()), (MOST_SPOTS, 10));
    }
}
