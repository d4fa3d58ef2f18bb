//! The surface that the readers fill: points and triangles. Polygons are cut into triangles as they
//! are added.

use super::polygon::triangulate;
use super::{Fault, FileCounts, Parsed, Place, ReadNote};
use crate::{Surface, Vec3};

/// Largest number of corners of a face. Cutting a polygon takes up to the square of its corners.
/// Real faces have a few; the caps of a cylinder have some hundred.
const MAX_CORNERS: usize = 4096;

/// Limit on the cost of cutting all polygons of a file, in squares of corners: `CUTTING_PER_BYTE`
/// for each byte, plus `CUTTING_AT_LEAST`. Without it, a file of many polygons with thousands of
/// corners would take minutes for each of its megabytes.
const CUTTING_PER_BYTE: usize = 64;
const CUTTING_AT_LEAST: usize = 100_000_000;

/// A surface under construction.
#[derive(Debug)]
pub(super) struct Builder {
    pub(super) points: Vec<Vec3>,
    pub(super) n_objects: usize,
    triangles: Vec<[u32; 3]>,
    n_faces: usize,
    n_polygons: usize,
    n_short_faces: usize,
    first_short_face: Option<Place>,
    n_folded: usize,
    first_folded: Option<Place>,
    notes: Vec<ReadNote>,
    cutting_left: usize,
}

impl Builder {
    /// An empty builder for a file of `n_bytes` bytes.
    pub(super) fn new(n_bytes: usize) -> Self {
        Self {
            points: vec![],
            n_objects: 0,
            triangles: vec![],
            n_faces: 0,
            n_polygons: 0,
            n_short_faces: 0,
            first_short_face: None,
            n_folded: 0,
            first_folded: None,
            notes: vec![],
            cutting_left: CUTTING_AT_LEAST.saturating_add(n_bytes.saturating_mul(CUTTING_PER_BYTE)),
        }
    }

    pub(super) fn note(&mut self, note: ReadNote) {
        self.notes.push(note);
    }

    pub(super) fn reserve_faces(&mut self, n: usize) {
        self.triangles.reserve(n);
    }

    /// Adds a face; all its vertices must exist. A face with fewer than three corners is left out
    /// and counted.
    pub(super) fn face(&mut self, corners: &[u32], place: Place) -> Parsed<()> {
        self.n_faces += 1;
        match corners {
            [] | [_] | [_, _] => {
                self.n_short_faces += 1;
                self.first_short_face.get_or_insert(place);
            }
            &[a, b, c] => self.triangles.push([a, b, c]),
            _ if corners.len() > MAX_CORNERS => {
                let problem = format!(
                    "a face with {} corners, more than the {MAX_CORNERS} that are read; \
                     cut it into triangles in a mesh program",
                    corners.len()
                );
                return Err(Fault::new(place, problem));
            }
            _ => {
                self.n_polygons += 1;
                if corners.len() > 4 {
                    let left = self.cutting_left.checked_sub(corners.len().pow(2));
                    let problem = "its polygons have too many corners; cut them into triangles in a mesh program";
                    self.cutting_left = left.ok_or_else(|| Fault::new(place, problem))?;
                }
                if !triangulate(&self.points, corners, &mut self.triangles) {
                    self.n_folded += 1;
                    self.first_folded.get_or_insert(place);
                }
            }
        }
        Ok(())
    }

    /// Checks that a vertex number from the file exists, and returns it as an index.
    pub(super) fn vertex(&self, index: i64, place: Place) -> Parsed<u32> {
        match usize::try_from(index) {
            Ok(i) if i < self.points.len() => Ok(i as u32),
            _ => {
                let n = self.points.len();
                let problem = match n {
                    0 => format!("a face uses vertex {index}, but there are no vertices"),
                    _ => format!(
                        "a face uses vertex {index}, but the vertices are 0 to {}",
                        n - 1
                    ),
                };
                Err(Fault::new(place, problem))
            }
        }
    }

    /// Returns an error for a surface without faces, such as a cloud of points.
    pub(super) fn check_faces(&self) -> Parsed<()> {
        if !self.triangles.is_empty() {
            return Ok(());
        }
        let problem = match (self.points.len(), self.n_short_faces) {
            (0, _) => "no vertices and no faces; export the mesh itself".to_owned(),
            (_, 0) => format!(
                "{} vertices but no faces; reconstruct a surface from the points first",
                self.points.len()
            ),
            (_, n) => format!("no faces but {n} with fewer than three corners"),
        };
        Err(Fault::new(Place::File, problem))
    }

    pub(super) fn finish(mut self) -> (Surface, FileCounts, Vec<ReadNote>) {
        if let Some(first) = self.first_short_face {
            let count = self.n_short_faces;
            self.notes.push(ReadNote::ShortFaces { count, first });
        }
        if let Some(first) = self.first_folded {
            let count = self.n_folded;
            self.notes.push(ReadNote::FoldedPolygons { count, first });
        }
        let counts = FileCounts {
            n_points: self.points.len(),
            n_faces: self.n_faces,
            n_polygons: self.n_polygons,
            n_objects: self.n_objects.max(1),
        };
        let surface = Surface {
            points: self.points,
            triangles: self.triangles,
        };
        (surface, counts, self.notes)
    }
}
