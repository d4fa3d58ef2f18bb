//! The element of [`crate::element`] in lanes: sixteen pairs of prisms of one layer at once.
//!
//! The same energy, written first for laws in the first isochoric invariant, `W = w(x)`, `x = Jb^(−2/3) |F^|² − 3`. All
//! derivatives by `δF` go through the two `δJ_p`, so that the stiffness of a unit (two depth points, N nodes) is
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
//! where `b = 2 V w' Jb^(−2/3)` and `D` collects what is quadratic in `δJ`. Laws in principal stretches (`principal.rs`) have no
//! `w`: their stress is part of `S`, and `Σ_q V_q ε_a,q : ∂S/∂E : ε_b,q` takes the place of the last sum, with `ε` the strain that
//! goes with a node's displacement. Derivation: `docs/theory/paired_prism.md`.

#![expect(
    clippy::inline_always,
    clippy::needless_range_loop,
    clippy::too_many_lines,
    clippy::too_many_arguments,
    reason = "one piece of arithmetic on several arrays, compiled in its caller with the machine's instructions"
)]

use super::lanes::Lanes;
use super::principal::{Frame, PLACES, Six, respond};
use crate::law::Hardening;

/// Pairs in a batch.
pub(super) const WIDTH: usize = 16;
/// Local nodes: those of column c are 2 c (upper) and 2 c + 1 (lower); columns 0, 1, 2 are the first wedge's, 1, 2, 3 the
/// second's.
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
    /// `[wedge][point][node of the wedge][component]`
    pub(super) gradients: [[[[Row<E>; 3]; 6]; 2]; 2],
    /// `[wedge][point]`
    pub(super) volumes: [[Row<E>; 2]; 2],
    pub(super) thickness: [Row<E>; 3],
    pub(super) thickness_gradient: [Row<E>; 3],
    /// Share of the pair's mean deviator; 0 for a single prism.
    pub(super) alpha: Row<E>,
}

/// What a batch is made of, in this step.
#[derive(Debug, Clone)]
pub(super) struct Stiffness<E> {
    /// Half the shear modulus at the points at rest, Pa; `w'` of laws in the first invariant.
    pub(super) slope: [Row<E>; N_POINTS],
    /// `K`, Pa.
    pub(super) bulk: Row<E>,
}

/// Constant stresses of a batch: `xx, yy, zz, xy, yz, zx` at the points, and pressure, Pa.
#[derive(Debug, Clone)]
pub(super) struct Constant<E> {
    pub(super) stress: [[Row<E>; 6]; N_POINTS],
    pub(super) pressure: Row<E>,
}

pub(super) type V3<R> = [R; 3];
pub(super) type M3<R> = [[R; 3]; 3];

#[inline(always)]
pub(super) fn dot<R: Lanes>(a: &V3<R>, b: &V3<R>) -> R {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
fn cross<R: Lanes>(a: &V3<R>, b: &V3<R>) -> V3<R> {
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

/// Rows of the matrix times the vector.
#[inline(always)]
pub(super) fn mul<R: Lanes>(m: &M3<R>, v: &V3<R>) -> V3<R> {
    [dot(&m[0], v), dot(&m[1], v), dot(&m[2], v)]
}

#[inline(always)]
fn cofactor<R: Lanes>(f: &M3<R>) -> M3<R> {
    [
        cross(&f[1], &f[2]),
        cross(&f[2], &f[0]),
        cross(&f[0], &f[1]),
    ]
}

#[inline(always)]
pub(super) fn scale<R: Lanes>(s: R, v: &V3<R>) -> V3<R> {
    [s * v[0], s * v[1], s * v[2]]
}

#[inline(always)]
pub(super) fn axpy<R: Lanes>(s: R, v: &V3<R>, to: &V3<R>) -> V3<R> {
    [
        s.mul_add(v[0], to[0]),
        s.mul_add(v[1], to[1]),
        s.mul_add(v[2], to[2]),
    ]
}

/// `FᵀF`.
#[inline(always)]
fn cauchy_green<R: Lanes>(f: &M3<R>) -> Six<R> {
    let mut six = [f[0][0]; 6];
    for (c, (i, k)) in six.iter_mut().zip(PLACES) {
        *c = f[0][i].mul_add(f[0][k], f[1][i].mul_add(f[1][k], f[2][i] * f[2][k]));
    }
    six
}

#[inline(always)]
fn six_times<R: Lanes>(six: &Six<R>, v: &V3<R>) -> V3<R> {
    let [xx, yy, zz, xy, yz, zx] = *six;
    [
        dot(v, &[xx, xy, zx]),
        dot(v, &[xy, yy, yz]),
        dot(v, &[zx, yz, zz]),
    ]
}

/// `J^(−1/3)`, by four steps of fourth order from a rational guess; to rounding for J of 0.002 to 60.
#[inline(always)]
fn inv_cbrt<R: Lanes>(token: R::Token, j: R) -> R {
    let c = |x: f64| R::splat(token, x);
    let mut y = c(2.6).divided_by(j + c(1.6)) + c(-0.03) * (j - c(1.0)).min(c(1.0));
    for _ in 0..4 {
        let e = c(1.0) - j * y * y * y;
        let series = e.mul_add(c(35.0 / 243.0), c(14.0 / 81.0));
        let series = e.mul_add(series, c(2.0 / 9.0));
        let series = e.mul_add(series, c(1.0 / 3.0));
        y = (y * e).mul_add(series, y);
    }
    y
}

/// Displacements in, forces and stiffness out, of one batch.
#[derive(Debug)]
pub(super) struct Local<E> {
    /// `[node][component]`, m
    pub(super) displacements: [[Row<E>; 3]; N_NODES],
    /// `∂W/∂u`, N
    pub(super) forces: [[Row<E>; 3]; N_NODES],
    /// `∂²W/∂u_a∂u_b`, entry (r, c) at `3 r + c`, N/m
    pub(super) stiffness: [[Row<E>; 9]; N_BLOCKS],
}

/// How the two wedges are deformed at their points, and how their volume has changed.
struct Wedges<R> {
    f: [[M3<R>; 2]; 2],
    volumes: [[R; 2]; 2],
    /// `Σ V (J − 1)` and `Σ V`, m³.
    change: R,
    total: R,
    /// Least volume ratio of a point, at most 1.
    least: R,
}

impl<R: Lanes> Wedges<R> {
    #[inline(always)]
    fn new(
        token: R::Token,
        at: usize,
        geometry: &Geometry<R::Element>,
        local: &Local<R::Element>,
    ) -> Self {
        let (zero, one) = (R::splat(token, 0.0), R::splat(token, 1.0));
        let load = |row: &Row<R::Element>| R::load(token, &row[at..]);
        let load3 = |rows: &[Row<R::Element>; 3]| [load(&rows[0]), load(&rows[1]), load(&rows[2])];
        let mut wedges = Self {
            f: [[[[zero; 3]; 3]; 2]; 2],
            volumes: [[zero; 2]; 2],
            change: zero,
            total: zero,
            least: one,
        };
        for w in 0..2 {
            for q in 0..2 {
                let mut h = [[zero; 3]; 3];
                for n in 0..6 {
                    let g = load3(&geometry.gradients[w][q][n]);
                    let u = load3(&local.displacements[2 * w + n]);
                    for r in 0..3 {
                        h[r] = axpy(u[r], &g, &h[r]);
                    }
                }
                for r in 0..3 {
                    h[r][r] = h[r][r] + one;
                }
                let volume = load(&geometry.volumes[w][q]);
                let j = dot(&h[0], &cofactor(&h)[0]);
                wedges.f[w][q] = h;
                wedges.volumes[w][q] = volume;
                wedges.least = wedges.least.min(j);
                wedges.change = volume.mul_add(j - one, wedges.change);
                wedges.total = wedges.total + volume;
            }
        }
        wedges
    }
}

/// A unit's nodes, gradients and deformation.
struct Unit<R, const N: usize> {
    gradients: [[V3<R>; N]; 2],
    f: [M3<R>; 2],
    volumes: [R; 2],
    /// Weight of its deviator.
    weight: R,
    /// First of its points.
    point: usize,
    /// First of its nodes.
    node: usize,
}

/// Evaluates the lanes of a batch from `at` on. Returns the least volume ratio of any point; where it is not positive
/// nothing else is to be used.
#[inline(always)]
pub(super) fn evaluate<R: Lanes, const TANGENT: bool>(
    token: R::Token,
    at: usize,
    geometry: &Geometry<R::Element>,
    material: &Stiffness<R::Element>,
    constant: Option<&Constant<R::Element>>,
    hardening: Hardening,
    local: &mut Local<R::Element>,
) -> R {
    let zero = R::splat(token, 0.0);
    let one = R::splat(token, 1.0);
    let load = |row: &Row<R::Element>| R::load(token, &row[at..]);
    let load3 = |rows: &[Row<R::Element>; 3]| [load(&rows[0]), load(&rows[1]), load(&rows[2])];
    let thickness = load3(&geometry.thickness);
    let normal = load3(&geometry.thickness_gradient);
    let alpha = load(&geometry.alpha);

    let mut forces = [[zero; 3]; N_NODES];
    let Wedges {
        f,
        volumes,
        change,
        total,
        mut least,
    } = Wedges::<R>::new(token, at, geometry, local);
    let bulk = load(&material.bulk);
    let mut pressure = bulk * change.divided_by(total);
    if let Some(constant) = constant {
        pressure = pressure + load(&constant.pressure);
    }
    // V ∂v̄/∂u, for the stiffness of the volume change.
    let mut volume_gradient = [[zero; 3]; N_NODES];
    let context = Context {
        token,
        at,
        material,
        constant,
        hardening,
        thickness,
        normal,
    };
    if TANGENT {
        for block in &mut local.stiffness {
            for row in block {
                zero.store(&mut row[at..]);
            }
        }
    }
    for w in 0..2 {
        let mut gradients = [[[zero; 3]; 6]; 2];
        for q in 0..2 {
            for n in 0..6 {
                gradients[q][n] = load3(&geometry.gradients[w][q][n]);
            }
        }
        let unit = Unit {
            gradients,
            f: f[w],
            volumes: volumes[w],
            weight: one - alpha,
            point: 2 + 2 * w,
            node: 2 * w,
        };
        let gradient = TANGENT.then_some(&mut volume_gradient);
        context.add::<6, TANGENT>(
            &unit,
            pressure,
            gradient,
            None,
            &mut forces,
            local,
            &mut least,
        );
    }
    let mut gradients = [[[zero; 3]; N_NODES]; 2];
    let mut mean = [[[zero; 3]; 3]; 2];
    let mut sums = [zero; 2];
    for q in 0..2 {
        sums[q] = volumes[0][q] + volumes[1][q];
        let inverse = one.divided_by(sums[q]);
        for w in 0..2 {
            let share = volumes[w][q] * inverse;
            for n in 0..6 {
                let g = load3(&geometry.gradients[w][q][n]);
                gradients[q][2 * w + n] = axpy(share, &g, &gradients[q][2 * w + n]);
            }
            for r in 0..3 {
                mean[q][r] = axpy(share, &f[w][q][r], &mean[q][r]);
            }
        }
    }
    let unit = Unit {
        gradients,
        f: mean,
        volumes: sums,
        weight: alpha,
        point: 0,
        node: 0,
    };
    let bulk_gradient = (bulk.divided_by(total), &volume_gradient);
    context.add::<N_NODES, TANGENT>(
        &unit,
        zero,
        None,
        Some(bulk_gradient),
        &mut forces,
        local,
        &mut least,
    );
    for (node, force) in forces.iter().enumerate() {
        for c in 0..3 {
            force[c].store(&mut local.forces[node][c][at..]);
        }
    }
    least
}

struct Context<'a, R: Lanes> {
    token: R::Token,
    at: usize,
    material: &'a Stiffness<R::Element>,
    constant: Option<&'a Constant<R::Element>>,
    hardening: Hardening,
    thickness: V3<R>,
    normal: V3<R>,
}

impl<R: Lanes> Context<'_, R> {
    fn splat(&self, x: f64) -> R {
        R::splat(self.token, x)
    }

    /// Adds a unit's forces and stiffness. `pressure` is that of the volume change, in wedges; `volume` receives what the
    /// stiffness of the volume change needs, `bulk` adds it.
    #[inline(always)]
    fn add<const N: usize, const TANGENT: bool>(
        &self,
        unit: &Unit<R, N>,
        pressure: R,
        volume: Option<&mut [V3<R>; N_NODES]>,
        bulk: Option<(R, &[V3<R>; N_NODES])>,
        forces: &mut [V3<R>; N_NODES],
        local: &mut Local<R::Element>,
        least: &mut R,
    ) {
        let (zero, one) = (self.splat(0.0), self.splat(1.0));
        let (thick, normal) = (&self.thickness, &self.normal);
        let cof = [cofactor(&unit.f[0]), cofactor(&unit.f[1])];
        let j = [
            dot(&unit.f[0][0], &cof[0][0]),
            dot(&unit.f[1][0], &cof[1][0]),
        ];
        *least = least.min(j[0]).min(j[1]);
        let inv_j = [one.divided_by(j[0]), one.divided_by(j[1])];
        let inv_total = one.divided_by(unit.volumes[0] + unit.volumes[1]);
        let v = [unit.volumes[0] * inv_total, unit.volumes[1] * inv_total];
        let jb = v[0].mul_add(j[0], v[1] * j[1]);
        *least = least.min(jb);
        let inv_jb = one.divided_by(jb);
        let y = inv_cbrt(self.token, jb);
        let y2 = y * y;
        let s = [jb * inv_j[0], jb * inv_j[1]];

        let mut carried = [[zero; 3]; 2];
        let mut hat = [[[zero; 3]; 3]; 2];
        let mut stress = hat;
        let mut across = carried;
        let (mut n, mut b, mut k) = ([zero; 2], [zero; 2], [zero; 2]);
        let mut second = [zero; 2];
        let mut weights = [zero; 2];
        let mut own = [None; 2];
        let mut frames: [Option<Frame<R>>; 2] = [None; 2];
        let mut beta = zero;
        for q in 0..2 {
            carried[q] = mul(&unit.f[q], thick);
            let excess = s[q] - one;
            for r in 0..3 {
                hat[q][r] = axpy(excess * carried[q][r], normal, &unit.f[q][r]);
            }
            n[q] = dot(&hat[q][0], &hat[q][0])
                + dot(&hat[q][1], &hat[q][1])
                + dot(&hat[q][2], &hat[q][2]);
            weights[q] = unit.weight * unit.volumes[q];
            let slope = R::load(self.token, &self.material.slope[unit.point + q][self.at..]);
            let base = weights[q] * slope;
            own[q] = self.constant_at(unit.point + q);
            if let Hardening::Powers(powers) = &self.hardening {
                let (mut law, frame) = respond(self.token, powers, slope, &cauchy_green(&hat[q]));
                if let Some(constant) = own[q] {
                    for k in 0..6 {
                        law[k] = law[k] + constant[k];
                    }
                }
                own[q] = Some(law);
                frames[q] = Some(frame);
            }
            let [first, bend] = self.harden(y2.mul_add(n[q], self.splat(-3.0)));
            second[q] = base * bend;
            b[q] = self.splat(2.0) * base * first * y2;
            for r in 0..3 {
                stress[q][r] = times_b(own[q].as_ref(), b[q], weights[q], &hat[q][r]);
            }
            across[q] = mul(&stress[q], normal);
            k[q] = dot(&across[q], &carried[q]);
            let half_slope = b[q] * inv_jb * self.splat(-1.0 / 3.0);
            beta = k[q].mul_add(inv_j[q], half_slope.mul_add(n[q], beta));
        }
        let mut g = [zero; 2];
        for q in 0..2 {
            g[q] = v[q].mul_add(beta, -(k[q] * s[q] * inv_j[q]));
            g[q] = pressure.mul_add(unit.volumes[q], g[q]);
        }
        let mut hats = [[[zero; 3]; N]; 2];
        let mut turned = [[[zero; 3]; N]; 2];
        let mut along = [[zero; N]; 2];
        for q in 0..2 {
            for a in 0..N {
                let gradient = &unit.gradients[q][a];
                along[q][a] = dot(thick, gradient);
                hats[q][a] = axpy((s[q] - one) * along[q][a], normal, gradient);
                turned[q][a] = mul(&cof[q], gradient);
                let force = &mut forces[unit.node + a];
                let push = mul(&stress[q], &hats[q][a]);
                *force = axpy(
                    g[q],
                    &turned[q][a],
                    &[force[0] + push[0], force[1] + push[1], force[2] + push[2]],
                );
            }
        }
        if !TANGENT {
            return;
        }
        if let Some(volume) = volume {
            for q in 0..2 {
                for a in 0..N {
                    let into = &mut volume[unit.node + a];
                    *into = axpy(unit.volumes[q], &turned[q][a], into);
                }
            }
        }

        // δs_q = Σ_p sigma[q][p] δJ_p.
        let mut sigma = [[zero; 2]; 2];
        for q in 0..2 {
            for p in 0..2 {
                let own = if p == q { v[p] - s[q] } else { v[p] };
                sigma[q][p] = own * inv_j[q];
            }
        }
        let mut d = [[zero; 2]; 2];
        let mut slope_jb = [zero; 2];
        let mut kappa = [zero; 2];
        let mut bent = [[[zero; 3]; N]; 2];
        let mut passing = [[[zero; 3]; N]; 2];
        let mut parallel = [[[zero; 3]; N]; 2];
        for q in 0..2 {
            slope_jb[q] = b[q] * inv_jb * self.splat(-2.0 / 3.0);
            let second_jb = b[q] * inv_jb * inv_jb * self.splat(5.0 / 9.0) * n[q];
            let bent_normal = times_b(own[q].as_ref(), b[q], weights[q], normal);
            let eta = dot(&carried[q], &carried[q]) * dot(normal, &bent_normal);
            kappa[q] = dot(&mul(&hat[q], normal), &carried[q]);
            let fall = k[q] * inv_j[q];
            for p in 0..2 {
                for r in 0..2 {
                    let mut sum = eta * sigma[q][p] * sigma[q][r];
                    let mixed = v[p].mul_add(sigma[q][r], v[r] * sigma[q][p]);
                    sum = (slope_jb[q] * kappa[q]).mul_add(mixed, sum);
                    sum = second_jb.mul_add(v[p] * v[r], sum);
                    if p == q {
                        sum = sum - fall * sigma[q][r];
                    }
                    if r == q {
                        sum = sum - fall * sigma[q][p];
                    }
                    d[p][r] = d[p][r] + sum;
                }
            }
            for a in 0..N {
                bent[q][a] = times_b(own[q].as_ref(), b[q], weights[q], &hats[q][a]);
                let one_way = scale(dot(normal, &bent[q][a]), &carried[q]);
                passing[q][a] = axpy(along[q][a], &across[q], &one_way);
                parallel[q][a] = mul(&hat[q], &hats[q][a]);
            }
        }
        let half = self.splat(0.5);
        let mut partner = [[[zero; 3]; N]; 2];
        for a in 0..N {
            for p in 0..2 {
                let mut sum = [zero; 3];
                for q in 0..2 {
                    sum = axpy(sigma[q][p], &passing[q][a], &sum);
                    sum = axpy(v[p] * slope_jb[q], &parallel[q][a], &sum);
                    sum = axpy(half * d[p][q], &turned[q][a], &sum);
                }
                partner[p][a] = sum;
            }
        }
        let hardens = matches!(
            self.hardening,
            Hardening::Cubic { .. } | Hardening::Exponential { .. }
        );
        let mut steep = [[[zero; 3]; N]; 2];
        if hardens {
            let two = self.splat(2.0);
            for q in 0..2 {
                for a in 0..N {
                    let mut sum = scale(two * y2, &parallel[q][a]);
                    for p in 0..2 {
                        let by_jb = y2 * n[q] * inv_jb * self.splat(-2.0 / 3.0);
                        let factor = (two * y2 * kappa[q]).mul_add(sigma[q][p], by_jb * v[p]);
                        sum = axpy(factor, &turned[p][a], &sum);
                    }
                    steep[q][a] = sum;
                }
            }
        }
        // Strains of a node's displacements at the points, and their stresses, of laws in principal stretches.
        let has_frames = frames[0].is_some();
        let mut strains = [[[[zero; 3]; 6]; N]; 2];
        let mut stresses = strains;
        for q in 0..2 {
            let Some(frame) = &frames[q] else { continue };
            for a in 0..N {
                let turn = axpy(
                    sigma[q][0],
                    &turned[0][a],
                    &scale(sigma[q][1], &turned[1][a]),
                );
                let of_node =
                    frame.strains(self.token, &hat[q], &carried[q], normal, &hats[q][a], &turn);
                stresses[q][a] = frame.stresses(weights[q], &of_node);
                strains[q][a] = of_node;
            }
        }
        let spin = [g[0] * inv_j[0], g[1] * inv_j[1]];
        for a in 0..N {
            // What multiplies rows of a, scaled once.
            let rows = unit.node + a;
            let lifted = bulk.map(|(stiffness, gradient)| scale(stiffness, &gradient[rows]));
            let sharp = [
                scale(second[0], &steep[0][a]),
                scale(second[1], &steep[1][a]),
            ];
            for c in 0..=a {
                let columns = unit.node + c;
                let block = &mut local.stiffness[rows * (rows + 1) / 2 + columns];
                let isotropic = dot(&hats[0][a], &bent[0][c]) + dot(&hats[1][a], &bent[1][c]);
                let z0 = cross(&turned[0][a], &turned[0][c]);
                let z1 = cross(&turned[1][a], &turned[1][c]);
                let z = axpy(spin[0], &z0, &scale(spin[1], &z1));
                for r in 0..3 {
                    for t in 0..3 {
                        let row = &mut block[3 * r + t][self.at..];
                        let mut sum = R::load(self.token, row);
                        for p in 0..2 {
                            sum = turned[p][a][r].mul_add(partner[p][c][t], sum);
                            sum = partner[p][a][r].mul_add(turned[p][c][t], sum);
                        }
                        if hardens {
                            for q in 0..2 {
                                sum = sharp[q][r].mul_add(steep[q][c][t], sum);
                            }
                        }
                        if has_frames {
                            for q in 0..2 {
                                for k in 0..6 {
                                    let (stress, strain) = (&stresses[q][a][k], &strains[q][c][k]);
                                    sum = stress[r].mul_add(strain[t], sum);
                                }
                            }
                        }
                        if let (Some(lifted), Some((_, gradient))) = (&lifted, bulk) {
                            sum = lifted[r].mul_add(gradient[columns][t], sum);
                        }
                        sum = match (r, t) {
                            (0, 1) => sum + z[2],
                            (1, 0) => sum - z[2],
                            (2, 0) => sum + z[1],
                            (0, 2) => sum - z[1],
                            (1, 2) => sum + z[0],
                            (2, 1) => sum - z[0],
                            _ => sum + isotropic,
                        };
                        sum.store(row);
                    }
                }
            }
        }
    }

    /// `w'` and `w''` relative to `w'` at rest; none of laws in principal stretches.
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

    /// The constant stress at a point, Pa.
    #[inline(always)]
    fn constant_at(&self, point: usize) -> Option<Six<R>> {
        let rows = &self.constant?.stress[point];
        let mut stress = [self.splat(0.0); 6];
        for (k, row) in rows.iter().enumerate() {
            stress[k] = R::load(self.token, &row[self.at..]);
        }
        Some(stress)
    }
}

/// `B` times a vector: `b` times it, and `weight` times what a stress makes of it.
#[inline(always)]
fn times_b<R: Lanes>(stress: Option<&Six<R>>, b: R, weight: R, v: &V3<R>) -> V3<R> {
    let own = scale(b, v);
    match stress {
        Some(stress) => axpy(weight, &six_times(stress, v), &own),
        None => own,
    }
}

/// The deviatoric second Piola–Kirchhoff stress that the law alone says at the points, and the pressure, of the lanes from
/// `at` on, into the places of constant stresses, Pa. `material` is that at rest, for one share of everything.
#[inline(always)]
pub(super) fn elastic<R: Lanes>(
    token: R::Token,
    at: usize,
    geometry: &Geometry<R::Element>,
    material: &Stiffness<R::Element>,
    hardening: Hardening,
    local: &Local<R::Element>,
    out: &mut Constant<R::Element>,
) {
    let splat = |x: f64| R::splat(token, x);
    let (zero, one) = (splat(0.0), splat(1.0));
    let load = |row: &Row<R::Element>| R::load(token, &row[at..]);
    let load3 = |rows: &[Row<R::Element>; 3]| [load(&rows[0]), load(&rows[1]), load(&rows[2])];
    let thickness = load3(&geometry.thickness);
    let normal = load3(&geometry.thickness_gradient);
    let context = Context {
        token,
        at,
        material,
        constant: None,
        hardening,
        thickness,
        normal,
    };
    let Wedges {
        f,
        volumes,
        change,
        total,
        ..
    } = Wedges::<R>::new(token, at, geometry, local);
    let pressure = load(&material.bulk) * change.divided_by(total);
    pressure.store(&mut out.pressure[at..]);
    let mut mean = [[[zero; 3]; 3]; 2];
    let mut sums = [zero; 2];
    for q in 0..2 {
        sums[q] = volumes[0][q] + volumes[1][q];
        let inverse = one.divided_by(sums[q]);
        for w in 0..2 {
            for r in 0..3 {
                mean[q][r] = axpy(volumes[w][q] * inverse, &f[w][q][r], &mean[q][r]);
            }
        }
    }
    let units = [
        (0, mean, sums),
        (2, f[0], volumes[0]),
        (4, f[1], volumes[1]),
    ];
    for (point, f, v) in units {
        let j = [
            dot(&f[0][0], &cofactor(&f[0])[0]),
            dot(&f[1][0], &cofactor(&f[1])[0]),
        ];
        let sum = v[0] + v[1];
        // The second wedge of a single prism has no volume, and no say.
        let jb = v[0]
            .mul_add(j[0], v[1] * j[1])
            .divided_by(sum.max(splat(1e-300)));
        let y = inv_cbrt(token, jb.max(splat(1e-3)));
        let y2 = y * y;
        let inv_jb2 = (y2 * y) * (y2 * y);
        for q in 0..2 {
            let excess = jb.divided_by(j[q]) - one;
            let carried = mul(&f[q], &thickness);
            let mut hat = [[zero; 3]; 3];
            for r in 0..3 {
                hat[r] = axpy(excess * carried[r], &normal, &f[q][r]);
            }
            let slope = load(&material.slope[point + q]);
            let six = cauchy_green(&hat);
            if let Hardening::Powers(powers) = &hardening {
                let (law, _) = respond(token, powers, slope, &six);
                for (row, law) in out.stress[point + q].iter_mut().zip(law) {
                    law.store(&mut row[at..]);
                }
                continue;
            }
            // C's cofactor, and J² = Jb².
            let [xx, yy, zz, xy, yz, zx] = six;
            let n = xx + yy + zz;
            let cof = cofactor(&[[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]);
            let [first, _] = context.harden(y2.mul_add(n, splat(-3.0)));
            let b = splat(2.0) * slope * first * y2;
            let fall = n * splat(-1.0 / 3.0) * inv_jb2;
            for (k, (i, l)) in PLACES.into_iter().enumerate() {
                let unit = if i == l { one } else { zero };
                (b * fall.mul_add(cof[i][l], unit)).store(&mut out.stress[point + q][k][at..]);
            }
        }
    }
}
