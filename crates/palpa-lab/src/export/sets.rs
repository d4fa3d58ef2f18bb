//! Sets of nodes: those that move with the tool, those that stay, and those that stay in a plane.
//!
//! The middle node of an edge belongs to a set if both ends do.

use palpa_mesh::Vec3;

use super::Export;
use super::mesh::DeckMesh;

/// Two normals with a smaller sine between them count as the same.
const PARALLEL: f64 = 1e-6;

/// Sets of nodes, numbered from 0, and directions. All are disjoint, except `base` and `cut_faces`,
/// which are for the user of the deck.
#[derive(Debug)]
pub(super) struct Sets {
    /// Nodes that move with the tool.
    pub(super) patch: Vec<usize>,
    /// Nodes that stay.
    pub(super) fixed: Vec<usize>,
    /// Nodes that cannot move along some directions, grouped by these directions.
    pub(super) sliding: Vec<Sliding>,
    /// The rigid base.
    pub(super) base: Vec<usize>,
    /// Nodes of each cut face.
    pub(super) cut_faces: Vec<Vec<usize>>,
}

/// Nodes that cannot move along one or two directions.
#[derive(Debug)]
pub(super) struct Sliding {
    /// The held directions: unit vectors at right angles.
    pub(super) held: Vec<Vec3>,
    pub(super) nodes: Vec<usize>,
}

impl Sets {
    pub(super) fn build(export: &Export<'_>, mesh: &DeckMesh) -> Self {
        let body = export.body;
        let n = body.n_nodes();
        let marked = |nodes: &mut dyn Iterator<Item = usize>| {
            let mut is_marked = vec![false; n];
            nodes.for_each(|node| is_marked[node] = true);
            is_marked
        };
        let patch = mesh.with_middles(&marked(&mut export.patch.iter().copied()));
        let base = mesh.with_middles(&marked(&mut (0..n).filter(|&node| body.is_base(node))));
        let cut_faces = body.cut_faces.iter().map(|face| {
            let columns = face.vertices.iter().map(|&v| v as usize);
            let mut nodes = columns.flat_map(|v| (0..body.n_levels).map(move |l| body.node(v, l)));
            mesh.with_middles(&marked(&mut nodes))
        });
        let cut_faces = cut_faces.collect();

        let mut is_done = vec![false; mesh.nodes.len()];
        for &node in &patch {
            is_done[node] = true;
        }
        let normals = all_normals(export, mesh);
        let mut fixed = mesh.with_middles(&marked(&mut export.supports.fixed.iter().copied()));
        fixed.retain(|&node| !is_done[node]);
        for &node in &fixed {
            is_done[node] = true;
        }
        let mut sliding: Vec<Sliding> = Vec::new();
        for (node, normals) in normals.iter().enumerate() {
            if normals.is_empty() || is_done[node] {
                continue;
            }
            let held = orthonormal(normals);
            if held.len() == 3 {
                fixed.push(node);
                continue;
            }
            match sliding.iter_mut().find(|s| s.held == held) {
                Some(same) => same.nodes.push(node),
                None => sliding.push(Sliding {
                    held,
                    nodes: vec![node],
                }),
            }
        }
        fixed.sort_unstable();
        Self {
            patch,
            fixed,
            sliding,
            base,
            cut_faces,
        }
    }
}

/// For each node, the normals of the planes in which it stays.
fn all_normals(export: &Export<'_>, mesh: &DeckMesh) -> Vec<Vec<Vec3>> {
    let mut normals = vec![Vec::new(); mesh.nodes.len()];
    for &(node, normal) in &export.supports.planes {
        normals[node].push(normal);
    }
    let n = export.body.n_nodes();
    for (i, &[a, b]) in mesh.ends.iter().enumerate() {
        let shared = normals[a].iter().filter(|m| normals[b].contains(m));
        normals[n + i] = shared.copied().collect();
    }
    normals
}

/// Unit vectors at right angles that span the same directions.
fn orthonormal(normals: &[Vec3]) -> Vec<Vec3> {
    let mut held: Vec<Vec3> = Vec::new();
    for normal in normals {
        let rest = held.iter().fold(*normal, |rest, h| rest - h * rest.dot(h));
        if let Some(next) = rest.try_normalize(PARALLEL) {
            held.push(next);
        }
    }
    held
}
