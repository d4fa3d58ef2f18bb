//! Counts, volumes and bounds of the sound meshes, against the values of another library (trimesh).

use std::fs;

use palpa_mesh::{Verdict, check_surface, read_surface};

/// Volumes are written with four digits, and bounds with five.
const VOLUME_TOLERANCE: f64 = 1e-3;
const BOUNDS_TOLERANCE: f64 = 1e-5;

#[test]
fn counts_and_sizes_agree_with_trimesh() {
    let folder = crate::data();
    let manifest = fs::read_to_string(folder.join("MANIFEST.csv")).unwrap();
    let mut rows = csv::Reader::from_reader(manifest.as_bytes());
    let mut n_compared = 0;
    for row in rows.records().map(Result::unwrap) {
        let path = row[0].strip_prefix("shared/data/").unwrap();
        let extension = path.rsplit('.').next().unwrap();
        if path.starts_with("awkward/") || !["obj", "stl", "ply"].contains(&extension) {
            continue;
        }
        let file = read_surface(&folder.join(path)).unwrap();
        let report = check_surface(&file.surface);
        assert_eq!(
            report.verdict,
            Verdict::Good,
            "{path}: {:?}",
            report.findings
        );
        let counts = [
            report.n_vertices,
            report.n_triangles,
            report.n_boundary_edges,
            report.n_nonmanifold_edges,
        ];
        let expected = [3, 4, 5, 6].map(|k| row[k].parse::<usize>().unwrap());
        assert_eq!(
            counts, expected,
            "{path}: vertices, triangles, boundary and crowded edges"
        );
        assert_eq!(report.n_parts.to_string(), row[9], "{path}: parts");

        // Where the surface is open, trimesh's volume depends on the origin; ours caps the
        // openings.
        let part = &report.parts[0];
        let expected: f64 = row[12].parse().unwrap();
        // A quadrilateral that is not flat has another volume with the other diagonal.
        let has_polygons = file.counts.n_polygons > 0;
        if part.is_closed && !has_polygons {
            assert!(
                (part.volume - expected).abs() <= VOLUME_TOLERANCE * expected,
                "{path}: volume {}",
                part.volume
            );
        }
        for (bound, column) in [(report.lower, 13), (report.upper, 14)] {
            for (x, expected) in bound.iter().zip(row[column].split_whitespace()) {
                let expected: f64 = expected.parse().unwrap();
                assert!(
                    (x - expected).abs() <= BOUNDS_TOLERANCE,
                    "{path}: bound {x} instead of {expected}"
                );
            }
        }
        n_compared += 1;
    }
    assert!(n_compared > 20, "only {n_compared} meshes found");
}
