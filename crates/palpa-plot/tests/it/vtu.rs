//! VTU files are what was given, read back by an independent reader.

use palpa_mesh::{LayeredBody, Surface, Vec3};
use palpa_plot::vtu::{Grid, write_series};
use vtkio::Vtk;
use vtkio::model::{Attribute, DataSet, IOBuffer, Piece, UnstructuredGridPiece};

use crate::results;

/// Two cells of a unit square, 2 layers in 3 intervals of 10 mm, tops at z = 0.
fn slab() -> LayeredBody {
    let corners = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]];
    let skin = Surface {
        points: corners.iter().map(|&[x, y]| Vec3::new(x, y, 0.0)).collect(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let positions = skin
        .points
        .iter()
        .flat_map(|p| (0..4).map(move |l| p - Vec3::z() * 0.01 * f64::from(l)))
        .collect();
    LayeredBody {
        skin,
        positions,
        n_levels: 4,
        interval_layer: vec![0, 1, 1],
        layer_names: vec!["skin".to_owned(), "fat -- soft".to_owned()],
        cut_faces: Vec::new(),
    }
}

fn read(path: &std::path::Path) -> UnstructuredGridPiece {
    let vtk = Vtk::import(path).unwrap();
    let DataSet::UnstructuredGrid { pieces, .. } = vtk.data else {
        panic!("no unstructured grid");
    };
    match pieces.into_iter().next().unwrap() {
        Piece::Inline(piece) => *piece,
        other => panic!("{other:?}"),
    }
}

fn floats(attributes: &[Attribute], name: &str) -> Vec<f64> {
    let array = attributes
        .iter()
        .find_map(|attribute| match attribute {
            Attribute::DataArray(array) if array.name == name => Some(array),
            _ => None,
        })
        .unwrap_or_else(|| panic!("no array {name}"));
    array.data.cast_into().unwrap()
}

#[test]
fn a_body_is_read_back_as_it_was() {
    let body = slab();
    let moved: Vec<Vec3> = body.positions.iter().map(|p| p * 1.25).collect();
    let displacement: Vec<Vec3> = moved
        .iter()
        .zip(&body.positions)
        .map(|(a, b)| a - b)
        .collect();
    let grid = Grid::of_body(&body, &moved)
        .with_point_vectors("displacement", &displacement)
        .with_point_scalars("standoff & <thinning>", (0..16).map(f64::from).collect())
        .with_cell_scalars("young", vec![12e3; 6]);
    let dir = results("vtu");
    let file = dir.write_with("slab.vtu", |w| grid.write(w)).unwrap();
    dir.write_with("slab.pvd", |w| {
        write_series(
            w,
            &[(0.0, "slab.vtu".to_owned()), (0.5, "slab.vtu".to_owned())],
        )
    })
    .unwrap();

    let piece = read(&file);
    let points: Vec<f64> = piece.points.cast_into().unwrap();
    let expected: Vec<f64> = moved.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    assert_eq!(points, expected);
    assert!(piece.cells.types.iter().all(|&t| t as u8 == 13));
    let (connectivity, offsets) = piece.cells.cell_verts.into_xml();
    assert_eq!(offsets, [6, 12, 18, 24, 30, 36]);
    // The first prism: vertices 0, 1, 2 with levels 1 (lower, first) and 0.
    assert_eq!(connectivity[..6], [1, 5, 9, 0, 4, 8]);
    let flat: Vec<f64> = displacement.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    assert_eq!(floats(&piece.data.point, "displacement"), flat);
    assert_eq!(
        floats(&piece.data.point, "level")[..5],
        [0.0, 1.0, 2.0, 3.0, 0.0]
    );
    assert_eq!(
        floats(&piece.data.cell, "layer"),
        [0.0, 1.0, 1.0, 0.0, 1.0, 1.0]
    );
    assert!(
        floats(&piece.data.cell, "scaled_jacobian")
            .iter()
            .all(|&q| q > 0.5)
    );
    assert_eq!(floats(&piece.data.cell, "young"), [12e3; 6]);
}

#[test]
fn a_surface_is_read_back_as_it_was() {
    let skin = slab().skin;
    let dir = results("vtu");
    let file = dir
        .write_with("surface.vtu", |w| Grid::of_surface(&skin).write(w))
        .unwrap();
    let piece = read(&file);
    assert_eq!(piece.cells.types.len(), 2);
    assert!(matches!(piece.points, IOBuffer::F64(ref p) if p.len() == 12));
    assert_eq!(piece.cells.cell_verts.into_xml().0, [0, 1, 2, 0, 2, 3]);
}
