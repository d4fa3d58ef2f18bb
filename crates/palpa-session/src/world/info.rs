//! The description of a world for a page: its layers, lumps, tool and stiffness.

use palpa_fem::lump::{Lump as PlacedLump, LumpShape};
use palpa_mesh::{LayeredBody, Vec3};
use palpa_scene::{MaterialStatus, Scene, Tool};
use palpa_viewer::control::{LayerInfo, LumpForm, LumpInfo, ToolInfo};

use super::World;

impl World {
    /// Largest distance of the tool's surface from its axis, m.
    pub(crate) fn tool_size(&self) -> f64 {
        self.tool.shape.map_or(0.0, |shape| shape.half_width())
    }

    /// Young's modulus at small strain of the layer at a depth (m) below the vertex of the skin that is
    /// nearest to a point, Pa; none for a network of bars.
    pub(crate) fn stiffness_below(&self, point: Vec3, depth: f64) -> Option<f64> {
        let body = &self.prepared()?.grown.growth.body;
        let distance = |v: &usize| (body.skin.points[*v] - point).norm_squared();
        let v = (0..body.n_vertices()).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let mut left = depth;
        let layer = body.interval_layer.iter().enumerate().find(|(i, _)| {
            let [above, below] = [*i, i + 1].map(|l| body.positions[body.node(v, l)]);
            left -= (below - above).norm();
            left <= 0.0
        });
        let layer = layer
            .map(|(_, layer)| layer)
            .or(body.interval_layer.last())?;
        Some(self.layers[*layer].stiffness)
    }

    /// Young's modulus at small strain of every prism of a body, Pa; for a network of bars the
    /// stiffness of a bar, N/m. `[n_prisms]`
    pub(crate) fn stiffness(&self, body: &LayeredBody, shows_lumps: bool) -> Vec<f32> {
        let lumps = if shows_lumps { self.placed() } else { &[] };
        let n_intervals = body.n_levels - 1;
        let mut all = Vec::with_capacity(body.n_prisms());
        for t in 0..body.skin.triangles.len() {
            for i in 0..n_intervals {
                let mut young = self.layers[body.interval_layer[i]].stiffness;
                let corners = body.prism(t, i);
                let middle = corners.iter().map(|&n| body.positions[n]).sum::<Vec3>() / 6.0;
                for (lump, info) in lumps.iter().zip(&self.lumps) {
                    young += lump.fraction(&middle) * (info.stiffness - young);
                }
                all.push(young as f32);
            }
        }
        all
    }
}

/// The layers from the skin down, with their mean thickness.
pub(super) fn layer_infos(scene: &Scene, body: &LayeredBody) -> Vec<LayerInfo> {
    let status = scene.material_status();
    let mut thickness = vec![0.0; scene.layers.len()];
    for v in 0..body.n_vertices() {
        for (i, &layer) in body.interval_layer.iter().enumerate() {
            let [above, below] = [i, i + 1].map(|l| body.positions[body.node(v, l)]);
            thickness[layer] += (below - above).norm() / body.n_vertices() as f64;
        }
    }
    status
        .into_iter()
        .zip(thickness)
        .map(|(status, thickness)| LayerInfo {
            stiffness: stiffness_of(&status),
            law: status.law.to_owned(),
            name: status.tissue,
            thickness,
        })
        .collect()
}

fn stiffness_of(status: &MaterialStatus) -> f64 {
    status.young.or(status.spring).unwrap_or(0.0)
}

/// The lumps where they lie. `placed` has the same order as the lumps of the scene.
pub(super) fn lump_infos(scene: &Scene, placed: &[PlacedLump]) -> Vec<LumpInfo> {
    let status = scene.lump_status();
    scene
        .lumps
        .iter()
        .zip(placed)
        .zip(status)
        .map(|((lump, placed), status)| {
            let axes = placed.pose().rotation.to_rotation_matrix();
            LumpInfo {
                name: lump.name.clone(),
                shape: match placed.shape() {
                    LumpShape::Sphere(sphere) => LumpForm::Ellipsoid {
                        radii: [sphere.radius(); 3],
                    },
                    LumpShape::Ellipsoid(ellipsoid) => LumpForm::Ellipsoid {
                        radii: ellipsoid.radii().into(),
                    },
                    LumpShape::Capsule(capsule) => LumpForm::Capsule {
                        radius: capsule.radius(),
                        length: capsule.length(),
                    },
                    LumpShape::Mesh(_) => LumpForm::Mesh {
                        radius: placed.bounding_sphere().1,
                    },
                },
                centre: placed.pose().translation.vector.into(),
                axes: [0, 1, 2].map(|c| axes.matrix().column(c).into_owned().into()),
                stiffness: stiffness_of(&status),
            }
        })
        .collect()
}

/// The tool.
pub(super) fn tool_info(tool: &Tool) -> ToolInfo {
    let tool = tool.contact();
    ToolInfo {
        shape: tool.map(|tool| tool.shape),
        friction: tool.map_or(0.0, |tool| tool.friction),
    }
}
