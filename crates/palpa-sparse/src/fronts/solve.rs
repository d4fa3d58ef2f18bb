//! Substitution with a factor, for one right side.

use super::Number;
use super::tree::{Half, Tree};

/// Memory that substitution needs and leaves nothing in.
#[derive(Debug)]
pub struct SolveScratch<T> {
    border: Vec<T>,
}

impl<T: Number> SolveScratch<T> {
    /// Scratch for a tree.
    pub fn new(tree: &Tree) -> Self {
        let most = tree
            .fronts
            .iter()
            .map(|f| f.border.len())
            .max()
            .unwrap_or(0);
        Self {
            border: vec![T::default(); most * tree.width],
        }
    }
}

/// Forward substitution through the fronts of a half: `x ← L⁻¹ x` there, and the later right sides are reduced. `x` is
/// ordered by elimination, for the whole body.
pub fn substitute<T: Number>(
    tree: &Tree,
    half: Half,
    panels: &impl AsRef<[T]>,
    x: &mut [T],
    scratch: &mut SolveScratch<T>,
) {
    let panels = panels.as_ref();
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            let b = tree.width;
            for front in &tree.fronts[tree.range(half)] {
                let (own, border) = (front.own.len() * b, front.border.len() * b);
                let height = own + border;
                let panel = &panels[front.panel..][..height * own];
                let first = front.own.start as usize * b;
                let sum = &mut scratch.border[..border];
                sum.fill(T::default());
                forward(panel, height, &mut x[first..first + own], sum);
                for (k, &p) in front.border.iter().enumerate() {
                    let x = &mut x[p as usize * b..][..b];
                    for (x, &s) in x.iter_mut().zip(&sum[k * b..][..b]) {
                        *x -= s;
                    }
                }
            }
        },
    );
}

/// Back substitution through the fronts of a half: `x ← L⁻ᵀ x` there, given the solution of the later columns.
pub fn back_substitute<T: Number>(
    tree: &Tree,
    half: Half,
    panels: &impl AsRef<[T]>,
    x: &mut [T],
    scratch: &mut SolveScratch<T>,
) {
    let panels = panels.as_ref();
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            let b = tree.width;
            for front in tree.fronts[tree.range(half)].iter().rev() {
                let (own, border) = (front.own.len() * b, front.border.len() * b);
                let height = own + border;
                let panel = &panels[front.panel..][..height * own];
                let first = front.own.start as usize * b;
                let later = &mut scratch.border[..border];
                for (k, &p) in front.border.iter().enumerate() {
                    later[k * b..][..b].copy_from_slice(&x[p as usize * b..][..b]);
                }
                backward(panel, height, &mut x[first..first + own], later);
            }
        },
    );
}

/// Columns that are taken together, so that what they change is read and written once.
const TOGETHER: usize = 4;

#[inline(always)]
fn forward<T: Number>(panel: &[T], height: usize, x: &mut [T], sum: &mut [T]) {
    let own = x.len();
    let mut j = 0;
    while j < own {
        let n = TOGETHER.min(own - j);
        for a in j..j + n {
            let column = &panel[a * height..][..height];
            x[a] = x[a] / column[a];
            for k in a + 1..j + n {
                let product = column[k] * x[a];
                x[k] -= product;
            }
        }
        if n == TOGETHER {
            let factors: [T; TOGETHER] = [x[j], x[j + 1], x[j + 2], x[j + 3]];
            let columns: [&[T]; TOGETHER] =
                std::array::from_fn(|a| &panel[(j + a) * height..][..height]);
            let rest = &mut x[j + n..];
            subtract(&columns.map(|c| &c[j + n..own]), factors, rest);
            add(&columns.map(|c| &c[own..]), factors, sum);
        } else {
            for a in j..j + n {
                let column = &panel[a * height..][..height];
                for (sum, &l) in sum.iter_mut().zip(&column[own..]) {
                    *sum += l * x[a];
                }
            }
        }
        j += n;
    }
}

#[inline(always)]
fn subtract<T: Number>(columns: &[&[T]; TOGETHER], f: [T; TOGETHER], x: &mut [T]) {
    let n = x.len();
    let c = columns.map(|c| &c[..n]);
    for k in 0..n {
        x[k] -= c[0][k] * f[0] + c[1][k] * f[1] + (c[2][k] * f[2] + c[3][k] * f[3]);
    }
}

#[inline(always)]
fn add<T: Number>(columns: &[&[T]; TOGETHER], f: [T; TOGETHER], x: &mut [T]) {
    let n = x.len();
    let c = columns.map(|c| &c[..n]);
    for k in 0..n {
        x[k] += c[0][k] * f[0] + c[1][k] * f[1] + (c[2][k] * f[2] + c[3][k] * f[3]);
    }
}

#[inline(always)]
fn backward<T: Number>(panel: &[T], height: usize, x: &mut [T], later: &[T]) {
    let own = x.len();
    for j in (0..own).rev() {
        let column = &panel[j * height..][..height];
        let (before, after) = x.split_at_mut(j + 1);
        let sum = dot(&column[own..], later) + dot(&column[j + 1..own], after);
        before[j] = (before[j] - sum) / column[j];
    }
}

/// A sum in so many lanes, so that it can be vectorised.
const LANES: usize = 32;

#[inline(always)]
fn dot<T: Number>(a: &[T], b: &[T]) -> T {
    let mut lanes = [T::default(); LANES];
    let (a, b) = (&a[..a.len().min(b.len())], &b[..a.len().min(b.len())]);
    let (a_chunks, b_chunks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let mut sum = T::default();
    for (&a, &b) in a_chunks.remainder().iter().zip(b_chunks.remainder()) {
        sum += a * b;
    }
    for (a, b) in a_chunks.zip(b_chunks) {
        for k in 0..LANES {
            lanes[k] += a[k] * b[k];
        }
    }
    let mut n = LANES;
    while n > 1 {
        n /= 2;
        for k in 0..n {
            lanes[k] = lanes[k] + lanes[k + n];
        }
    }
    sum + lanes[0]
}
