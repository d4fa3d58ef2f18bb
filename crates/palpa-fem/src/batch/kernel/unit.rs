//! Volume ratios, law and forces of a unit.

#![expect(
    clippy::inline_always,
    reason = "compiled in its caller with the machine's instructions"
)]

use super::super::principal::{Frame, Six, respond};
use super::algebra::{M3, V3, axpy, cauchy_green, cofactor, dot, inv_cbrt, mul, scale, six_times};
use super::deformation::Unit;
use super::{Hardening, LaneGroup, Lanes, N_BLOCKS, N_NODES, Row};

/// A unit with less volume than this has none, m³.
pub(super) const NO_VOLUME: f64 = 1e-30;

/// Sums over the units of a pair.
pub(super) struct Sums<R> {
    /// `∂W/∂u`, N.
    pub(super) forces: [V3<R>; N_NODES],
    /// Least volume ratio of a point.
    pub(super) least: R,
}

/// The part of a unit in the energy of the pair's volume change.
pub(super) enum VolumeChange<'a, R> {
    /// A wedge: the pressure acts on it, Pa, and `V_w ∂J_w/∂u` is added to `gradient`, m².
    Wedge {
        pressure: R,
        gradient: &'a mut [V3<R>; N_NODES],
    },
    /// The mean: it has no pressure, and adds the stiffness of the pair's volume, and that of its wedges'
    /// volumes against each other.
    Mean([OfVolume<R>; 2]),
}

/// The stiffness `stiffness · gradient ⊗ gradient` of a change of volume; Pa/m³ and m².
#[derive(Clone, Copy)]
pub(super) struct OfVolume<R> {
    pub(super) stiffness: R,
    pub(super) gradient: [V3<R>; N_NODES],
}

/// Volume ratios of a unit's points.
pub(super) struct Ratios<R> {
    /// `cof F`.
    pub(super) cof: [M3<R>; 2],
    /// `1/J`.
    pub(super) inv_j: [R; 2],
    /// `v`, the points' shares of the unit's volume.
    pub(super) v: [R; 2],
    /// `s = Jb/J`.
    pub(super) s: [R; 2],
    /// `1/Jb`.
    pub(super) inv_jb: R,
    /// `Jb^(−2/3)`.
    pub(super) y2: R,
}

/// The law at one of a unit's points.
#[derive(Clone, Copy)]
pub(super) struct LawAt<R> {
    /// `F M`.
    pub(super) carried: V3<R>,
    /// `F^`.
    pub(super) hat: M3<R>,
    /// `T`, N m.
    pub(super) stress: M3<R>,
    /// `T m`.
    pub(super) across: V3<R>,
    /// `n = |F^|²`.
    pub(super) n: R,
    /// `b = 2 V w' Jb^(−2/3)`, N m.
    pub(super) b: R,
    /// `k = T m · F M`.
    pub(super) k: R,
    /// `V w''`, N m.
    pub(super) second: R,
    /// `V`, weighted, m³.
    pub(super) weight: R,
    /// The part `S` of the stress that is not the law's in the first invariant, Pa.
    pub(super) own: Option<Six<R>>,
    /// Of a law in principal stretches.
    pub(super) frame: Option<Frame<R>>,
}

/// Gradients of the nodes' displacements, turned and carried. `[point][node]`
pub(super) struct Carried<R, const N: usize> {
    /// `M · G`.
    pub(super) along: [[R; N]; 2],
    /// `G^ = AᵀG`, 1/m.
    pub(super) hats: [[V3<R>; N]; 2],
    /// `j = cof(F) G`, 1/m.
    pub(super) turned: [[V3<R>; N]; 2],
}

impl<R: Lanes> LaneGroup<'_, R> {
    /// Adds a unit's forces, and its stiffness if `TANGENT`.
    #[inline(always)]
    pub(super) fn add<const N: usize, const TANGENT: bool>(
        &self,
        unit: &Unit<R, N>,
        change: VolumeChange<'_, R>,
        sums: &mut Sums<R>,
        stiffness: &mut [[Row<R::Element>; 9]; N_BLOCKS],
    ) {
        let ratios = self.ratios(unit, &mut sums.least);
        let laws = [self.law_at(unit, &ratios, 0), self.law_at(unit, &ratios, 1)];
        let pressure = match &change {
            VolumeChange::Wedge { pressure, .. } => *pressure,
            VolumeChange::Mean(_) => self.splat(0.0),
        };
        let g = self.pulls(unit, &ratios, &laws, pressure);
        let nodes = self.add_forces(unit, &ratios, &laws, &g, &mut sums.forces);
        if !TANGENT {
            return;
        }
        self.add_stiffness(unit, &ratios, &laws, &nodes, &g, change, stiffness);
    }

    /// Volume ratios, and their least.
    #[inline(always)]
    fn ratios<const N: usize>(&self, unit: &Unit<R, N>, least: &mut R) -> Ratios<R> {
        let one = self.splat(1.0);
        let cof = [cofactor(&unit.f[0]), cofactor(&unit.f[1])];
        let j = [
            dot(&unit.f[0][0], &cof[0][0]),
            dot(&unit.f[1][0], &cof[1][0]),
        ];
        *least = least.min(j[0]).min(j[1]);
        let inv_j = [one.divided_by(j[0]), one.divided_by(j[1])];
        // The second wedge of a single prism has no volume; it is taken as undeformed.
        let total = unit.volumes[0] + unit.volumes[1];
        let none = self.splat(NO_VOLUME);
        let inv_total = one.divided_by(total.select_less(none, one, total));
        let v = [unit.volumes[0] * inv_total, unit.volumes[1] * inv_total];
        let jb = total.select_less(none, one, v[0].mul_add(j[0], v[1] * j[1]));
        *least = least.min(jb);
        let inv_jb = one.divided_by(jb);
        let y = inv_cbrt(self.token, jb);
        let y2 = y * y;
        let s = [jb * inv_j[0], jb * inv_j[1]];
        Ratios {
            cof,
            inv_j,
            v,
            s,
            inv_jb,
            y2,
        }
    }

    /// Stress and stiffness of the law at point `q`.
    #[inline(always)]
    fn law_at<const N: usize>(&self, unit: &Unit<R, N>, ratios: &Ratios<R>, q: usize) -> LawAt<R> {
        let zero = self.splat(0.0);
        let (f, y2) = (&unit.f[q], ratios.y2);
        let carried = mul(f, &self.thickness);
        let excess = ratios.s[q] - self.splat(1.0);
        let mut hat = [[zero; 3]; 3];
        for r in 0..3 {
            hat[r] = axpy(excess * carried[r], &self.normal, &f[r]);
        }
        let n = dot(&hat[0], &hat[0]) + dot(&hat[1], &hat[1]) + dot(&hat[2], &hat[2]);
        let weight = unit.weight * unit.volumes[q];
        let slope = self.load(&self.material.slope[unit.point + q]);
        let base = weight * slope;
        let mut own = self.constant_at(unit.point + q);
        let mut frame = None;
        if let Hardening::Powers(powers) = &self.hardening {
            let (mut law, of_law) = respond(self.token, powers, slope, &cauchy_green(&hat));
            if let Some(constant) = own {
                for k in 0..6 {
                    law[k] = law[k] + constant[k];
                }
            }
            own = Some(law);
            frame = Some(of_law);
        }
        let [first, bend] = self.harden(y2.mul_add(n, self.splat(-3.0)));
        let b = self.splat(2.0) * base * first * y2;
        let mut stress = [[zero; 3]; 3];
        for r in 0..3 {
            stress[r] = times_b(own.as_ref(), b, weight, &hat[r]);
        }
        let across = mul(&stress, &self.normal);
        LawAt {
            k: dot(&across, &carried),
            carried,
            hat,
            stress,
            across,
            n,
            b,
            second: base * bend,
            weight,
            own,
            frame,
        }
    }

    /// `g`, by which a force follows `∂J/∂u`, with the pressure of the volume change.
    #[inline(always)]
    fn pulls<const N: usize>(
        &self,
        unit: &Unit<R, N>,
        ratios: &Ratios<R>,
        laws: &[LawAt<R>; 2],
        pressure: R,
    ) -> [R; 2] {
        let Ratios {
            inv_j,
            v,
            s,
            inv_jb,
            ..
        } = ratios;
        let mut beta = self.splat(0.0);
        for q in 0..2 {
            let half_slope = laws[q].b * *inv_jb * self.splat(-1.0 / 3.0);
            beta = laws[q]
                .k
                .mul_add(inv_j[q], half_slope.mul_add(laws[q].n, beta));
        }
        let mut g = [beta; 2];
        for q in 0..2 {
            g[q] = v[q].mul_add(beta, -(laws[q].k * s[q] * inv_j[q]));
            g[q] = pressure.mul_add(unit.volumes[q], g[q]);
        }
        g
    }

    /// Adds the forces; returns the nodes' gradients, which the stiffness needs.
    #[inline(always)]
    fn add_forces<const N: usize>(
        &self,
        unit: &Unit<R, N>,
        ratios: &Ratios<R>,
        laws: &[LawAt<R>; 2],
        g: &[R; 2],
        forces: &mut [V3<R>; N_NODES],
    ) -> Carried<R, N> {
        let (zero, one) = (self.splat(0.0), self.splat(1.0));
        let mut nodes = Carried {
            along: [[zero; N]; 2],
            hats: [[[zero; 3]; N]; 2],
            turned: [[[zero; 3]; N]; 2],
        };
        for q in 0..2 {
            for a in 0..N {
                let gradient = &unit.gradients[q][a];
                let along = dot(&self.thickness, gradient);
                let hat = axpy((ratios.s[q] - one) * along, &self.normal, gradient);
                let turned = mul(&ratios.cof[q], gradient);
                let force = &mut forces[unit.node + a];
                let push = mul(&laws[q].stress, &hat);
                *force = axpy(
                    g[q],
                    &turned,
                    &[force[0] + push[0], force[1] + push[1], force[2] + push[2]],
                );
                nodes.along[q][a] = along;
                nodes.hats[q][a] = hat;
                nodes.turned[q][a] = turned;
            }
        }
        nodes
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

/// `B` times a vector: `b` times the vector, plus `weight` times the stress times the vector.
#[inline(always)]
pub(super) fn times_b<R: Lanes>(stress: Option<&Six<R>>, b: R, weight: R, v: &V3<R>) -> V3<R> {
    let own = scale(b, v);
    match stress {
        Some(stress) => axpy(weight, &six_times(stress, v), &own),
        None => own,
    }
}
