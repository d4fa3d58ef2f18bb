//! Sections tile the cut: areas against formulas, neighbours without gaps, pictures that are not
//! blank.

use std::f64::consts::PI;

use palpa_mesh::{LayeredBody, Surface, Vec3};
use palpa_plot::section::{
    Panel, Plane, Scale, Section, Shades, SkinShades, ToolOutline, cut_body, cut_surface, draw,
    polygon_area, tissue_means,
};
use resvg::tiny_skia::Pixmap;

use crate::results;

/// A body whose node of column `v` at level `l` is `node(v, l)`.
fn body(
    triangles: Vec<[u32; 3]>,
    n_vertices: u32,
    layers: &[usize],
    node: impl Fn(u32, usize) -> Vec3,
) -> LayeredBody {
    let n_levels = layers.len() + 1;
    LayeredBody {
        skin: Surface {
            points: (0..n_vertices).map(|v| node(v, 0)).collect(),
            triangles,
        },
        positions: (0..n_vertices)
            .flat_map(|v| (0..n_levels).map(move |l| (v, l)))
            .map(|(v, l)| node(v, l))
            .collect(),
        n_levels,
        interval_layer: layers.to_vec(),
        layer_names: ["skin", "fat", "muscle"].map(str::to_owned).to_vec(),
        cut_faces: Vec::new(),
    }
}

/// Two triangles a cell over an `n × m` grid of vertices, the first index running fastest; the grid
/// closes on itself in the first direction if `is_ring`.
fn grid(n: u32, m: u32, is_ring: bool) -> Vec<[u32; 3]> {
    let columns = if is_ring { n } else { n - 1 };
    (0..m - 1)
        .flat_map(|j| (0..columns).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b] = [j * n + i, j * n + (i + 1) % n];
            [[a, b, b + n], [a, b + n, a + n]]
        })
        .collect()
}

/// A block of 100 × 100 × 40 mm, its top at z = 0.
fn block() -> LayeredBody {
    body(grid(11, 11, false), 121, &[0, 1, 1, 2, 2], |v, l| {
        let [x, y] = [f64::from(v % 11), f64::from(v / 11)];
        Vec3::new(x * 0.01, y * 0.01, -0.04 * l as f64 / 5.0)
    })
}

/// A tube of 50 mm radius round a bone of 10 mm, along x from 0 to 0.2.
fn tube(n: u32) -> LayeredBody {
    body(grid(n, 21, true), 21 * n, &[0, 1, 2, 2, 2], |v, l| {
        let angle = -2.0 * PI * f64::from(v % n) / f64::from(n);
        let radius = [0.05, 0.048, 0.042, 0.03, 0.02, 0.01][l];
        Vec3::new(
            f64::from(v / n) * 0.01,
            radius * angle.cos(),
            radius * angle.sin(),
        )
    })
}

fn area(section: &Section, layer: Option<usize>) -> f64 {
    section
        .cells
        .iter()
        .filter(|cell| layer.is_none_or(|layer| cell.layer == layer))
        .map(|cell| polygon_area(&cell.outline))
        .sum()
}

#[test]
fn a_block_has_the_area_of_its_section_in_any_direction() {
    let block = block();
    let centre = Vec3::new(0.05, 0.05, -0.02);
    // The normal, and the area of the cut through the centre: straight, oblique in plan, and
    // through nodes.
    let oblique = 0.1 / 0.3_f64.cos();
    for (normal, expected) in [
        (Vec3::x(), 0.1 * 0.04),
        (Vec3::y(), 0.1 * 0.04),
        (Vec3::z(), 0.1 * 0.1),
        (Vec3::new(0.3_f64.cos(), 0.3_f64.sin(), 0.0), oblique * 0.04),
        (Vec3::new(1.0, 1.0, 0.0), 2.0_f64.sqrt() * 0.1 * 0.04),
        // Leaning so little that it leaves through top and bottom.
        (
            Vec3::new(1.0, 0.0, 0.2),
            0.1 * 0.04 * (1.0_f64 + 0.04).sqrt(),
        ),
    ] {
        let plane = Plane::new(centre, normal, Vec3::new(0.1, 0.2, 1.0)).unwrap();
        let section = cut_body(&block, &block.positions, &plane);
        let found = area(&section, None);
        assert!(
            (found - expected).abs() < 1e-9 * expected,
            "{normal:?}: {found} for {expected}"
        );
    }
}

#[test]
fn layers_have_their_share_and_borders_their_length() {
    let block = block();
    let plane = Plane::new(Vec3::new(0.033, 0.0, 0.0), Vec3::x(), Vec3::z()).unwrap();
    let section = cut_body(&block, &block.positions, &plane);
    for (layer, thickness) in [(0, 0.008), (1, 0.016), (2, 0.016)] {
        let found = area(&section, Some(layer));
        assert!(
            (found - 0.1 * thickness).abs() < 1e-12,
            "layer {layer}: {found}"
        );
    }
    // Skin, two borders between layers, base: 100 mm each, and no line twice.
    assert_eq!((section.borders.len(), section.base.len()), (3, 1));
    for border in section.borders.iter().chain(&section.base) {
        let length: f64 = border
            .windows(2)
            .map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]))
            .sum();
        assert!((length - 0.1).abs() < 1e-12, "{length}");
    }
}

#[test]
fn a_tube_has_the_area_of_its_polygon() {
    for n in [24, 97] {
        let tube = tube(n);
        for x in [0.1, 0.1037] {
            let plane = Plane::new(Vec3::new(x, 0.0, 0.0), Vec3::x(), Vec3::z()).unwrap();
            let section = cut_body(&tube, &tube.positions, &plane);
            // Its n-gon: the diagonals of the cells, straight along the tube, add corners but no
            // area.
            let n_gon = 0.5 * f64::from(n) * (2.0 * PI / f64::from(n)).sin();
            let expected = n_gon * (0.05 * 0.05 - 0.01 * 0.01);
            let found = area(&section, None);
            assert!(
                (found - expected).abs() < 1e-9 * expected,
                "{n}, {x}: {found} for {expected}"
            );
            if n == 97 {
                let circle = PI * (0.05 * 0.05 - 0.01 * 0.01);
                assert!(
                    (found - circle).abs() < 0.01 * circle,
                    "{found} for {circle}"
                );
            }
            assert_eq!((section.borders.len(), section.base.len()), (3, 1));
            let mut lines = section.borders.iter().chain(&section.base);
            assert!(lines.all(|line| line.first() == line.last()));
        }
    }
}

#[test]
fn twisted_prisms_tile_their_outline() {
    // Level by level the columns wind round z, so that the side faces are saddles.
    let twisted = body(grid(7, 7, false), 49, &[0, 1], |v, l| {
        let [x, y] = [f64::from(v % 7) - 3.0, f64::from(v / 7) - 3.0];
        let (sin, cos) = (0.5 * l as f64).sin_cos();
        Vec3::new(cos * x - sin * y, sin * x + cos * y, -2.0 * l as f64)
    });
    for k in 0..40 {
        let angle = 0.1571 * f64::from(k);
        let normal = Vec3::new(angle.cos(), angle.sin(), 0.3);
        let plane = Plane::new(Vec3::new(0.123, 0.05, -1.9), normal, Vec3::z()).unwrap();
        let section = cut_body(&twisted, &twisted.positions, &plane);
        // Edges that only one cell has make up the outline; its area is that of the cells.
        let mut sides: Vec<[[i64; 2]; 2]> = Vec::new();
        let key = |p: [f64; 2]| p.map(|c| (c * 1e9).round() as i64);
        let mut outline = 0.0;
        for cell in &section.cells {
            for (i, &p) in cell.outline.iter().enumerate() {
                let q = cell.outline[(i + 1) % cell.outline.len()];
                outline += 0.5 * (p[0] * q[1] - p[1] * q[0]);
                sides.push([key(p), key(q)]);
            }
        }
        let cells = area(&section, None);
        assert!(
            (outline.abs() - cells).abs() < 1e-9 * cells,
            "cut {k}: a cell runs the other way"
        );
        let inner = sides
            .iter()
            .filter(|[p, q]| sides.contains(&[*q, *p]))
            .count();
        assert!(
            inner > sides.len() / 2,
            "cut {k}: {inner} of {} sides are shared",
            sides.len()
        );
    }
}

#[test]
fn a_plane_beside_the_body_cuts_nothing() {
    let block = block();
    let plane = Plane::new(Vec3::new(0.2, 0.0, 0.0), Vec3::x(), Vec3::z()).unwrap();
    assert_eq!(cut_body(&block, &block.positions, &plane).cells, vec![]);
    assert_eq!(
        cut_surface(&block.skin, &plane),
        Vec::<Vec<[f64; 2]>>::new()
    );
    assert_eq!(Plane::new(Vec3::zeros(), Vec3::zeros(), Vec3::z()), None);
    assert_eq!(Plane::new(Vec3::zeros(), Vec3::z(), -Vec3::z()), None);
}

#[test]
fn the_picture_shows_rest_and_pressed_side_by_side() {
    let tube = tube(48);
    let bone = Surface {
        points: (0..21 * 24)
            .map(|v| {
                let angle = -PI * f64::from(v % 24) / 12.0;
                Vec3::new(
                    f64::from(v / 24) * 0.01,
                    0.008 * angle.cos(),
                    0.008 * angle.sin(),
                )
            })
            .collect(),
        triangles: grid(24, 21, true),
    };
    let plane = Plane::new(Vec3::new(0.1, 0.0, 0.0), Vec3::x(), Vec3::z()).unwrap();
    let pressed: Vec<Vec3> = tube
        .positions
        .iter()
        .map(|p| {
            let share = ((p.yz().norm() - 0.01) / 0.04) * (-(p.y / 0.02).powi(2)).exp();
            p - Vec3::z() * 0.012 * share * f64::from(u8::from(p.z > 0.0))
        })
        .collect();
    let rest = cut_body(&tube, &tube.positions, &plane);
    let deformed = cut_body(&tube, &pressed, &plane);
    let bones = cut_surface(&bone, &plane);
    let tool = |z| ToolOutline::disc(&plane, &Vec3::new(0.1, 0.0, z), &-Vec3::z(), 0.008);
    let panel = |title, section, z| Panel {
        title,
        section,
        bones: &bones,
        lumps: &[],
        shades: None,
        tool: Some(tool(z)),
    };
    let picture = draw(
        "A limb, pressed",
        "section at x = 100 mm · disc of 8 mm radius",
        &[
            panel("at rest", &rest, 0.05),
            panel("pressed by 12 mm", &deformed, 0.038),
        ],
    );
    let [_, png] = picture.save(&results("section"), "tube").unwrap();
    let pixels = Pixmap::decode_png(&std::fs::read(png).unwrap()).unwrap();
    let colored = pixels
        .pixels()
        .iter()
        .filter(|p| p.red() > p.blue().saturating_add(30))
        .count();
    assert!(
        colored * 10 > pixels.pixels().len(),
        "{colored} of {}",
        pixels.pixels().len()
    );
}

#[test]
fn means_are_those_of_one_tissue_and_jump_between_two() {
    let block = block();
    let n_intervals = block.n_levels - 1;
    let layer = |p: usize| block.interval_layer[p % n_intervals];
    let tissue: Vec<usize> = (0..block.n_prisms()).map(layer).collect();
    // Even in each layer: the means are the values, and the layers differ at the same node.
    let even: Vec<f64> = tissue.iter().map(|&l| [10.0, 1.0, 5.0][l]).collect();
    let means = tissue_means(&block, &tissue, &even);
    let plane = Plane::new(Vec3::new(0.033, 0.05, 0.0), Vec3::x(), Vec3::z()).unwrap();
    let section = cut_body(&block, &block.positions, &plane);
    for cell in &section.cells {
        for place in &cell.places {
            let found = means.at(cell.prism, place);
            assert!((found - even[cell.prism]).abs() < 1e-12, "{found}");
        }
    }
    // Linear across the block: at inner nodes the means are exact, and they are smooth inside a layer
    // where the values of prisms are not.
    let middle = |p: usize| -> f64 {
        let nodes = block.prism(p / n_intervals, p % n_intervals);
        nodes.iter().map(|&n| block.positions[n].y).sum::<f64>() / 6.0
    };
    let steps: Vec<f64> = (0..block.n_prisms()).map(middle).collect();
    let means = tissue_means(&block, &tissue, &steps);
    let mut n_inner = 0;
    for cell in &section.cells {
        for (place, [right, _]) in cell.places.iter().zip(&cell.outline) {
            let y = place.value(|node| block.positions[node].y);
            if (0.0101..0.0899).contains(&y) {
                let found = means.at(cell.prism, place);
                assert!((found - y).abs() < 1e-9, "{found} for {y} at {right}");
                n_inner += 1;
            }
        }
    }
    assert!(n_inner > 100, "{n_inner}");
}

#[test]
fn shaded_cells_cover_the_section_and_the_skin_has_its_band() {
    let block = block();
    let field: Vec<f64> = (0..block.n_prisms())
        .map(|p| 1.0 + (p % 7) as f64)
        .collect();
    let means = tissue_means(&block, &vec![0; block.n_prisms()], &field);
    let plane = Plane::new(Vec3::new(0.033, 0.05, 0.0), Vec3::x(), Vec3::z()).unwrap();
    let section = cut_body(&block, &block.positions, &plane);
    let pressure: Vec<f64> = (block.skin.points.iter())
        .map(|p| 12.0 * (1.0 - (p.y - 0.05).abs() / 0.02).max(0.0))
        .collect();
    let picture = |on_skin| {
        draw(
            "Stress",
            "in a block",
            &[Panel {
                title: "pressed",
                section: &section,
                bones: &[],
                lumps: &[],
                shades: Some(Shades {
                    name: "stress, kPa",
                    values: &means,
                    scale: Scale::Linear(15.0),
                    on_skin,
                }),
                tool: None,
            }],
        )
    };
    let with = picture(Some(SkinShades {
        name: "contact pressure",
        values: &pressure,
        largest: 12.3,
    }));
    for text in [
        ">15.0<",
        ">3.00<",
        "contact pressure (band):",
        "largest 12.3",
    ] {
        assert!(with.svg().contains(text), "{text}");
    }
    let without = picture(None);
    assert!(!without.svg().contains("largest"));
    assert!(with.svg().matches("stroke-width=\"5\"").count() >= 20);
    assert_eq!(without.svg().matches("stroke-width=\"5\"").count(), 0);
    // No white between the cells: every pixel of a row inside the block is coloured.
    let pixels = Pixmap::decode_png(&without.png().unwrap()).unwrap();
    let (width, height) = (pixels.width(), pixels.height());
    let row: Vec<bool> = (0..width)
        .map(|x| pixels.pixel(x, height / 2).unwrap().blue() < 250)
        .collect();
    let first = row.iter().position(|&is_colored| is_colored).unwrap();
    let n = row[first..].iter().take_while(|&&c| c).count();
    assert!(n > 1000, "{n} of {width}");
}
