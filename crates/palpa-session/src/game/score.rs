//! Marks and lumps, and the score.

use palpa_viewer::control::Score;

/// Distance from the rim of a lump, seen from the skin, within which a mark counts as found, m.
const GRACE: f64 = 5e-3;
/// A part of the score has all its points up to this time (s) and number of presses for each lump, and this force (N).
/// Beyond, its points fall in inverse proportion.
const QUICK: f64 = 60.0;
const FEW: f64 = 15.0;
const GENTLE: f64 = 2.0;
/// The area's part has all its points from this share on. Below, its points are in proportion.
const WHOLE: f64 = 0.5;
/// Points of each part.
const PART: f64 = 25.0;

/// Largest distance of a mark, along the skin, that finds a lump of this radius, m.
pub(super) fn tolerance(radius: f64) -> f64 {
    radius + GRACE
}

/// Numbers of a round for its score.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tally {
    pub(super) n_lumps: u32,
    pub(super) n_found: u32,
    pub(super) n_marks: u32,
    pub(super) seconds: f64,
    pub(super) max_force: f64,
    pub(super) n_presses: u32,
    /// Share of the area, 0 to 1.
    pub(super) covered: f64,
}

/// The score of a round. Without a press or a found lump there is none.
pub(super) fn score(tally: &Tally) -> Score {
    if tally.n_presses == 0 {
        return Score::default();
    }
    let n = f64::from(tally.n_lumps);
    let part = |share: f64| (PART * share.clamp(0.0, 1.0)).round() as u32;
    let [time, force, presses, area] = [
        part(QUICK * n / tally.seconds.max(f64::MIN_POSITIVE)),
        part(GENTLE / tally.max_force.max(f64::MIN_POSITIVE)),
        part(FEW * n / f64::from(tally.n_presses)),
        part(tally.covered / WHOLE),
    ];
    let share = f64::from(tally.n_found) / f64::from(tally.n_lumps.max(tally.n_marks).max(1));
    Score {
        total: (share * f64::from(time + force + presses + area)).round() as u32,
        time,
        force,
        presses,
        area,
    }
}

/// The mark of each lump: one to one, the nearest pair first. `distances` has a row for each lump and
/// a column for each mark, m; none where there is no way.
pub(super) fn matched(distances: &[Vec<Option<f64>>]) -> Vec<Option<usize>> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, row) in distances.iter().enumerate() {
        for (j, distance) in row.iter().enumerate() {
            pairs.extend(distance.map(|d| (d, i, j)));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut marks = vec![None; distances.len()];
    for (_, i, j) in pairs {
        if marks[i].is_none() && !marks.contains(&Some(j)) {
            marks[i] = Some(j);
        }
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEST: Tally = Tally {
        n_lumps: 1,
        n_found: 1,
        n_marks: 1,
        seconds: 50.0,
        max_force: 1.5,
        n_presses: 12,
        covered: 0.6,
    };

    #[test]
    fn each_lump_gets_the_mark_that_was_meant_for_it() {
        let rows = |rows: &[&[f64]]| -> Vec<Vec<Option<f64>>> {
            (rows.iter())
                .map(|row| row.iter().map(|x| Some(*x)).collect())
                .collect()
        };
        let all = rows(&[&[28e-3, 100e-3, 5e-3], &[2e-3, 70e-3, 25e-3]]);
        assert_eq!(matched(&all), [Some(2), Some(0)]);
        assert_eq!(matched(&rows(&[&[28e-3], &[2e-3]])), [None, Some(0)]);
        assert_eq!(matched(&[vec![None, Some(0.1)], vec![]]), [Some(1), None]);
    }

    #[test]
    fn a_round_without_a_fault_has_all_points_and_each_part_falls_alone() {
        assert_eq!(score(&BEST).total, 100);
        let slow = score(&Tally {
            seconds: 120.0,
            ..BEST
        });
        assert_eq!((slow.time, slow.total), (13, 88));
        let hard = score(&Tally {
            max_force: 8.0,
            ..BEST
        });
        assert_eq!((hard.force, hard.total), (6, 81));
        let many = score(&Tally {
            n_presses: 60,
            ..BEST
        });
        assert_eq!((many.presses, many.total), (6, 81));
        let little = score(&Tally {
            covered: 0.1,
            ..BEST
        });
        assert_eq!((little.area, little.total), (5, 80));
    }

    #[test]
    fn nothing_found_scores_nothing_and_marks_at_random_do_not_pay() {
        assert_eq!(score(&Tally { n_found: 0, ..BEST }).total, 0);
        assert_eq!(score(&Tally { n_marks: 4, ..BEST }).total, 25);
        let half = Tally {
            n_lumps: 2,
            n_marks: 2,
            ..BEST
        };
        assert_eq!(score(&half).total, 50);
        let guessed = Tally {
            n_presses: 0,
            ..BEST
        };
        assert_eq!(score(&guessed), Score::default());
    }
}
