//! The rigid core that columns grow down to: bones, the membrane between two bones, and a smooth
//! field towards them.
//!
//! The skin of a limb is a tube, and there may be two bones in it. To let the tube shrink onto them
//! without tearing, bones that lie side by side are joined by a *membrane*: a thin strip between
//! their centre lines. (Forearm and leg have an interosseous membrane there.) Columns follow the
//! steepest ascent of a potential
//!
//! ```text
//! ψ(x) = Σ_j A_j / (|x − y_j|² + ε²)
//! ```
//! where `y_j` are the points of bones and membrane, and `A_j` their areas. The potential is smooth
//! and rises towards the core. It rounds off the creases of the true distance, where neighbouring
//! lines of steepest descent would part or meet: lines of a smooth gradient never cross. (The
//! potential of charges, with exponent 1 instead of 2, is harmonic, but it pulls the columns of the
//! flanks too far round. Exponent 4, close to the true distance, crowds them on the nearer bone.)
//! Sources are mirrored at the flat cut faces. There the field then has no component through the
//! face, so that the columns at a limb's end stay in it.

use std::collections::BTreeMap;

use super::GrowthError;
use crate::{CutFace, Surface, SurfaceIndex, Vec3};

/// Half the thickness of the membrane between two bones, as a share of the smaller bone's radius.
///
/// This value and the weight were chosen by tests on forearm and calf. On a forearm of 21,600
/// prisms, the first placing turns over more than 100 prisms at (0.3, 1) with exponent 4 of the
/// field, 35 with exponent 2, and 12 at (0.6, 4) with exponent 2.
const MEMBRANE_HALF_THICKNESS: f64 = 0.6;
/// Weight of the membrane relative to bone. The stronger pull keeps columns from all going to the
/// two bones.
const MEMBRANE_WEIGHT: f64 = 4.0;
/// Width over which the crease between bone and membrane is rounded, as a share of the half
/// thickness. The membrane ends in the centre of a bone, so on the bone's far side the two
/// distances differ by (1 − 0.6) radii. The width is smaller than that. So the rounding takes no
/// room there, where the skin is nearest.
const FILLET: f64 = 0.6;
/// Number of slices along the bones' length; each gives one point of each bone's centre line.
const N_SLICES: usize = 48;
/// Bones are joined only if they are closer than this many radii of the smaller one.
const MEMBRANE_REACH: f64 = 16.0;
/// If a bone ends at most this far before a cut face, as a share of the bones' length, the membrane
/// continues to the face.
const MEMBRANE_OVERHANG: f64 = 0.15;
/// Sources nearer to a cut face than this share of the bones' length are mirrored at it.
const MIRROR_REACH: f64 = 0.35;

/// Bones and the membranes between them, as columns see them.
pub(super) struct RigidCore {
    bones: Vec<SurfaceIndex>,
    membranes: Vec<Membrane>,
    sources: Vec<Source>,
    softening_sq: f64,
}

struct Membrane {
    strip: SurfaceIndex,
    half_thickness: f64,
}

#[derive(Clone, Copy)]
struct Source {
    point: Vec3,
    area: f64,
}

impl RigidCore {
    /// Prepares bones for a body with the given cut faces. All lengths are scaled by the bones, not
    /// by the body, so that a cut-out has the same core as the whole body.
    pub(super) fn build(bones: &[Surface], cuts: &[CutFace]) -> Self {
        let size = bones.iter().map(super::extent).fold(0.0, f64::max);
        // A slice must contain a ring of vertices of either bone.
        let ring = bones
            .iter()
            .map(Surface::mean_edge_length)
            .fold(0.0, f64::max);
        let pitch = (size / N_SLICES as f64).max(1.2 * ring);
        let spacing = size / 70.0;
        let mut sources = Vec::new();
        for bone in bones {
            sources.extend(thinned_sources(bone, spacing));
        }
        let axis = limb_axis(bones, cuts);
        let mut membranes = Vec::new();
        for (a, b) in neighbours(bones) {
            if let Some((strip, half_thickness)) = membrane(
                &bones[a],
                &bones[b],
                axis,
                pitch,
                cuts,
                MEMBRANE_OVERHANG * size,
            ) {
                let weighted = |s: Source| Source {
                    area: s.area * MEMBRANE_WEIGHT,
                    ..s
                };
                sources.extend(thinned_sources(&strip, spacing).into_iter().map(weighted));
                membranes.push(Membrane {
                    strip: SurfaceIndex::build(&strip),
                    half_thickness,
                });
            }
        }
        let sources = mirrored(sources, cuts, size * MIRROR_REACH);
        let bones = bones.iter().map(SurfaceIndex::build).collect();
        Self {
            bones,
            membranes,
            sources,
            softening_sq: (0.6 * spacing).powi(2),
        }
    }

    /// Distance to the core, negative inside it. The crease between bone and membrane is rounded. m
    pub(super) fn distance(&self, x: Vec3) -> f64 {
        let bone = self.bone_distance(x);
        self.membranes.iter().fold(bone, |d, m| {
            let Some(closest) = m.strip.closest(x) else {
                return d;
            };
            let to_membrane = (x - closest.point).norm() - m.half_thickness;
            smooth_min(d, to_membrane, FILLET * m.half_thickness)
        })
    }

    /// Distance to the nearest bone surface, negative inside. m
    pub(super) fn bone_distance(&self, x: Vec3) -> f64 {
        self.bones
            .iter()
            .filter_map(|b| b.closest(x))
            .map(|c| c.signed_distance)
            .min_by(f64::total_cmp)
            .unwrap_or(f64::INFINITY)
    }

    /// `x`, or the nearest point on a bone's surface if `x` lies inside the bone.
    pub(super) fn outside_bones(&self, x: Vec3) -> Vec3 {
        self.bones
            .iter()
            .filter_map(|b| b.closest(x))
            .find(|c| c.signed_distance < 0.0)
            .map_or(x, |c| c.point)
    }

    /// `x`, moved to the given distance from the nearest bone, along the shortest way.
    pub(super) fn at_bone_distance(&self, x: Vec3, distance: f64) -> Vec3 {
        let closest = self.bones.iter().filter_map(|b| b.closest(x));
        let Some(nearest) = closest.min_by(|a, b| a.signed_distance.total_cmp(&b.signed_distance))
        else {
            return x;
        };
        let outward = (x - nearest.point) * nearest.signed_distance.signum();
        let away = outward.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        nearest.point + away * distance
    }

    /// The unit direction of steepest ascent of the potential; zero where there is none.
    pub(super) fn direction(&self, x: Vec3) -> Vec3 {
        let mut sum = Vec3::zeros();
        for s in &self.sources {
            let r = s.point - x;
            let q = r.norm_squared() + self.softening_sq;
            sum += r * (s.area / (q * q));
        }
        sum.try_normalize(0.0).unwrap_or_else(Vec3::zeros)
    }
}

/// Returns an error if a bone comes out through the skin. Beyond the skin's open ends this is
/// allowed. `skin` is the whole skin, before a cut-out.
pub(super) fn check_inside(bones: &[Surface], skin: &Surface) -> Result<(), GrowthError> {
    let index = SurfaceIndex::build(skin);
    let ends = super::cut::find_cut_faces(skin);
    let near_end = 0.02 * super::extent(skin);
    let mut is_rim = vec![false; skin.points.len()];
    for v in skin.boundary_loops().into_iter().flatten() {
        is_rim[v as usize] = true;
    }
    let mut worst: Option<(f64, usize, Vec3)> = None;
    for (id, bone) in bones.iter().enumerate() {
        check_near(id, bone, skin)?;
        for &p in &bone.points {
            // Inside and outside are undefined beyond an end, and where the closest point is on a
            // rim.
            let is_beyond = |c: &CutFace| c.is_flat && (p - c.point).dot(&c.normal) > -near_end;
            if ends.iter().any(is_beyond) {
                continue;
            }
            let Some(closest) = index.closest(p) else {
                continue;
            };
            if skin.triangles[closest.triangle as usize]
                .iter()
                .any(|&v| is_rim[v as usize])
            {
                continue;
            }
            if closest.signed_distance > worst.map_or(0.0, |w| w.0) {
                worst = Some((closest.signed_distance, id, p));
            }
        }
    }
    match worst {
        None => Ok(()),
        Some((depth, bone, at)) => Err(GrowthError::BoneOutside {
            bone,
            depth,
            at: at.into(),
        }),
    }
}

/// Returns an error if no vertex of a bone lies within the box of the skin: then the frame or the
/// unit differs.
fn check_near(id: usize, bone: &Surface, skin: &Surface) -> Result<(), GrowthError> {
    let (Some(bone_box), Some(skin_box)) = (bone.bounds(), skin.bounds()) else {
        return Ok(());
    };
    let is_within = |p: &Vec3| (0..3).all(|i| skin_box.0[i] <= p[i] && p[i] <= skin_box.1[i]);
    if bone.points.iter().any(is_within) {
        return Ok(());
    }
    let both = |(lo, hi): (Vec3, Vec3)| [lo.into(), hi.into()];
    Err(GrowthError::BoneApart {
        bone: id,
        bone_box: both(bone_box),
        skin_box: both(skin_box),
    })
}

/// Polynomial minimum that rounds the crease of `min(a, b)` over a width `k`.
fn smooth_min(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// Represents a surface as points with areas. If it has many triangles, those in each cell of the
/// given size are merged. The result is deterministic because the cells are ordered.
fn thinned_sources(surface: &Surface, cell: f64) -> Vec<Source> {
    /// Cells make the field of a round bone a little uneven, so up to this many triangles are taken
    /// one by one.
    const FEW: usize = 2000;
    if surface.triangles.len() <= FEW {
        let source = |t: usize| {
            let [a, b, c] = surface.corners(t);
            Source {
                point: (a + b + c) / 3.0,
                area: surface.area_vector(t).norm(),
            }
        };
        return (0..surface.triangles.len())
            .map(source)
            .filter(|s| s.area > 0.0)
            .collect();
    }
    let mut cells: BTreeMap<[i64; 3], (Vec3, f64)> = BTreeMap::new();
    for t in 0..surface.triangles.len() {
        let [a, b, c] = surface.corners(t);
        let (centre, area) = ((a + b + c) / 3.0, surface.area_vector(t).norm());
        let key = [0, 1, 2].map(|i| (centre[i] / cell).floor() as i64);
        let entry = cells.entry(key).or_insert((Vec3::zeros(), 0.0));
        entry.0 += centre * area;
        entry.1 += area;
    }
    cells
        .into_values()
        .filter(|&(_, area)| area > 0.0)
        .map(|(sum, area)| Source {
            point: sum / area,
            area,
        })
        .collect()
}

/// Sources inside the body, and their mirror images at the flat cut faces.
fn mirrored(sources: Vec<Source>, cuts: &[CutFace], reach: f64) -> Vec<Source> {
    let flat: Vec<&CutFace> = cuts.iter().filter(|c| c.is_flat).collect();
    let height = |c: &CutFace, p: Vec3| (p - c.point).dot(&c.normal);
    let inside: Vec<Source> = sources
        .into_iter()
        .filter(|s| flat.iter().all(|c| height(c, s.point) <= 0.0))
        .collect();
    let mut all = inside.clone();
    for c in flat {
        for s in &inside {
            let h = height(c, s.point);
            if h > -reach {
                all.push(Source {
                    point: s.point - c.normal * (2.0 * h),
                    area: s.area,
                });
            }
        }
    }
    all
}

/// The direction along a limb: from one of its two flat cut faces to the other, or else the longest
/// extent of the bones.
fn limb_axis(bones: &[Surface], cuts: &[CutFace]) -> Vec3 {
    let ends: Vec<&CutFace> = cuts.iter().filter(|c| c.is_flat).collect();
    if let [a, b] = ends[..]
        && let Some(axis) = (b.point - a.point).try_normalize(0.0)
    {
        return axis;
    }
    let points: Vec<Vec3> = bones
        .iter()
        .flat_map(|b| b.points.iter().copied())
        .collect();
    let centre = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
    // Power iteration on the scatter matrix of the points. For a slender set, the largest
    // eigenvalue is far above the others.
    let mut axis = Vec3::new(1.0, 0.9, 0.8).normalize();
    for _ in 0..50 {
        let next: Vec3 = points
            .iter()
            .map(|p| (p - centre) * (p - centre).dot(&axis))
            .sum();
        axis = next.try_normalize(0.0).unwrap_or(axis);
    }
    axis
}

/// Pairs of bones to be joined: each bone and the nearest of the bones before it (a tree).
fn neighbours(bones: &[Surface]) -> Vec<(usize, usize)> {
    let centres: Vec<Vec3> = bones
        .iter()
        .map(|b| b.points.iter().sum::<Vec3>() / b.points.len().max(1) as f64)
        .collect();
    (1..bones.len())
        .filter_map(|b| {
            let nearest = (0..b).min_by(|&i, &j| {
                (centres[i] - centres[b])
                    .norm()
                    .total_cmp(&(centres[j] - centres[b]).norm())
            })?;
            Some((nearest, b))
        })
        .collect()
}

/// A bone's cross-section in one slice: centre and mean radius.
struct SliceOfBone {
    centre: Vec3,
    radius: f64,
}

/// Slices of a bone along the axis, counted from `start`.
fn slices(bone: &Surface, axis: Vec3, start: f64, pitch: f64) -> BTreeMap<i64, SliceOfBone> {
    let mut members: BTreeMap<i64, Vec<Vec3>> = BTreeMap::new();
    for p in &bone.points {
        members
            .entry(((p.dot(&axis) - start) / pitch).floor() as i64)
            .or_default()
            .push(*p);
    }
    members
        .into_iter()
        .filter(|(_, points)| points.len() >= 4)
        .map(|(slice, points)| {
            let n = points.len() as f64;
            let mut centre = points.iter().sum::<Vec3>() / n;
            centre += axis * (start + (slice as f64 + 0.5) * pitch - centre.dot(&axis));
            let off_axis = |p: &Vec3| {
                let r = p - centre;
                (r - axis * r.dot(&axis)).norm()
            };
            let radius = points.iter().map(off_axis).sum::<f64>() / n;
            (slice, SliceOfBone { centre, radius })
        })
        .collect()
}

/// The strip between the centre lines of two bones, over the slices that contain both bones, and
/// half its thickness.
fn membrane(
    a: &Surface,
    b: &Surface,
    axis: Vec3,
    pitch: f64,
    cuts: &[CutFace],
    reach: f64,
) -> Option<(Surface, f64)> {
    const ACROSS: usize = 8;
    let start = a
        .points
        .iter()
        .chain(&b.points)
        .map(|p| p.dot(&axis))
        .fold(f64::INFINITY, f64::min);
    let (slices_a, slices_b) = (slices(a, axis, start, pitch), slices(b, axis, start, pitch));
    let mut rows: Vec<(i64, Vec3, Vec3)> = Vec::new();
    let (mut radius_sum, mut n) = (0.0, 0.0);
    for (slice, sa) in &slices_a {
        let Some(sb) = slices_b.get(slice) else {
            continue;
        };
        let radius = sa.radius.min(sb.radius);
        if (sa.centre - sb.centre).norm() > MEMBRANE_REACH * radius {
            continue;
        }
        radius_sum += radius;
        n += 1.0;
        rows.push((*slice, sa.centre, sb.centre));
    }
    if rows.len() < 2 {
        return None;
    }
    extend_to_cuts(&mut rows, axis, pitch, cuts, reach);
    let mut strip = Surface::default();
    for (_, pa, pb) in &rows {
        for i in 0..=ACROSS {
            strip.points.push(pa.lerp(pb, i as f64 / ACROSS as f64));
        }
    }
    let row = ACROSS as u32 + 1;
    for r in 0..rows.len() - 1 {
        if rows[r + 1].0 - rows[r].0 > 2 {
            continue; // a gap in one of the bones
        }
        for i in 0..ACROSS as u32 {
            let p = r as u32 * row + i;
            strip.triangles.push([p, p + 1, p + row]);
            strip.triangles.push([p + 1, p + row + 1, p + row]);
        }
    }
    Some((strip, MEMBRANE_HALF_THICKNESS * radius_sum / n))
}

/// Extends the strip straight beyond the flat cut faces that its ends are close to. So the columns
/// of a cut face find a core even if a bone ends a little before the face.
fn extend_to_cuts(
    rows: &mut Vec<(i64, Vec3, Vec3)>,
    axis: Vec3,
    pitch: f64,
    cuts: &[CutFace],
    reach: f64,
) {
    for is_last in [false, true] {
        let step = if is_last { axis * pitch } else { -axis * pitch };
        let Some(&(slice, a, b)) = (if is_last { rows.last() } else { rows.first() }) else {
            return;
        };
        // Distance to the cut face ahead, measured along the axis.
        let ahead = cuts
            .iter()
            .filter(|c| c.is_flat && c.normal.dot(&step) > 0.5 * pitch)
            .map(|c| (c.point - a).dot(&c.normal) / (c.normal.dot(&step) / pitch))
            .find(|&d| d > 0.0 && d < reach);
        let Some(ahead) = ahead else { continue };
        for i in 1..=(ahead / pitch).ceil() as i64 + 1 {
            let row = (
                slice + if is_last { i } else { -i },
                a + step * i as f64,
                b + step * i as f64,
            );
            rows.insert(if is_last { rows.len() } else { 0 }, row);
        }
    }
}
