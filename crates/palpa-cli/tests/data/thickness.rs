//! Thickness of the layers of real limbs: as asked wherever there is room, measured from the skin.

use palpa_mesh::growth::{MAX_NODES, Thickness};
use palpa_mesh::{
    GrowthParams, LayerSpec, RepairOptions, Surface, SurfaceIndex, grow, read_surface, repair,
};

/// Share of the vertices that keep [`USUAL`].
const MOST: f64 = 0.95;
/// Error of a layer's thickness at most vertices, as a share of it.
const USUAL: f64 = 0.03;
/// Error of a layer's thickness at the worst vertex, as a share of it.
const WORST: f64 = 0.10;

/// Distance from a vertex to the nearest bone above which there is room for 5.5 mm of skin and fat
/// and a fifth of that for muscle, also where a column leans towards a nearer part of the bone. m
const AMPLE: f64 = 8e-3;

fn layer(name: &str, thickness: Option<f64>, n_levels: usize) -> LayerSpec {
    LayerSpec {
        name: name.to_owned(),
        thickness: thickness.map(Thickness::Constant),
        n_levels,
        min_thickness: 1e-4,
    }
}

fn read(file: &str) -> Surface {
    let surface = read_surface(&crate::data().join(file)).unwrap().surface;
    repair(&surface, &RepairOptions::default()).0
}

/// Grows the skin down to its bones and measures each layer at the vertices with room for it: by
/// growth's own report, and by the distance to the bones.
fn assert_kept(skin: &str, bones: &[Surface], n_levels: usize) {
    let layers = vec![
        layer("skin", Some(1.5e-3), 1),
        layer("fat", Some(4e-3), 1),
        layer("muscle", None, n_levels),
    ];
    let params = GrowthParams {
        layers,
        cut_out: None,
        coarsening: None,
        max_nodes: MAX_NODES,
    };
    let growth = grow(&read(skin), bones, &params).unwrap();
    let body = &growth.body;
    let index = SurfaceIndex::build(&body.skin);
    let depth = |v: usize, l: usize| {
        -index
            .closest(body.positions[body.node(v, l)])
            .unwrap()
            .signed_distance
    };
    let errors_at = |v: usize| {
        let (skin, fat) = (depth(v, 1), depth(v, 2));
        [skin / 1.5e-3 - 1.0, (fat - skin) / 4e-3 - 1.0].map(f64::abs)
    };
    let all = || 0..body.n_vertices();
    let mut errors: Vec<f64> = all()
        .filter(|&v| growth.thinning[v] >= 1.0)
        .flat_map(errors_at)
        .collect();
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| errors[(share * (errors.len() - 1) as f64).ceil() as usize];
    let shape = growth.report.scaled_jacobian;
    println!(
        "{skin}, {n_levels} levels: {} of {} vertices have room; error of a thickness: 95 % below {:.5}, largest {:.5}; \
         scaled Jacobian {:.3}, {:.3}, {:.3} (smallest, 5 %, median)",
        errors.len() / 2,
        body.n_vertices(),
        at(MOST),
        at(1.0),
        shape.min,
        shape.p05,
        shape.median
    );
    assert!(errors.len() > body.n_vertices(), "half of it has room");
    // Growth itself says where there is room, so that is not taken on trust: further from the bones
    // than this, and than an edge from the cut faces, there must be.
    let bones: Vec<SurfaceIndex> = bones.iter().map(SurfaceIndex::build).collect();
    let edge = body.skin.mean_edge_length();
    let is_far = |v: usize| {
        let p = body.skin.points[v];
        let to_bone = |b: &SurfaceIndex| b.closest(p).unwrap().signed_distance;
        bones.iter().all(|b| to_bone(b) >= AMPLE)
            && (body.cut_faces.iter()).all(|c| (p - c.point).dot(&c.normal).abs() > edge)
    };
    let mut far: Vec<f64> = all().filter(|&v| is_far(v)).flat_map(errors_at).collect();
    far.sort_by(f64::total_cmp);
    let usual = far[(MOST * (far.len() - 1) as f64).ceil() as usize];
    let largest = far[far.len() - 1];
    println!(
        "  {} vertices far from bones: {usual:.5}, {largest:.5}",
        far.len() / 2
    );
    assert!(
        far.len() > body.n_vertices(),
        "most of it is far from bones"
    );
    assert!(
        usual < USUAL && largest < WORST,
        "{skin}: {usual}, {largest}"
    );
    assert!(at(MOST) < USUAL && at(1.0) < WORST, "{skin}");
    assert!(
        growth.report.moved_share < 0.001,
        "{skin}: {:?}",
        growth.report
    );
    assert!(shape.min > 0.04, "{skin}: {shape:?}");
}

#[test]
fn a_forearm_keeps_its_layers() {
    let bones = [read("forearm/ulna.ply"), read("forearm/radius.ply")];
    for skin in [
        "forearm/forearm_skin_open_2k.ply",
        "forearm/forearm_skin_open_10k.ply",
        "forearm/forearm_skin_2k.obj",
    ] {
        assert_kept(skin, &bones, 4);
        assert_kept(skin, &bones, 1);
    }
}

#[test]
fn a_calf_keeps_its_layers() {
    let bones = [read("calf_mri/tibia.ply"), read("calf_mri/fibula.ply")];
    for skin in [
        "calf_mri/calf_skin_open_2k.ply",
        "calf_mri/calf_skin_open_10k.ply",
    ] {
        assert_kept(skin, &bones, 4);
        assert_kept(skin, &bones, 1);
    }
}
