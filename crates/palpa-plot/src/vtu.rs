//! VTK unstructured grids (`.vtu`) and their time series (`.pvd`), for ParaView, pyvista and
//! meshio.
//!
//! Arrays are inline, as base64-encoded binary. Appended raw data would be smaller, but it is not
//! XML, and meshio refuses it. The `vtkio` crate is only a release candidate, so we use it only in
//! tests, to read our files back.
//!
//! ```text
//!      5            VTK's manual wants the normal of 0 1 2 to point out of a wedge, but its own code (and
//!     /|\           CalculiX, gmsh, meshio) counts the volume as positive when that normal points in, to
//!    3-+-4          3 4 5. We follow the code: our lower triangle comes first.
//!    | 2 |
//!    |/ \|          skin above: 3 4 5 are v0 v1 v2 of `LayeredBody::prism`, 0 1 2 are v3 v4 v5
//!    0---1
//! ```

use std::io::{self, Write};

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use palpa_mesh::quality::prism_shapes;
use palpa_mesh::{LayeredBody, Surface, Vec3};

const VTK_TRIANGLE: u8 = 5;
const VTK_WEDGE: u8 = 13;

/// A grid of cells of one kind, with arrays over its points and over its cells.
#[derive(Debug, Clone)]
pub struct Grid {
    points: Vec<f64>,
    cell_type: u8,
    nodes_per_cell: usize,
    connectivity: Vec<u32>,
    point_data: Vec<Array>,
    cell_data: Vec<Array>,
    comment: String,
}

#[derive(Debug, Clone)]
struct Array {
    name: String,
    n_components: usize,
    values: Values,
}

#[derive(Debug, Clone)]
enum Values {
    Float(Vec<f64>),
    Index(Vec<u32>),
}

impl Grid {
    /// The prisms of `body` with its nodes at `positions`, in metres.
    ///
    /// Point arrays: `level` (0 is the skin). Cell arrays: `layer` (from the skin down) and
    /// `scaled_jacobian` at `positions` (1 is best; at 0 and below, a prism is flat or inverted).
    /// Cells are ordered by triangle, then by interval.
    ///
    /// # Panics
    /// If `positions` does not hold one point per node.
    pub fn of_body(body: &LayeredBody, positions: &[Vec3]) -> Self {
        assert_eq!(positions.len(), body.n_nodes(), "one position per node");
        let n_triangles = body.skin.triangles.len();
        let n_intervals = body.n_levels - 1;
        let connectivity = (0..n_triangles)
            .flat_map(|t| (0..n_intervals).map(move |i| (t, i)))
            .flat_map(|(t, i)| {
                let [a, b, c, d, e, f] = body.prism(t, i);
                [d, e, f, a, b, c].map(|node| node as u32)
            })
            .collect();
        let level = (0..body.n_nodes()).map(|node| (node % body.n_levels) as u32);
        let layer = (0..n_triangles).flat_map(|_| body.interval_layer.iter().map(|&l| l as u32));
        let quality = prism_shapes(body, positions)
            .iter()
            .map(|s| s.scaled_jacobian)
            .collect();
        let names: Vec<String> = body
            .layer_names
            .iter()
            .enumerate()
            .map(|(i, name)| format!("{i} {name}"))
            .collect();
        Self {
            points: flat(positions),
            cell_type: VTK_WEDGE,
            nodes_per_cell: 6,
            connectivity,
            point_data: vec![Array::new("level", 1, Values::Index(level.collect()))],
            cell_data: vec![
                Array::new("layer", 1, Values::Index(layer.collect())),
                Array::new("scaled_jacobian", 1, Values::Float(quality)),
            ],
            comment: format!("layers from the skin down: {}", names.join(", ")),
        }
    }

    /// The triangles of a surface, for example of a bone.
    pub fn of_surface(surface: &Surface) -> Self {
        Self {
            points: flat(&surface.points),
            cell_type: VTK_TRIANGLE,
            nodes_per_cell: 3,
            connectivity: surface.triangles.iter().flatten().copied().collect(),
            point_data: Vec::new(),
            cell_data: Vec::new(),
            comment: String::new(),
        }
    }

    /// Adds a scalar per point. If the unit is not SI, give it in the name.
    ///
    /// # Panics
    /// If there is not one value per point.
    #[must_use]
    pub fn with_point_scalars(mut self, name: &str, values: Vec<f64>) -> Self {
        assert_eq!(
            values.len(),
            self.n_points(),
            "one value of {name} per point"
        );
        self.point_data
            .push(Array::new(name, 1, Values::Float(values)));
        self
    }

    /// Adds a vector per point: `displacement` in metres, `force` in newtons.
    ///
    /// # Panics
    /// If there is not one value per point.
    #[must_use]
    pub fn with_point_vectors(mut self, name: &str, values: &[Vec3]) -> Self {
        assert_eq!(
            values.len(),
            self.n_points(),
            "one value of {name} per point"
        );
        self.point_data
            .push(Array::new(name, 3, Values::Float(flat(values))));
        self
    }

    /// Adds a scalar per cell.
    ///
    /// # Panics
    /// If there is not one value per cell.
    #[must_use]
    pub fn with_cell_scalars(mut self, name: &str, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), self.n_cells(), "one value of {name} per cell");
        self.cell_data
            .push(Array::new(name, 1, Values::Float(values)));
        self
    }

    /// Adds a 3 × 3 tensor per cell, row by row: `cauchy` in pascals.
    ///
    /// # Panics
    /// If there is not one value per cell.
    #[must_use]
    pub fn with_cell_tensors(mut self, name: &str, values: &[nalgebra::Matrix3<f64>]) -> Self {
        assert_eq!(values.len(), self.n_cells(), "one value of {name} per cell");
        let rows = values.iter().flat_map(|m| m.transpose().data.0.concat());
        self.cell_data
            .push(Array::new(name, 9, Values::Float(rows.collect())));
        self
    }

    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.points.len() / 3
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.connectivity.len() / self.nodes_per_cell
    }

    /// Writes the grid as the text of a `.vtu` file.
    ///
    /// # Errors
    /// When `w` fails.
    pub fn write(&self, w: &mut dyn Write) -> io::Result<()> {
        writeln!(w, r#"<?xml version="1.0"?>"#)?;
        if !self.comment.is_empty() {
            // "--" would end an XML comment early.
            writeln!(w, "<!-- {} -->", self.comment.replace("--", "- "))?;
        }
        writeln!(
            w,
            r#"<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">"#
        )?;
        writeln!(w, "<UnstructuredGrid>")?;
        writeln!(
            w,
            r#"<Piece NumberOfPoints="{}" NumberOfCells="{}">"#,
            self.n_points(),
            self.n_cells()
        )?;
        writeln!(w, "<Points>")?;
        write_floats(w, "Points", 3, &self.points)?;
        writeln!(w, "</Points>\n<Cells>")?;
        let offsets =
            (0..self.n_cells()).map(|cell| i64::from(((cell + 1) * self.nodes_per_cell) as u32));
        let connectivity = self.connectivity.iter().map(|&node| i64::from(node));
        write_array(
            w,
            "Int64",
            "connectivity",
            1,
            connectivity.map(i64::to_le_bytes),
        )?;
        write_array(w, "Int64", "offsets", 1, offsets.map(i64::to_le_bytes))?;
        let types = std::iter::repeat_n([self.cell_type], self.n_cells());
        write_array(w, "UInt8", "types", 1, types)?;
        writeln!(w, "</Cells>\n<PointData>")?;
        for array in &self.point_data {
            array.write(w)?;
        }
        writeln!(w, "</PointData>\n<CellData>")?;
        for array in &self.cell_data {
            array.write(w)?;
        }
        writeln!(w, "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
    }
}

impl Array {
    fn new(name: &str, n_components: usize, values: Values) -> Self {
        Self {
            name: escaped(name),
            n_components,
            values,
        }
    }

    fn write(&self, w: &mut dyn Write) -> io::Result<()> {
        match &self.values {
            Values::Float(values) => write_floats(w, &self.name, self.n_components, values),
            Values::Index(values) => {
                let bytes = values.iter().map(|v| v.to_le_bytes());
                write_array(w, "UInt32", &self.name, self.n_components, bytes)
            }
        }
    }
}

/// Writes the `.pvd` file that joins grids into a time series:
/// `(time in seconds, file name in the same folder)`.
///
/// # Errors
/// When `w` fails.
pub fn write_series(w: &mut dyn Write, frames: &[(f64, String)]) -> io::Result<()> {
    writeln!(w, r#"<?xml version="1.0"?>"#)?;
    writeln!(
        w,
        r#"<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">"#
    )?;
    writeln!(w, "<Collection>")?;
    for (time, file) in frames {
        let file = escaped(file);
        writeln!(w, r#"<DataSet timestep="{time}" part="0" file="{file}"/>"#)?;
    }
    writeln!(w, "</Collection>\n</VTKFile>")
}

fn write_floats(
    w: &mut dyn Write,
    name: &str,
    n_components: usize,
    values: &[f64],
) -> io::Result<()> {
    let bytes = values.iter().map(|v| v.to_le_bytes());
    write_array(w, "Float64", name, n_components, bytes)
}

/// Writes one array as one base64 stream: its length in bytes as `UInt64`, then its values.
fn write_array<const N: usize>(
    w: &mut dyn Write,
    vtk_type: &str,
    name: &str,
    n_components: usize,
    values: impl ExactSizeIterator<Item = [u8; N]>,
) -> io::Result<()> {
    writeln!(
        w,
        r#"<DataArray type="{vtk_type}" Name="{name}" NumberOfComponents="{n_components}" format="binary">"#
    )?;
    let mut encoder = EncoderWriter::new(&mut *w, &STANDARD);
    encoder.write_all(&((values.len() * N) as u64).to_le_bytes())?;
    for value in values {
        encoder.write_all(&value)?;
    }
    encoder.finish()?;
    drop(encoder);
    writeln!(w, "\n</DataArray>")
}

fn flat(vectors: &[Vec3]) -> Vec<f64> {
    vectors.iter().flat_map(|v| [v.x, v.y, v.z]).collect()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
