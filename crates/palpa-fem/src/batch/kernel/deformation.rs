//! Deformation of the wedges of a pair, and of its units: the two wedges and their mean.

#![expect(
    clippy::inline_always,
    clippy::needless_range_loop,
    reason = "one piece of arithmetic on several arrays, compiled in its caller with the machine's instructions"
)]

use super::algebra::{M3, V3, axpy, cofactor, dot};
use super::unit::NO_VOLUME;
use super::{LaneGroup, Lanes, Local, N_NODES, Row};

/// Deformation and change of volume of the two wedges at their points.
pub(super) struct Wedges<R> {
    /// Deformation gradients. `[wedge][point]`
    pub(super) f: [[M3<R>; 2]; 2],
    /// m³. `[wedge][point]`
    pub(super) volumes: [[R; 2]; 2],
    /// `Σ V (J − 1)` of each wedge, m³.
    pub(super) changes: [R; 2],
    /// `Σ V`, m³.
    pub(super) total: R,
    /// Least volume ratio of a point, at most 1.
    pub(super) least: R,
}

/// Volume changes of the wedges of a pair against each other, `½ κ V₀V₁/V (J₀ − J₁)²`.
pub(super) struct Apart<R> {
    /// What it adds to the pressures of the wedges, Pa.
    pub(super) pressures: [R; 2],
    /// `κ V/(V₀V₁)`, Pa/m³.
    pub(super) stiffness: R,
    /// `V_w/V`.
    shares: [R; 2],
}

impl<R: Lanes> Apart<R> {
    /// `V ∂v̄/∂u` and `V₀V₁/V ∂(J₀ − J₁)/∂u` from `V_w ∂J_w/∂u`, m².
    #[inline(always)]
    pub(super) fn gradients(&self, of_wedges: &[[V3<R>; N_NODES]; 2]) -> [[V3<R>; N_NODES]; 2] {
        let mut gradients = *of_wedges;
        for a in 0..N_NODES {
            for c in 0..3 {
                let [first, second] = [of_wedges[0][a][c], of_wedges[1][a][c]];
                gradients[0][a][c] = first + second;
                gradients[1][a][c] = self.shares[1] * first - self.shares[0] * second;
            }
        }
        gradients
    }
}

/// Nodes, gradients and deformation of a unit: N nodes, two depth points.
pub(super) struct Unit<R, const N: usize> {
    /// Gradients of the shape functions, 1/m. `[point][node]`
    pub(super) gradients: [[V3<R>; N]; 2],
    /// Deformation gradients. `[point]`
    pub(super) f: [M3<R>; 2],
    /// m³. `[point]`
    pub(super) volumes: [R; 2],
    /// Weight of its deviator, 0 to 1.
    pub(super) weight: R,
    /// First of its points.
    pub(super) point: usize,
    /// First of its nodes.
    pub(super) node: usize,
}

/// Gradient of displacements in a wedge at one of its points.
#[inline(always)]
fn gradient<R: Lanes>(
    group: &LaneGroup<'_, R>,
    w: usize,
    q: usize,
    displacements: &[[Row<R::Element>; 3]; N_NODES],
) -> M3<R> {
    let mut h = [[group.splat(0.0); 3]; 3];
    for n in 0..6 {
        let g = group.load3(&group.geometry.gradients[w][q][n]);
        let u = group.load3(&displacements[2 * w + n]);
        for r in 0..3 {
            h[r] = axpy(u[r], &g, &h[r]);
        }
    }
    h
}

impl<R: Lanes> Wedges<R> {
    #[inline(always)]
    pub(super) fn new(group: &LaneGroup<'_, R>, local: &Local<R::Element>) -> Self {
        let (zero, one) = (group.splat(0.0), group.splat(1.0));
        let geometry = group.geometry;
        let mut wedges = Self {
            f: [[[[zero; 3]; 3]; 2]; 2],
            volumes: [[zero; 2]; 2],
            changes: [zero; 2],
            total: zero,
            least: one,
        };
        for w in 0..2 {
            for q in 0..2 {
                let mut h = gradient(group, w, q, &local.displacements);
                for r in 0..3 {
                    h[r][r] = h[r][r] + one;
                }
                let volume = group.load(&geometry.volumes[w][q]);
                let j = dot(&h[0], &cofactor(&h)[0]);
                wedges.f[w][q] = h;
                wedges.volumes[w][q] = volume;
                wedges.least = wedges.least.min(j);
                wedges.changes[w] = volume.mul_add(j - one, wedges.changes[w]);
                wedges.total = wedges.total + volume;
            }
        }
        wedges
    }

    /// `Σ V (J − 1)` of both, m³.
    #[inline(always)]
    pub(super) fn change(&self) -> R {
        self.changes[0] + self.changes[1]
    }

    /// `Σ V (J − 1)` of each wedge, with `J` linear in the displacements since an earlier state, m³.
    #[inline(always)]
    pub(super) fn predicted_changes(
        &self,
        group: &LaneGroup<'_, R>,
        local: &Local<R::Element>,
    ) -> [R; 2] {
        let (zero, one) = (group.splat(0.0), group.splat(1.0));
        let mut changes = [zero; 2];
        for w in 0..2 {
            for q in 0..2 {
                let since = gradient(group, w, q, &local.since);
                let mut before = self.f[w][q];
                for r in 0..3 {
                    for c in 0..3 {
                        before[r][c] = before[r][c] - since[r][c];
                    }
                }
                let cof = cofactor(&before);
                let mut j = dot(&before[0], &cof[0]);
                for r in 0..3 {
                    j = j + dot(&cof[r], &since[r]);
                }
                changes[w] = self.volumes[w][q].mul_add(j - one, changes[w]);
            }
        }
        changes
    }

    /// What the wedges have against changing their volumes against each other; `stiffness` is that of
    /// the pair to it, Pa. A single prism has none.
    #[inline(always)]
    pub(super) fn apart(
        &self,
        group: &LaneGroup<'_, R>,
        stiffness: R,
        changes: &[R; 2],
    ) -> Apart<R> {
        let (zero, one) = (group.splat(0.0), group.splat(1.0));
        let none = group.splat(NO_VOLUME);
        let volumes = [0, 1].map(|w| self.volumes[w][0] + self.volumes[w][1]);
        let second = volumes[1].select_less(none, one, volumes[1]);
        let stiffness = volumes[1].select_less(none, zero, stiffness);
        let shares = volumes.map(|volume| volume.divided_by(self.total));
        let apart = changes[0].divided_by(volumes[0]) - changes[1].divided_by(second);
        let pull = stiffness * apart;
        Apart {
            pressures: [shares[1] * pull, zero - shares[0] * pull],
            stiffness: stiffness.divided_by(shares[0]).divided_by(second),
            shares,
        }
    }

    /// One of the wedges as a unit.
    #[inline(always)]
    pub(super) fn wedge(&self, group: &LaneGroup<'_, R>, w: usize, weight: R) -> Unit<R, 6> {
        let mut gradients = [[[group.splat(0.0); 3]; 6]; 2];
        for q in 0..2 {
            for n in 0..6 {
                gradients[q][n] = group.load3(&group.geometry.gradients[w][q][n]);
            }
        }
        Unit {
            gradients,
            f: self.f[w],
            volumes: self.volumes[w],
            weight,
            point: 2 + 2 * w,
            node: 2 * w,
        }
    }

    /// The mean of both wedges as a unit.
    #[inline(always)]
    pub(super) fn mean(&self, group: &LaneGroup<'_, R>, weight: R) -> Unit<R, N_NODES> {
        let zero = group.splat(0.0);
        let (volumes, shares) = self.shares(group.splat(1.0));
        let mut gradients = [[[zero; 3]; N_NODES]; 2];
        for q in 0..2 {
            for w in 0..2 {
                for n in 0..6 {
                    let g = group.load3(&group.geometry.gradients[w][q][n]);
                    gradients[q][2 * w + n] = axpy(shares[w][q], &g, &gradients[q][2 * w + n]);
                }
            }
        }
        Unit {
            gradients,
            f: self.mean_deformation(zero, &shares),
            volumes,
            weight,
            point: 0,
            node: 0,
        }
    }

    /// Volumes of both wedges together at the two depths, m³, and each wedge's share of them.
    /// `[point]`, `[wedge][point]`
    #[inline(always)]
    pub(super) fn shares(&self, one: R) -> ([R; 2], [[R; 2]; 2]) {
        let volumes = &self.volumes;
        let (mut sums, mut shares) = ([one; 2], [[one; 2]; 2]);
        for q in 0..2 {
            sums[q] = volumes[0][q] + volumes[1][q];
            let inverse = one.divided_by(sums[q]);
            for w in 0..2 {
                shares[w][q] = volumes[w][q] * inverse;
            }
        }
        (sums, shares)
    }

    /// Mean deformation gradients at the two depths.
    #[inline(always)]
    pub(super) fn mean_deformation(&self, zero: R, shares: &[[R; 2]; 2]) -> [M3<R>; 2] {
        let mut mean = [[[zero; 3]; 3]; 2];
        for q in 0..2 {
            for w in 0..2 {
                for r in 0..3 {
                    mean[q][r] = axpy(shares[w][q], &self.f[w][q][r], &mean[q][r]);
                }
            }
        }
        mean
    }
}
