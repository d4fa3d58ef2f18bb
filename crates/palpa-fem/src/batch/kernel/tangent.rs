//! Stiffness of a unit.

#![expect(
    clippy::inline_always,
    clippy::needless_range_loop,
    reason = "one piece of arithmetic on several arrays, compiled in its caller with the machine's instructions"
)]

use super::algebra::{V3, axpy, cross, dot, mul, scale};
use super::deformation::Unit;
use super::unit::{Carried, LawAt, OfVolume, Ratios, VolumeChange, times_b};
use super::{Hardening, LaneGroup, Lanes, N_BLOCKS, Row};

/// A vector for each point and node of a unit.
type PerNode<R, const N: usize> = [[V3<R>; N]; 2];

/// Derivatives of the stress by the nodes' displacements, at constant volume ratios.
struct Bend<R, const N: usize> {
    /// `D`.
    d: [[R; 2]; 2],
    /// `b' = ∂b/∂Jb`.
    slope_jb: [R; 2],
    /// `F^ m · F M`.
    kappa: [R; 2],
    /// `B G^`.
    bent: PerNode<R, N>,
    /// `F M (m · B G^) + T m (M · G)`.
    passing: PerNode<R, N>,
    /// `F^ G^`.
    parallel: PerNode<R, N>,
}

/// Factors of the stiffness between two nodes.
struct Factors<'a, R, const N: usize> {
    nodes: &'a Carried<R, N>,
    bent: &'a PerNode<R, N>,
    /// `y`.
    partner: &'a PerNode<R, N>,
    /// `ψ` of laws that harden; none of others.
    steep: Option<&'a PerNode<R, N>>,
    /// Strains and stresses by a node's displacement, of laws in principal stretches.
    strains: Option<&'a [Strains<R, N>; 2]>,
    /// `V w''`, N m.
    second: [R; 2],
    /// `g/J`.
    spin: [R; 2],
    /// That of [`VolumeChange::Mean`].
    volume: Option<[OfVolume<R>; 2]>,
    /// First of the unit's nodes.
    node: usize,
}

/// Strain and stress at the points by a component of a node's displacement.
/// `[point][node][component of the tensor]`
type Strains<R, const N: usize> = [[[V3<R>; 6]; N]; 2];

impl<R: Lanes> LaneGroup<'_, R> {
    /// Adds a unit's stiffness.
    #[expect(
        clippy::too_many_arguments,
        reason = "the stages of a unit, each computed once"
    )]
    #[inline(always)]
    pub(super) fn add_stiffness<const N: usize>(
        &self,
        unit: &Unit<R, N>,
        ratios: &Ratios<R>,
        laws: &[LawAt<R>; 2],
        nodes: &Carried<R, N>,
        g: &[R; 2],
        change: VolumeChange<'_, R>,
        stiffness: &mut [[Row<R::Element>; 9]; N_BLOCKS],
    ) {
        let volume = match change {
            VolumeChange::Wedge { gradient, .. } => {
                for q in 0..2 {
                    for a in 0..N {
                        let into = &mut gradient[unit.node + a];
                        *into = axpy(unit.volumes[q], &nodes.turned[q][a], into);
                    }
                }
                None
            }
            VolumeChange::Mean(parts) => Some(parts),
        };
        let sigma = self.sigma(ratios);
        let bend = self.bend(ratios, laws, nodes, &sigma);
        let partner = self.partner(ratios, nodes, &sigma, &bend);
        let hardens = matches!(
            self.hardening,
            Hardening::Cubic { .. } | Hardening::Exponential { .. }
        );
        let steep = hardens.then(|| self.steep(ratios, laws, nodes, &sigma, &bend));
        let has_frames = laws[0].frame.is_some();
        let strains = has_frames.then(|| self.strains(laws, nodes, &sigma));
        let factors = Factors {
            nodes,
            bent: &bend.bent,
            partner: &partner,
            steep: steep.as_ref(),
            strains: strains.as_ref(),
            second: [laws[0].second, laws[1].second],
            spin: [g[0] * ratios.inv_j[0], g[1] * ratios.inv_j[1]],
            volume,
            node: unit.node,
        };
        for a in 0..N {
            self.add_row(&factors, a, stiffness);
        }
    }

    /// `δs_q = Σ_p sigma[q][p] δJ_p`.
    #[inline(always)]
    fn sigma(&self, ratios: &Ratios<R>) -> [[R; 2]; 2] {
        let Ratios { inv_j, v, s, .. } = ratios;
        let mut sigma = [[self.splat(0.0); 2]; 2];
        for q in 0..2 {
            for p in 0..2 {
                let own = if p == q { v[p] - s[q] } else { v[p] };
                sigma[q][p] = own * inv_j[q];
            }
        }
        sigma
    }

    #[inline(always)]
    fn bend<const N: usize>(
        &self,
        ratios: &Ratios<R>,
        laws: &[LawAt<R>; 2],
        nodes: &Carried<R, N>,
        sigma: &[[R; 2]; 2],
    ) -> Bend<R, N> {
        let zero = self.splat(0.0);
        let (v, inv_jb, normal) = (&ratios.v, ratios.inv_jb, &self.normal);
        let mut bend = Bend {
            d: [[zero; 2]; 2],
            slope_jb: [zero; 2],
            kappa: [zero; 2],
            bent: [[[zero; 3]; N]; 2],
            passing: [[[zero; 3]; N]; 2],
            parallel: [[[zero; 3]; N]; 2],
        };
        for q in 0..2 {
            let law = &laws[q];
            let slope_jb = law.b * inv_jb * self.splat(-2.0 / 3.0);
            let second_jb = law.b * inv_jb * inv_jb * self.splat(5.0 / 9.0) * law.n;
            let bent_normal = times_b(law.own.as_ref(), law.b, law.weight, normal);
            let eta = dot(&law.carried, &law.carried) * dot(normal, &bent_normal);
            let kappa = dot(&mul(&law.hat, normal), &law.carried);
            let fall = law.k * ratios.inv_j[q];
            for p in 0..2 {
                for r in 0..2 {
                    let mut sum = eta * sigma[q][p] * sigma[q][r];
                    let mixed = v[p].mul_add(sigma[q][r], v[r] * sigma[q][p]);
                    sum = (slope_jb * kappa).mul_add(mixed, sum);
                    sum = second_jb.mul_add(v[p] * v[r], sum);
                    if p == q {
                        sum = sum - fall * sigma[q][r];
                    }
                    if r == q {
                        sum = sum - fall * sigma[q][p];
                    }
                    bend.d[p][r] = bend.d[p][r] + sum;
                }
            }
            for a in 0..N {
                let hat = &nodes.hats[q][a];
                let bent = times_b(law.own.as_ref(), law.b, law.weight, hat);
                let one_way = scale(dot(normal, &bent), &law.carried);
                bend.bent[q][a] = bent;
                bend.passing[q][a] = axpy(nodes.along[q][a], &law.across, &one_way);
                bend.parallel[q][a] = mul(&law.hat, hat);
            }
            bend.slope_jb[q] = slope_jb;
            bend.kappa[q] = kappa;
        }
        bend
    }

    /// `y`, the partner of `j` in the stiffness.
    #[inline(always)]
    fn partner<const N: usize>(
        &self,
        ratios: &Ratios<R>,
        nodes: &Carried<R, N>,
        sigma: &[[R; 2]; 2],
        bend: &Bend<R, N>,
    ) -> PerNode<R, N> {
        let (zero, half) = (self.splat(0.0), self.splat(0.5));
        let mut partner = [[[zero; 3]; N]; 2];
        for a in 0..N {
            for p in 0..2 {
                let mut sum = [zero; 3];
                for q in 0..2 {
                    sum = axpy(sigma[q][p], &bend.passing[q][a], &sum);
                    sum = axpy(ratios.v[p] * bend.slope_jb[q], &bend.parallel[q][a], &sum);
                    sum = axpy(half * bend.d[p][q], &nodes.turned[q][a], &sum);
                }
                partner[p][a] = sum;
            }
        }
        partner
    }

    /// `ψ`, the change of the first invariant by a node's displacement.
    #[inline(always)]
    fn steep<const N: usize>(
        &self,
        ratios: &Ratios<R>,
        laws: &[LawAt<R>; 2],
        nodes: &Carried<R, N>,
        sigma: &[[R; 2]; 2],
        bend: &Bend<R, N>,
    ) -> PerNode<R, N> {
        let two = self.splat(2.0);
        let Ratios { v, inv_jb, y2, .. } = *ratios;
        let mut steep = [[[two; 3]; N]; 2];
        for q in 0..2 {
            for a in 0..N {
                let mut sum = scale(two * y2, &bend.parallel[q][a]);
                for p in 0..2 {
                    let by_jb = y2 * laws[q].n * inv_jb * self.splat(-2.0 / 3.0);
                    let factor = (two * y2 * bend.kappa[q]).mul_add(sigma[q][p], by_jb * v[p]);
                    sum = axpy(factor, &nodes.turned[p][a], &sum);
                }
                steep[q][a] = sum;
            }
        }
        steep
    }

    /// Strains by the nodes' displacements, and their stresses, of laws in principal stretches.
    #[inline(always)]
    fn strains<const N: usize>(
        &self,
        laws: &[LawAt<R>; 2],
        nodes: &Carried<R, N>,
        sigma: &[[R; 2]; 2],
    ) -> [Strains<R, N>; 2] {
        let mut both = [[[[[self.splat(0.0); 3]; 6]; N]; 2]; 2];
        for q in 0..2 {
            let law = &laws[q];
            let Some(frame) = &law.frame else { continue };
            for a in 0..N {
                let turn = axpy(
                    sigma[q][0],
                    &nodes.turned[0][a],
                    &scale(sigma[q][1], &nodes.turned[1][a]),
                );
                let hat = &nodes.hats[q][a];
                let of_node =
                    frame.strains(self.token, &law.hat, &law.carried, &self.normal, hat, &turn);
                both[1][q][a] = frame.stresses(law.weight, &of_node);
                both[0][q][a] = of_node;
            }
        }
        both
    }

    /// Adds the blocks between node `a` of the unit and all nodes up to it.
    #[inline(always)]
    fn add_row<const N: usize>(
        &self,
        factors: &Factors<'_, R, N>,
        a: usize,
        stiffness: &mut [[Row<R::Element>; 9]; N_BLOCKS],
    ) {
        let Carried { hats, turned, .. } = factors.nodes;
        let (bent, partner, spin) = (factors.bent, factors.partner, &factors.spin);
        // Factors of the rows of a, scaled once.
        let rows = factors.node + a;
        let lifted = factors
            .volume
            .as_ref()
            .map(|parts| [0, 1].map(|k| scale(parts[k].stiffness, &parts[k].gradient[rows])));
        let sharp = factors.steep.map(|steep| {
            [
                scale(factors.second[0], &steep[0][a]),
                scale(factors.second[1], &steep[1][a]),
            ]
        });
        for c in 0..=a {
            let columns = factors.node + c;
            let block = &mut stiffness[rows * (rows + 1) / 2 + columns];
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
                    if let (Some(sharp), Some(steep)) = (&sharp, factors.steep) {
                        for q in 0..2 {
                            sum = sharp[q][r].mul_add(steep[q][c][t], sum);
                        }
                    }
                    if let Some([strains, stresses]) = factors.strains {
                        for q in 0..2 {
                            for k in 0..6 {
                                let (stress, strain) = (&stresses[q][a][k], &strains[q][c][k]);
                                sum = stress[r].mul_add(strain[t], sum);
                            }
                        }
                    }
                    if let (Some(lifted), Some(parts)) = (&lifted, &factors.volume) {
                        for k in 0..2 {
                            sum = lifted[k][r].mul_add(parts[k].gradient[columns][t], sum);
                        }
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
