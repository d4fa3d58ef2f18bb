//! The element of [`crate::element`] in lanes: sixteen pairs of prisms of one interval at once.
//!
//! The same energy, written first for laws in the first isochoric invariant, `W = w(x)`, `x =
//! Jb^(−2/3) |F^|² − 3`. All derivatives by `δF` go through the two `δJ_p`, so that the stiffness
//! of a unit (two depth points, N nodes) is
//!
//! ```text
//! K_ab = Σ_q (G^_a · B_q G^_b) I − Σ_q (g_q/J_q) [j_a,q × j_b,q]×  +  Σ_p (j_a,p ⊗ y_b,p + y_a,p ⊗ j_b,p)
//!        + Σ_q w'' V_q ψ_a,q ⊗ ψ_b,q
//!
//! G^ = AᵀG,  j = cof(F) G = ∂J/∂u,  B = 2 V w' Jb^(−2/3) I + V S,  T = F^ B,  A = I + (s − 1) M ⊗ m
//! k = T m · F M,   β = Σ_q (k_q/J_q + b'_q n_q/2),   g_q = v_q β − k_q s_q/J_q,   n = |F^|²,  b' = −2 b/(3 Jb)
//! σ_qp = (v_p − δ_qp s_q)/J_q    (δs_q = Σ_p σ_qp δJ_p)
//! y_a,p = Σ_q [σ_qp (F M (m · B G^_a) + T m (M · G_a)) + v_p b'_q F^ G^_a] + ½ Σ_r D_pr j_a,r
//! ```
//! where `b = 2 V w' Jb^(−2/3)` and `D` collects the terms quadratic in `δJ`. Laws in principal
//! stretches (`principal.rs`) have no `w`: their stress is part of `S`, and `Σ_q V_q ε_a,q : ∂S/∂E
//! : ε_b,q` takes the place of the last sum, with `ε` the strain that goes with a node's
//! displacement. Derivation: `docs/theory/paired_prism.md`.
//!
//! | file | what it computes |
//! | --- | --- |
//! | `mod` | forces and stiffness of a batch ([`LaneGroup::evaluate`]), and the stress that a memory keeps ([`LaneGroup::elastic`]) |
//! | `deformation` | deformation of wedges and units |
//! | `unit` | volume ratios, law and forces of one unit |
//! | `tangent` | stiffness of one unit |
//! | `algebra` | small vectors and matrices in lanes |

#![expect(
    clippy::inline_always,
    clippy::needless_range_loop,
    reason = "one piece of arithmetic on several arrays, compiled in its caller with the machine's instructions"
)]

mod algebra;
mod deformation;
mod tangent;
mod unit;

use super::lanes::Lanes;
use super::principal::{PLACES, Six, respond};
use crate::law::Hardening;
use algebra::{cauchy_green, cofactor, inv_cbrt};
use deformation::Wedges;
use unit::{NO_VOLUME, OfVolume, Sums, VolumeChange};

pub(super) use algebra::{M3, V3, axpy, dot, mul, scale};

/// Pairs in a batch.
pub(super) const WIDTH: usize = 16;
/// Local nodes: those of column c are 2 c (upper) and 2 c + 1 (lower); columns 0, 1, 2 are the
/// first wedge's, 1, 2, 3 the second's.
pub(super) const N_NODES: usize = 8;
/// Pairs of nodes a ≥ b, at `a (a + 1)/2 + b`.
pub(super) const N_BLOCKS: usize = 36;
/// Six points: two of the pair's mean, two of each wedge.
pub(super) const N_POINTS: usize = 6;

/// A number for each pair of a batch.
pub(super) type Row<E> = [E; WIDTH];

/// Rest shape of a batch.
#[derive(Debug, Clone)]
pub(super) struct Geometry<E> {
    /// Gradients of the shape functions, 1/m. `[wedge][point][node of the wedge][component]`
    pub(super) gradients: [[[[Row<E>; 3]; 6]; 2]; 2],
    /// Volumes of the points, m³. `[wedge][point]`
    pub(super) volumes: [[Row<E>; 2]; 2],
    /// `M`, along the thickness, m.
    pub(super) thickness: [Row<E>; 3],
    /// `m`, its gradient, 1/m.
    pub(super) thickness_gradient: [Row<E>; 3],
    /// Share of the pair's mean deviator; 0 for a single prism.
    pub(super) alpha: Row<E>,
}

/// Stiffness of a batch's materials in this step.
#[derive(Debug, Clone)]
pub(super) struct Stiffness<E> {
    /// Half the shear modulus at the points at rest, Pa; `w'` of laws in the first invariant.
    pub(super) slope: [Row<E>; N_POINTS],
    /// Bulk modulus, Pa.
    pub(super) bulk: Row<E>,
    /// What the wedges have against changing their volumes against each other, Pa.
    pub(super) apart: Row<E>,
}

/// Constant stresses of a batch: `xx, yy, zz, xy, yz, zx` at the points, and pressure, Pa.
#[derive(Debug, Clone)]
pub(super) struct Constant<E> {
    pub(super) stress: [[Row<E>; 6]; N_POINTS],
    pub(super) pressure: Row<E>,
}

/// The pressure of the volume that counts in an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PressureKind {
    Own,
    /// None at all.
    None,
    /// That of the volume predicted from an earlier state: linear in [`Local::since`].
    Predicted,
}

/// Displacements in, forces and stiffness out, of one batch.
#[derive(Debug)]
pub(super) struct Local<E> {
    /// `[node][component]`, m
    pub(super) displacements: [[Row<E>; 3]; N_NODES],
    /// Displacements since an earlier state, m; see [`PressureKind::Predicted`]. `[node][component]`
    pub(super) since: [[Row<E>; 3]; N_NODES],
    /// `∂W/∂u`, N
    pub(super) forces: [[Row<E>; 3]; N_NODES],
    /// `∂²W/∂u_a∂u_b`, entry (r, c) at `3 r + c`, N/m
    pub(super) stiffness: [[Row<E>; 9]; N_BLOCKS],
    /// Least volume ratio of each pair's points.
    pub(super) least: Row<E>,
}

/// The lanes of a batch that are computed together: those from `at` on, as many as a vector of the
/// machine has.
pub(super) struct LaneGroup<'a, R: Lanes> {
    token: R::Token,
    at: usize,
    geometry: &'a Geometry<R::Element>,
    material: &'a Stiffness<R::Element>,
    constant: Option<&'a Constant<R::Element>>,
    hardening: Hardening,
    /// `M` and `m` of the lanes.
    thickness: V3<R>,
    normal: V3<R>,
}

impl<'a, R: Lanes> LaneGroup<'a, R> {
    #[inline(always)]
    pub(super) fn new(
        token: R::Token,
        at: usize,
        geometry: &'a Geometry<R::Element>,
        material: &'a Stiffness<R::Element>,
        constant: Option<&'a Constant<R::Element>>,
        hardening: Hardening,
    ) -> Self {
        let load = |row: &Row<R::Element>| R::load(token, &row[at..]);
        let load3 = |rows: &[Row<R::Element>; 3]| [load(&rows[0]), load(&rows[1]), load(&rows[2])];
        Self {
            token,
            at,
            geometry,
            material,
            constant,
            hardening,
            thickness: load3(&geometry.thickness),
            normal: load3(&geometry.thickness_gradient),
        }
    }
}

impl<R: Lanes> LaneGroup<'_, R> {
    /// Evaluates forces, and the stiffness if `TANGENT`, with this pressure of the volume in both. Returns the least
    /// volume ratio of any point; where it is not positive no other result may be used.
    #[inline(always)]
    pub(super) fn evaluate<const TANGENT: bool>(
        &self,
        local: &mut Local<R::Element>,
        kind: PressureKind,
    ) -> R {
        let zero = self.splat(0.0);
        let alpha = self.load(&self.geometry.alpha);
        let wedges = Wedges::new(self, local);
        let bulk = self.load(&self.material.bulk);
        let changes = if kind == PressureKind::Predicted {
            wedges.predicted_changes(self, local)
        } else {
            wedges.changes
        };
        let mut pressure = bulk * (changes[0] + changes[1]).divided_by(wedges.total);
        if let Some(constant) = self.constant {
            pressure = pressure + self.load(&constant.pressure);
        }
        let mut sums = Sums {
            forces: [[zero; 3]; N_NODES],
            least: wedges.least,
        };
        let stiffness = &mut local.stiffness;
        if TANGENT {
            for block in stiffness.iter_mut() {
                for row in block {
                    zero.store(&mut row[self.at..]);
                }
            }
        }
        // V_w ∂J_w/∂u of both wedges, for the stiffness of the volume change.
        let mut gradients = [[[zero; 3]; N_NODES]; 2];
        let apart = wedges.apart(self, self.load(&self.material.apart), &changes);
        for w in 0..2 {
            let unit = wedges.wedge(self, w, self.splat(1.0) - alpha);
            let pressure = if kind == PressureKind::None {
                zero
            } else {
                pressure + apart.pressures[w]
            };
            let gradient = &mut gradients[w];
            let change = VolumeChange::Wedge { pressure, gradient };
            self.add::<6, TANGENT>(&unit, change, &mut sums, stiffness);
        }
        let unit = wedges.mean(self, alpha);
        let [of_pair, of_wedges] = apart.gradients(&gradients);
        let change = VolumeChange::Mean([
            OfVolume {
                stiffness: bulk.divided_by(wedges.total),
                gradient: of_pair,
            },
            OfVolume {
                stiffness: apart.stiffness,
                gradient: of_wedges,
            },
        ]);
        self.add::<N_NODES, TANGENT>(&unit, change, &mut sums, stiffness);
        for (node, force) in sums.forces.iter().enumerate() {
            for c in 0..3 {
                force[c].store(&mut local.forces[node][c][self.at..]);
            }
        }
        sums.least
    }

    /// The deviatoric second Piola–Kirchhoff stress of the law alone at the points, and the
    /// pressure, into the places of constant stresses, Pa. The group's material is that at rest,
    /// for one share of everything.
    #[inline(always)]
    pub(super) fn elastic(&self, local: &Local<R::Element>, out: &mut Constant<R::Element>) {
        let wedges = Wedges::new(self, local);
        let pressure = self.load(&self.material.bulk) * wedges.change().divided_by(wedges.total);
        pressure.store(&mut out.pressure[self.at..]);
        let (sums, shares) = wedges.shares(self.splat(1.0));
        let units = [
            (0, wedges.mean_deformation(self.splat(0.0), &shares), sums),
            (2, wedges.f[0], wedges.volumes[0]),
            (4, wedges.f[1], wedges.volumes[1]),
        ];
        for (point, f, v) in units {
            self.elastic_unit(point, &f, v, out);
        }
    }

    /// The stresses of one unit, whose first point is `point`.
    #[inline(always)]
    fn elastic_unit(
        &self,
        point: usize,
        f: &[M3<R>; 2],
        v: [R; 2],
        out: &mut Constant<R::Element>,
    ) {
        let (zero, one) = (self.splat(0.0), self.splat(1.0));
        let j = [
            dot(&f[0][0], &cofactor(&f[0])[0]),
            dot(&f[1][0], &cofactor(&f[1])[0]),
        ];
        let sum = v[0] + v[1];
        // The second wedge of a single prism has no volume; it is taken as undeformed.
        let none = self.splat(NO_VOLUME);
        let whole = sum.select_less(none, one, sum);
        let jb = v[0].mul_add(j[0], v[1] * j[1]).divided_by(whole);
        let jb = sum.select_less(none, one, jb);
        let y = inv_cbrt(self.token, jb.max(self.splat(1e-3)));
        for q in 0..2 {
            let excess = jb.divided_by(j[q]) - one;
            let carried = mul(&f[q], &self.thickness);
            let mut hat = [[zero; 3]; 3];
            for r in 0..3 {
                hat[r] = axpy(excess * carried[r], &self.normal, &f[q][r]);
            }
            let stress = self.elastic_stress(point + q, &cauchy_green(&hat), y);
            for (row, stress) in out.stress[point + q].iter_mut().zip(stress) {
                stress.store(&mut row[self.at..]);
            }
        }
    }

    /// The stress at a point whose deformation has `six` as its Cauchy–Green tensor; `y =
    /// Jb^(−1/3)`.
    #[inline(always)]
    fn elastic_stress(&self, point: usize, six: &Six<R>, y: R) -> Six<R> {
        let (zero, one) = (self.splat(0.0), self.splat(1.0));
        let slope = self.load(&self.material.slope[point]);
        if let Hardening::Powers(powers) = &self.hardening {
            return respond(self.token, powers, slope, six).0;
        }
        // C's cofactor, and J² = Jb².
        let [xx, yy, zz, xy, yz, zx] = *six;
        let n = xx + yy + zz;
        let cof = cofactor(&[[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]);
        let y2 = y * y;
        let inv_jb2 = (y2 * y) * (y2 * y);
        let [first, _] = self.harden(y2.mul_add(n, self.splat(-3.0)));
        let b = self.splat(2.0) * slope * first * y2;
        let fall = n * self.splat(-1.0 / 3.0) * inv_jb2;
        let mut stress = [zero; 6];
        for (k, (i, l)) in PLACES.into_iter().enumerate() {
            let unit = if i == l { one } else { zero };
            stress[k] = b * fall.mul_add(cof[i][l], unit);
        }
        stress
    }

    #[inline(always)]
    fn splat(&self, x: f64) -> R {
        R::splat(self.token, x)
    }

    #[inline(always)]
    fn load(&self, row: &Row<R::Element>) -> R {
        R::load(self.token, &row[self.at..])
    }

    #[inline(always)]
    fn load3(&self, rows: &[Row<R::Element>; 3]) -> V3<R> {
        [
            self.load(&rows[0]),
            self.load(&rows[1]),
            self.load(&rows[2]),
        ]
    }

    /// `w'` and `w''` relative to `w'` at rest; zero for laws in principal stretches.
    #[inline(always)]
    fn harden(&self, x: R) -> [R; 2] {
        match self.hardening {
            Hardening::None => [self.splat(1.0), self.splat(0.0)],
            Hardening::Powers(_) => [self.splat(0.0); 2],
            Hardening::Cubic { a, b } => {
                let (a2, b3) = (self.splat(2.0 * a), self.splat(3.0 * b));
                let first = x.mul_add(x.mul_add(b3, a2), self.splat(1.0));
                [first, x.mul_add(self.splat(6.0 * b), a2)]
            }
            Hardening::Exponential { b } => {
                let mut numbers = [R::Element::default(); WIDTH];
                x.store(&mut numbers);
                for number in numbers.iter_mut().take(R::N) {
                    let exponent = palpa_sparse::fronts::Number::wide(*number) * b;
                    *number = palpa_sparse::fronts::Number::nearest(exponent.exp());
                }
                let first = R::load(self.token, &numbers);
                [first, first * self.splat(b)]
            }
        }
    }
}
