//! The multifrontal factor: whole and by zones, in both precisions, against a dense Cholesky
//! factor.

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use palpa_sparse::fronts::{
    Compliance, Exterior, FactorScratch, FarCompliance, Half, Number, Push, SolveScratch, Tree,
    Zone, back_substitute, back_substitute_to, fronts_above, least_pivot, substitute,
};
use palpa_sparse::{Block, ColumnPattern};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

/// Numbers between −0.5 and 0.5, the same in each run.
struct Noise(fastrand::Rng);

impl Noise {
    fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    fn next(&mut self) -> f64 {
        self.0.f64() - 0.5
    }
}

/// A grid of columns with diagonals, some twice as dense, on a plane or closed to a tube.
struct Case {
    pattern: ColumnPattern,
    places: Vec<[f64; 3]>,
    edges: Vec<(usize, usize)>,
    zone: Vec<bool>,
}

fn case(nx: usize, ny: usize, n_levels: usize, is_tube: bool, zone_radius: f64) -> Case {
    let mut noise = Noise::new(3);
    let places: Vec<[f64; 3]> = (0..nx * ny)
        .map(|c| {
            let (x, y) = ((c % nx) as f64, (c / nx) as f64);
            if is_tube {
                let angle = y / ny as f64 * std::f64::consts::TAU;
                [x, 2.0 * angle.cos(), 2.0 * angle.sin()]
            } else {
                [x + 0.3 * noise.next(), y + 0.3 * noise.next(), 0.0]
            }
        })
        .collect();
    let mut edges = Vec::new();
    for y in 0..ny {
        for x in 0..nx {
            let c = y * nx + x;
            let up = if y + 1 < ny {
                Some((y + 1) * nx)
            } else {
                is_tube.then_some(0)
            };
            if x + 1 < nx {
                edges.push((c, c + 1));
            }
            if let Some(up) = up {
                edges.push((c, up + x));
                if x + 1 < nx {
                    edges.push((up + x + 1, c));
                }
            }
        }
    }
    let middle = places[(ny / 2) * nx + nx / 2];
    let zone = places
        .iter()
        .map(|p| (0..3).map(|i| (p[i] - middle[i]).powi(2)).sum::<f64>() <= zone_radius.powi(2))
        .collect();
    Case {
        pattern: ColumnPattern::new(nx * ny, n_levels, edges.iter().copied()),
        places,
        edges,
        zone,
    }
}

/// Blocks of the zone, then of the exterior: springs of random stiffness between nodes,
/// and to the ground.
fn blocks(case: &Case, seed: u64) -> [Vec<Block<f64>>; 2] {
    let pattern = &case.pattern;
    let n = pattern.n_levels();
    let mut noise = Noise::new(seed);
    let mut parts = [
        vec![[0.0; 9]; pattern.n_blocks()],
        vec![[0.0; 9]; pattern.n_blocks()],
    ];
    let spring = |noise: &mut Noise| -> Block<f64> {
        let d = [noise.next(), noise.next(), noise.next()];
        std::array::from_fn(|i| d[i % 3] * d[i / 3] + if i % 4 == 0 { 0.05 } else { 0.0 })
    };
    let mut add = |a: (usize, usize), b: Option<(usize, usize)>, noise: &mut Noise| {
        let k = spring(noise);
        let is_inside = case.zone[a.0] && b.is_none_or(|b| case.zone[b.0]);
        let part = &mut parts[usize::from(!is_inside)];
        let mut put = |at: usize, sign: f64| {
            for i in 0..9 {
                part[at][i] += sign * k[i];
            }
        };
        put(pattern.own(a.0) + 2 * a.1, 1.0);
        let Some(b) = b else { return };
        put(pattern.own(b.0) + 2 * b.1, 1.0);
        if a.0 == b.0 {
            put(pattern.own(a.0) + 2 * a.1.min(b.1) + 1, -1.0);
        } else {
            let (row, column) = if a.0 > b.0 { (a, b) } else { (b, a) };
            let pair = pattern.find(row.0, column.0).unwrap();
            put(
                pattern.between(pair) + 3 * column.1 + row.1 + 1 - column.1,
                -1.0,
            );
        }
    };
    for c in 0..pattern.n_columns() {
        for l in 0..n {
            if l + 1 == n {
                add((c, l), None, &mut noise);
            } else {
                add((c, l), Some((c, l + 1)), &mut noise);
            }
        }
    }
    for &(a, b) in &case.edges {
        for l in 0..n {
            for k in l.saturating_sub(1)..(l + 2).min(n) {
                add((a, l), Some((b, k)), &mut noise);
            }
        }
    }
    parts
}

fn dense(pattern: &ColumnPattern, parts: &[Vec<Block<f64>>; 2]) -> Mat<f64> {
    let (n, b) = (pattern.n_levels(), pattern.width());
    let mut matrix = Mat::zeros(pattern.n_dofs(), pattern.n_dofs());
    let mut put = |row: usize, column: usize, at: usize| {
        for part in parts {
            for (i, value) in part[at].iter().enumerate() {
                let (r, c) = (row + i % 3, column + i / 3);
                matrix[(r, c)] += value;
                if row != column {
                    matrix[(c, r)] += value;
                }
            }
        }
    };
    for c in 0..pattern.n_columns() {
        for l in 0..n {
            put(b * c + 3 * l, b * c + 3 * l, pattern.own(c) + 2 * l);
            if l + 1 < n {
                put(b * c + 3 * l + 3, b * c + 3 * l, pattern.own(c) + 2 * l + 1);
            }
        }
    }
    for pair in 0..pattern.n_pairs() {
        let [row, column] = pattern.pair(pair).map(|c| c as usize);
        for l in 0..n {
            for k in l.saturating_sub(1)..(l + 2).min(n) {
                put(
                    b * row + 3 * k,
                    b * column + 3 * l,
                    pattern.between(pair) + 3 * l + k + 1 - l,
                );
            }
        }
    }
    matrix
}

fn narrow<T: Number>(blocks: &[Block<f64>]) -> Vec<Block<T>> {
    blocks.iter().map(|b| b.map(T::nearest)).collect()
}

/// Every seventh column of the exterior, and the fronts above them.
fn few_columns(tree: &Tree, pattern: &ColumnPattern) -> (Vec<u32>, Vec<bool>) {
    let few: Vec<u32> = (0..pattern.n_columns() as u32)
        .filter(|&c| tree.first_dof(c as usize) < tree.first_zone_dof() && c % 7 == 0)
        .collect();
    let wanted = fronts_above(tree, Half::Exterior, few.iter().copied());
    assert!(few.is_empty() || wanted.contains(&true));
    (few, wanted)
}

fn assert_same<T: Number>(tree: &Tree, pattern: &ColumnPattern, columns: &[u32], a: &[T], b: &[T]) {
    for &c in columns {
        let first = tree.first_dof(c as usize);
        let dofs = first..first + pattern.width();
        assert!(a[dofs.clone()] == b[dofs], "column {c}");
    }
}

/// A force on every second column.
fn every_second<T: Number>(pattern: &ColumnPattern) -> Vec<Push<T>> {
    (0..pattern.n_columns() as u32)
        .rev()
        .step_by(2)
        .enumerate()
        .map(|(i, column)| Push {
            column,
            level: i as u32 % pattern.n_levels() as u32,
            direction: [0.6, 0.0, -0.8].map(T::nearest),
        })
        .collect()
}

/// One column for each force.
fn unit_forces<T: Number>(pattern: &ColumnPattern, pushes: &[Push<T>]) -> Mat<f64> {
    Mat::from_fn(pattern.n_dofs(), pushes.len(), |i, j| {
        let push = &pushes[j];
        let first = push.column as usize * pattern.width() + 3 * push.level as usize;
        if (first..first + 3).contains(&i) {
            push.direction[i - first].wide()
        } else {
            0.0
        }
    })
}

/// Those of the forces that are on the exterior, as a right side.
fn outer_forces<T: Number>(case: &Case, tree: &Tree, pushes: &[Push<T>], forces: &[T]) -> Vec<T> {
    let mut right = vec![T::default(); case.pattern.n_dofs()];
    let outer = |push: &Push<T>| !case.zone[push.column as usize];
    for (push, &force) in pushes.iter().zip(forces).filter(|(push, _)| outer(push)) {
        for (d, direction) in push.direction.iter().enumerate() {
            let dof = tree.first_dof(push.column as usize) + 3 * push.level as usize + d;
            right[dof] = *direction * force;
        }
    }
    right
}

/// Everything that a factor is asked for, against the dense one: the largest relative errors of a
/// solution and of W.
fn errors<T: Number>(case: &Case, tree: &Tree) -> [f64; 2] {
    let pattern = &case.pattern;
    let n = pattern.n_dofs();
    let mut exterior = Exterior::<T>::new(tree);
    let mut zone = Zone::<T>::new(tree);
    let mut outside = FactorScratch::new(tree, Half::Exterior);
    let mut inside = FactorScratch::new(tree, Half::Zone);
    let mut solve = SolveScratch::new(tree);
    let pushes = every_second(pattern);
    let m = pushes.len();
    let is_far = |push: &Push<T>| !case.zone[push.column as usize];
    let n_far = pushes.iter().filter(|push| is_far(push)).count();
    let mut compliance = Compliance::<T>::new(tree, m);
    let mut far = FarCompliance::<T>::new(tree, n_far);
    let mut w = vec![T::default(); m * m];
    // Forces that are added after the forward substitution.
    let later: Vec<T> = (0..m).map(|i| T::nearest(0.1 * i as f64 - 0.3)).collect();
    let mut projected = vec![T::default(); m];
    let mut worst = [0.0_f64; 2];
    let [_, rest] = blocks(case, 1);
    let mut late = outer_forces(case, tree, &pushes, &later);
    // The zone's numbers change; the exterior is factored once.
    for (round, seed) in [1, 5].into_iter().enumerate() {
        let [inner, _] = blocks(case, seed);
        let whole = dense(pattern, &[inner.clone(), rest.clone()]);
        let oracle = whole.llt(Side::Lower).unwrap();
        let mut noise = Noise::new(9);
        // Without forces on the exterior, what is projected on a force there is complete.
        let has_outer = round == 0;
        let force = Mat::from_fn(n, 1, |i, _| {
            if has_outer || case.zone[i / pattern.width()] {
                noise.next()
            } else {
                0.0
            }
        });
        let unit = unit_forces(pattern, &pushes);
        let all = Mat::from_fn(n, 1, |i, _| {
            (0..m).fold(force[(i, 0)], |sum, j| sum + unit[(i, j)] * later[j].wide())
        });
        let expected = oracle.solve(&all);
        let expected_projected = unit.transpose() * oracle.solve(&force);
        let expected_w = unit.transpose() * oracle.solve(&unit);
        let (inner, outer) = (narrow::<T>(&inner), narrow::<T>(&rest));
        let mut x = vec![T::default(); n];
        for c in 0..pattern.n_columns() {
            for d in 0..pattern.width() {
                x[tree.first_dof(c) + d] = T::nearest(force[(c * pattern.width() + d, 0)]);
            }
        }
        let (few, wanted) = few_columns(tree, pattern);
        let mut part = x.clone();
        let mut run = || {
            if round == 0 {
                exterior.factor(tree, &outer, &mut outside).unwrap();
                substitute(tree, Half::Exterior, &exterior, &mut late, &mut solve);
                far.compute(tree, &exterior, &pushes);
            }
            zone.factor(tree, &inner, Some(&exterior), &mut inside)
                .unwrap();
            substitute(tree, Half::Exterior, &exterior, &mut x, &mut solve);
            substitute(tree, Half::Zone, &zone, &mut x, &mut solve);
            compliance.compute(tree, &zone, Some(&far), &pushes, &mut w);
            compliance.project(tree, &x, &mut projected);
            compliance.add(tree, &later, &mut x);
            let outer = tree.first_zone_dof();
            (x[..outer].iter_mut().zip(&late)).for_each(|(x, late)| *x += *late);
            back_substitute(tree, Half::Zone, &zone, &mut x, &mut solve);
            part.copy_from_slice(&x);
            back_substitute(tree, Half::Exterior, &exterior, &mut x, &mut solve);
            let only = Some(&wanted[..]);
            back_substitute_to(tree, Half::Exterior, only, &exterior, &mut part, &mut solve);
        };
        if round == 0 {
            // The first products make faer's own scratch.
            run();
        } else {
            assert_no_alloc(run);
        }
        assert_same(tree, pattern, &few, &part, &x);
        let mut error = 0.0_f64;
        for c in 0..pattern.n_columns() {
            for d in 0..pattern.width() {
                let difference =
                    x[tree.first_dof(c) + d].wide() - expected[(c * pattern.width() + d, 0)];
                error = error.max(difference.abs());
            }
        }
        worst[0] = worst[0].max(error / expected.norm_max());
        let (mut error, mut size) = (0.0_f64, 0.0_f64);
        for j in 0..m {
            if !has_outer || !is_far(&pushes[j]) {
                let difference = projected[j].wide() - expected_projected[(j, 0)];
                worst[0] = worst[0].max(difference.abs() / expected_projected.norm_max());
            }
            for i in 0..m {
                error = error.max((w[i + m * j].wide() - expected_w[(i, j)]).abs());
                size = size.max(expected_w[(i, j)].abs());
            }
        }
        worst[1] = worst[1].max(error / size);
    }
    worst
}

#[test]
fn a_zone_is_factored_on_a_kept_exterior_as_the_whole_would_be() {
    for (name, case) in [
        ("grid, zone in the middle", case(13, 11, 3, false, 3.2)),
        ("grid, small zone", case(9, 9, 4, false, 1.2)),
        ("tube", case(14, 12, 2, true, 3.0)),
        ("zone of one column's star", case(6, 5, 1, false, 1.5)),
        ("nothing but a zone", case(7, 6, 3, false, 100.0)),
    ] {
        let zone_last = Tree::zone_last(&case.pattern, &case.places, &case.zone).unwrap();
        let [x, w] = errors::<f64>(&case, &zone_last);
        assert!(x < 1e-11 && w < 1e-11, "{name}: {x:e} {w:e}");
        let [x, w] = errors::<f32>(&case, &zone_last);
        assert!(x < 1e-3 && w < 1e-3, "{name}, single: {x:e} {w:e}");
    }
}

#[test]
fn the_work_of_a_zone_is_a_small_part_of_the_whole() {
    let case = case(30, 30, 4, false, 5.0);
    let whole = Tree::whole(&case.pattern, &case.places).unwrap();
    let zone = Tree::zone_last(&case.pattern, &case.places, &case.zone).unwrap();
    assert!(whole.flops(Half::Exterior) == 0.0);
    assert_eq!(whole.n_zone_columns(), 900);
    assert!(zone.n_zone_columns() < 100 && zone.n_ring_columns() < 40);
    let share = zone.flops(Half::Zone) / whole.flops(Half::Zone);
    assert!(share < 0.15, "{share}");
}

/// The exterior surrounds its zone, whose ring is eliminated last: a short cut that leaves the whole ring on one
/// side is a bad one. The shortest cuts near the middle need a quarter more.
#[test]
fn cuts_of_an_exterior_look_at_the_work_behind_them() {
    let case = case(30, 30, 4, false, 5.0);
    let tree = Tree::zone_last(&case.pattern, &case.places, &case.zone).unwrap();
    let flops = tree.flops(Half::Exterior);
    assert!(flops < 5.2e8, "{flops:e}");
}

#[test]
fn memory_of_one_exterior_serves_another() {
    let small = case(12, 12, 2, false, 4.5);
    let large = case(12, 12, 2, false, 2.0);
    let tree = |case: &Case| Tree::zone_last(&case.pattern, &case.places, &case.zone).unwrap();
    let trees = [tree(&small), tree(&large), tree(&small)];
    let mut reused = Exterior::<f64>::new(&trees[0]);
    let mut scratch = FactorScratch::new(&trees[0], Half::Exterior);
    for (case, tree) in [&small, &large, &small].into_iter().zip(&trees) {
        let [inner, outer] = blocks(case, 2);
        reused.fit(tree);
        scratch.fit(tree, Half::Exterior);
        reused.factor(tree, &outer, &mut scratch).unwrap();
        let mut fresh = Exterior::<f64>::new(tree);
        let mut own = FactorScratch::new(tree, Half::Exterior);
        fresh.factor(tree, &outer, &mut own).unwrap();
        let solved = [&reused, &fresh].map(|exterior| {
            let (mut zone, mut solve) = (Zone::<f64>::new(tree), SolveScratch::new(tree));
            let mut inside = FactorScratch::new(tree, Half::Zone);
            zone.factor(tree, &inner, Some(exterior), &mut inside)
                .unwrap();
            let mut x = vec![1.0; case.pattern.n_dofs()];
            substitute(tree, Half::Exterior, exterior, &mut x, &mut solve);
            substitute(tree, Half::Zone, &zone, &mut x, &mut solve);
            back_substitute(tree, Half::Zone, &zone, &mut x, &mut solve);
            back_substitute(tree, Half::Exterior, exterior, &mut x, &mut solve);
            x
        });
        assert_eq!(solved[0], solved[1]);
        assert!(solved[0].iter().all(|x| x.is_finite()));
    }
}

#[test]
fn a_matrix_that_is_not_positive_definite_is_refused() {
    let case = case(6, 6, 2, false, 2.0);
    let tree = Tree::zone_last(&case.pattern, &case.places, &case.zone).unwrap();
    let [mut inner, mut outer] = blocks(&case, 1);
    let mut exterior = Exterior::<f64>::new(&tree);
    let mut outside = FactorScratch::new(&tree, Half::Exterior);
    exterior.factor(&tree, &outer, &mut outside).unwrap();
    let mut zone = Zone::<f64>::new(&tree);
    let mut inside = FactorScratch::new(&tree, Half::Zone);
    let middle = case.zone.iter().position(|&z| z).unwrap();
    for bad in [-100.0, f64::NAN] {
        inner[case.pattern.own(middle)][0] = bad;
        assert!(
            zone.factor(&tree, &inner, Some(&exterior), &mut inside)
                .is_err(),
            "{bad}"
        );
        outer[case.pattern.own(0)][0] = bad;
        assert!(
            exterior.factor(&tree, &outer, &mut outside).is_err(),
            "{bad}"
        );
    }
}

#[test]
fn a_matrix_that_is_not_positive_definite_is_raised_until_it_is() {
    let case = case(6, 6, 2, false, 2.0);
    let tree = Tree::zone_last(&case.pattern, &case.places, &case.zone).unwrap();
    let [mut inner, outer] = blocks(&case, 1);
    let mut exterior = Exterior::<f64>::new(&tree);
    let mut outside = FactorScratch::new(&tree, Half::Exterior);
    exterior.factor(&tree, &outer, &mut outside).unwrap();
    let mut inside = FactorScratch::new(&tree, Half::Zone);
    let mut raised = Zone::<f64>::new(&tree);
    let kept = Some(&exterior);
    // Where there is nothing to raise, the factor is the same.
    let mut plain = Zone::<f64>::new(&tree);
    plain.factor(&tree, &inner, kept, &mut inside).unwrap();
    let n = raised.factor_raised(&tree, &inner, kept, &mut inside);
    assert_eq!(n, Ok(0));
    let pivots = |zone: &Zone<f64>, inner: &[Block<f64>]| {
        let [own, rest] = [inner, &outer[..]].map(|blocks| diagonal(&case.pattern, &tree, blocks));
        let both: Vec<f64> = own.iter().zip(rest).map(|(a, b)| a + b).collect();
        least_pivot(&tree, Half::Zone, zone, &both)
    };
    assert_eq!(
        pivots(&raised, &inner).to_bits(),
        pivots(&plain, &inner).to_bits()
    );
    // One unknown pulls the wrong way: the fronts with it are raised.
    let middle = case.zone.iter().position(|&z| z).unwrap();
    inner[case.pattern.own(middle)][0] *= -1.0;
    assert!(plain.factor(&tree, &inner, kept, &mut inside).is_err());
    let n = (raised.factor_raised(&tree, &inner, kept, &mut inside)).unwrap();
    assert!((1..case.pattern.n_dofs()).contains(&n), "{n} were raised");
    assert!(pivots(&raised, &inner).abs() > 1e-3);
    inner[case.pattern.own(middle)][0] = f64::NAN;
    let n = raised.factor_raised(&tree, &inner, kept, &mut inside);
    assert!(n.is_err(), "{n:?}");
}

/// The diagonal of a matrix, in the order of elimination.
fn diagonal(pattern: &ColumnPattern, tree: &Tree, blocks: &[Block<f64>]) -> Vec<f64> {
    let mut diagonal = vec![0.0; pattern.n_dofs()];
    for v in 0..pattern.n_columns() {
        for l in 0..pattern.n_levels() {
            let block = &blocks[pattern.own(v) + 2 * l];
            let first = tree.first_dof(v) + 3 * l;
            diagonal[first..first + 3].copy_from_slice(&[block[0], block[4], block[8]]);
        }
    }
    diagonal
}

/// The numbers of a factor and of a solution, of a tree large enough to have branches.
fn numbers(case: &Case, tree: &Tree, in_parallel: bool) -> (Vec<f64>, Vec<f64>) {
    let scratch = |half| {
        if in_parallel {
            FactorScratch::in_parallel(tree, half)
        } else {
            FactorScratch::new(tree, half)
        }
    };
    let mut solve = if in_parallel {
        SolveScratch::in_parallel(tree)
    } else {
        SolveScratch::new(tree)
    };
    let [inner, outer] = blocks(case, 3);
    let (mut exterior, mut zone) = (Exterior::<f64>::new(tree), Zone::<f64>::new(tree));
    exterior
        .factor(tree, &outer, &mut scratch(Half::Exterior))
        .unwrap();
    zone.factor(tree, &inner, Some(&exterior), &mut scratch(Half::Zone))
        .unwrap();
    let mut noise = Noise::new(4);
    let mut x: Vec<f64> = (0..case.pattern.n_dofs()).map(|_| noise.next()).collect();
    substitute(tree, Half::Exterior, &exterior, &mut x, &mut solve);
    substitute(tree, Half::Zone, &zone, &mut x, &mut solve);
    back_substitute(tree, Half::Zone, &zone, &mut x, &mut solve);
    back_substitute(tree, Half::Exterior, &exterior, &mut x, &mut solve);
    let panels = [exterior.as_ref(), zone.as_ref()].concat();
    (panels, x)
}

#[test]
fn branches_that_are_computed_at_the_same_time_give_the_same_factor() {
    let case = case(44, 40, 3, true, 9.0);
    let tree = Tree::zone_last(&case.pattern, &case.places, &case.zone).unwrap();
    assert!(tree.n_branches() > 4, "{}", tree.n_branches());
    let (factor, x) = numbers(&case, &tree, false);
    let (same_factor, same_x) = numbers(&case, &tree, true);
    assert_eq!(factor, same_factor);
    let size = x.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let difference = x.iter().zip(&same_x).map(|(a, b)| (a - b).abs());
    let worst = difference.fold(0.0, f64::max);
    assert!(worst < 1e-12 * size, "{worst:e} of {size}");
    // The sums do not depend on the number of threads.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let (_, alone) = one.unwrap().install(|| numbers(&case, &tree, true));
    assert_eq!(same_x, alone);
}
