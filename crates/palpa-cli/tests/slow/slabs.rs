//! Meshes of the loop and of its audit on flat layers, against a solution by other means.

use std::fmt::Write as _;
use std::path::Path;

use palpa::audit::{REFERENCE_SHARE, Reference};
use palpa::live::LiveScene;
use palpa_fem::PosedTool;
use palpa_mesh::Vec3;
use palpa_scene::Scene;

/// Depths, m.
const DEPTHS: [f64; 2] = [3e-3, 5e-3];

/// Thin skin, soft fat and muscle on a rigid base, or the layers of benchmark B2.
struct Slab {
    layers: [(&'static str, f64); 3],
    /// Forces on a ball of 10 mm at 3 and at 5 mm, N: axisymmetric elements with quadratic displacements
    /// and linear pressures, 0.6 mm long under the ball, on a cylinder of 50 mm (B2: 56.4 mm, as large as
    /// the block); contact by a penalty that moves them by 0.2 % if it is four times as stiff.
    expected: [f64; 2],
}

const SKIN: &str = r#"young = "210 kPa", poisson = 0.45"#;
const FAT: &str = r#"c10 = "0.42 kPa", bulk = "36 kPa""#;
const MUSCLE: &str = r#"young = "22 kPa", poisson = 0.45"#;

const SLABS: [Slab; 3] = [
    Slab {
        layers: [(SKIN, 1.5), (FAT, 4.0), (MUSCLE, 4.0)],
        expected: [0.9285, 3.085],
    },
    Slab {
        layers: [(SKIN, 1.5), (FAT, 4.0), (MUSCLE, 15.0)],
        expected: [0.619, 1.683],
    },
    Slab {
        layers: [
            (r#"young = "100 kPa", poisson = 0.45"#, 2.0),
            (r#"young = "5 kPa", poisson = 0.45"#, 10.0),
            (r#"young = "30 kPa", poisson = 0.45"#, 28.0),
        ],
        expected: [0.3606, 0.890],
    },
];

impl Slab {
    fn scene(&self) -> Scene {
        let depth: f64 = self.layers.iter().map(|(_, t)| t).sum();
        let mut text = format!(
            "[body]\ngenerator = {{ kind = \"block\", size = [\"100 mm\", \"100 mm\", \"{depth} mm\"], spacing = \"10 mm\" }}\n"
        );
        for (i, (tissue, thickness)) in self.layers.iter().enumerate() {
            text.push_str("[[layer]]\n");
            writeln!(text, "tissue = {{ name = \"layer {i}\", {tissue} }}").unwrap();
            if i < 2 {
                writeln!(text, "thickness = \"{thickness} mm\"").unwrap();
            }
        }
        text += r#"
            [tool]
            shape = "sphere"
            radius = "10 mm"
            [press]
            at = ["3 mm", "2 mm", "0 mm"]
            depth = "4 mm"
            [motion]
            kind = "stroke"
            depth = "5 mm"
            length = "20 mm"
        "#;
        Scene::parse(&text, Path::new(".")).unwrap()
    }
}

/// Errors of the forces, the loop's on its mesh and the audit's.
fn errors(slab: &Slab) -> [[f64; 2]; 2] {
    let live = LiveScene::build(&slab.scene()).unwrap();
    let own = Reference::on(&live.prepared).unwrap();
    let place = live.prepared.place();
    let at_depth = |depth: f64, expected: f64| {
        let mut pose = live.scene_from_device;
        // Beside the place, on the way of the stroke.
        let at = place.at + Vec3::new(4e-3, 0.0, 0.0);
        pose.translation.vector = at + place.direction.into_inner() * depth;
        let tool = PosedTool {
            tool: live.tool,
            pose,
        };
        let finer = Reference::round(&live.prepared, pose.translation.vector, REFERENCE_SHARE);
        [&own, &finer.unwrap()].map(|mesh| {
            let error = mesh.press(&tool).unwrap().norm() / expected - 1.0;
            println!(
                "{} nodes, {:.0} mm deep: {:+.2} %",
                mesh.n_nodes(),
                1e3 * depth,
                1e2 * error
            );
            error
        })
    };
    let [[a, b], [c, d]] = [0, 1].map(|i| at_depth(DEPTHS[i], slab.expected[i]));
    [[a, c], [b, d]]
}

#[test]
fn meshes_of_the_loop_and_of_its_audit_agree_with_an_axisymmetric_solution() {
    for slab in &SLABS {
        let [own, reference] = errors(slab);
        assert!(own.iter().all(|e| e.abs() < 0.07), "{own:?}");
        assert!(reference.iter().all(|e| e.abs() < 0.015), "{reference:?}");
    }
}
