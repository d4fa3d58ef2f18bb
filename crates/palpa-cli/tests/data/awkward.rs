//! `palpa check` on files that are awkward on purpose: the verdict that each must get, with bounded
//! work and memory.

use std::fs;
use std::process::{Command, Stdio};

/// Most processor time for one file, s: work, whatever else the machine does. The slowest takes a
/// tenth of it. A file that needs more ends by a signal instead of an exit code.
const CPU_SECONDS: u32 = 5;
/// Most address space for one file, KiB. It is larger than the resident memory, so it bounds the
/// peak from above.
const MEMORY_KIB: u32 = 500_000;

/// File, exit code, and words of the JSON report or, with code 2, of the error.
///
/// The exit codes were decided from the README beside the data before the first run; the words were
/// taken from the first output. Rows that came out otherwise, because the file turned out to be
/// sounder or worse when read properly, say so.
const EXPECTED: [(&str, i32, &[&str]); 31] = [
    // Positions are ±inf: nothing can be known about the shape.
    ("assimp_BoxWithInfinites.glb", 1, &["not-finite"]),
    // 18 shells that stick in each other; 56 triangles without area, after which no crowded edges
    // are left.
    (
        "assimp_Spider_ascii.stl",
        1,
        &[
            "self-intersection",
            "degenerate",
            "winding",
            "several-parts",
        ],
    ),
    // UTF-16 text: decoded.
    ("assimp_box_UTF16BE.obj", 0, &["UTF-16"]),
    // One concave polygon round a hole, joined by a seam: cut by ears it is a flat ring, open on
    // both rims.
    ("assimp_concave_polygon.obj", 0, &["open-boundary"]),
    ("assimp_cube_binary.ply", 0, &[]),
    // A face names vertex 12 of 8.
    (
        "assimp_malformed.obj",
        2,
        &["line 23", "vertex 12", "1 to 8"],
    ),
    // `3.1+e2` is no number, but no face uses it; the one face that there is has no area.
    (
        "assimp_number_formats.obj",
        1,
        &["degenerate", "not numbers"],
    ),
    // A hole is not filled by guessing.
    ("assimp_sphereWithHole.stl", 1, &["hole"]),
    // Two loose triangles in two solids are read both, and are no surface.
    (
        "assimp_triangle_with_two_solids.stl",
        1,
        &["unjoined", "\"n_objects\": 2"],
    ),
    // Sound, but 269 units long.
    ("derived_forearm_ascii_mm.stl", 0, &["--unit mm"]),
    // All its defects can be repaired.
    (
        "derived_forearm_degenerate_dupfaces.obj",
        1,
        &["\"verdict\": \"repairable\"", "duplicate", "degenerate"],
    ),
    // Read in double precision nothing is lost.
    ("derived_forearm_huge_offset.obj", 0, &["far-from-origin"]),
    (
        "derived_forearm_inverted_binary.stl",
        1,
        &["\"verdict\": \"repairable\"", "inverted"],
    ),
    (
        "derived_forearm_mixed_winding_ascii.ply",
        1,
        &["\"verdict\": \"repairable\"", "winding"],
    ),
    (
        "derived_forearm_nonfinite_ascii.ply",
        1,
        &["\"verdict\": \"bad\"", "not-finite"],
    ),
    (
        "derived_forearm_nonmanifold_fins.obj",
        1,
        &["\"verdict\": \"bad\"", "\"n_nonmanifold_edges\": 40"],
    ),
    (
        "derived_forearm_self_intersecting.obj",
        1,
        &["\"verdict\": \"bad\"", "179 triangles in all"],
    ),
    ("trimesh_BoxInterleaved.glb", 0, &["\"n_vertices\": 8"]),
    // Two tetrahedra joined at a face that both have, and so at three crowded edges.
    (
        "trimesh_joined_tetrahedra.obj",
        1,
        &["\"verdict\": \"bad\"", "\"n_nonmanifold_edges\": 3"],
    ),
    (
        "trimesh_multibody.stl",
        1,
        &["\"verdict\": \"repairable\"", "several-parts"],
    ),
    // NaN stands in colours only.
    ("trimesh_nancolor.obj", 0, &[]),
    ("trimesh_negative_indices.obj", 0, &["\"n_triangles\": 12"]),
    // Three boxes, apart from each other once the transforms are applied.
    ("trimesh_nested.glb", 0, &["\"n_parts\": 3"]),
    // 26 crowded edges, of which 4 are crowded by doubles only.
    (
        "trimesh_no_indices_3storybuilding.glb",
        1,
        &["\"n_nonmanifold_edges\": 22", "duplicate"],
    ),
    (
        "trimesh_not_convex.obj",
        1,
        &["\"n_nonmanifold_edges\": 12"],
    ),
    // The short face is left out; the other is a loose triangle.
    (
        "trimesh_notenoughindices.obj",
        1,
        &["fewer than three corners", "line 9"],
    ),
    (
        "trimesh_points_emptyface.ply",
        2,
        &["1024 vertices but no faces"],
    ),
    // A bent pentagon that doubles back on itself: no clean cut, which is noted; its triangles are
    // an open sheet.
    ("trimesh_polygonfaces.obj", 0, &["fold over themselves"]),
    ("trimesh_soup.stl", 1, &["unjoined", "self-intersection"]),
    // Guessed to be open only; its eyes also stick through the head.
    ("trimesh_suzanne.ply", 1, &["hole", "self-intersection"]),
    // Guessed to be bad: its 11 triangles without area are those of cutting polygons with collinear
    // corners into a fan. Cut by ears, with every corner kept, it is closed and sound.
    ("trimesh_wallhole.obj", 0, &["\"n_boundary_edges\": 0"]),
];

#[test]
fn every_awkward_file_gets_its_verdict() {
    let folder = crate::data().join("awkward");
    let mut failures = Vec::new();
    for (name, code, words) in EXPECTED {
        // The limits are those of the shell, which needs neither unsafe code nor another crate.
        let output = Command::new("sh")
            .args([
                "-c",
                "ulimit -v \"$1\" && ulimit -t \"$2\" && exec \"$3\" check --json \"$4\"",
                "sh",
            ])
            .arg(MEMORY_KIB.to_string())
            .arg(CPU_SECONDS.to_string())
            .arg(env!("CARGO_BIN_EXE_palpa"))
            .arg(folder.join(name))
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let seen = String::from_utf8(if code == 2 {
            output.stderr
        } else {
            output.stdout
        })
        .unwrap();
        if output.status.code() != Some(code) {
            failures.push(format!(
                "{name}: {} instead of exit code {code}",
                output.status
            ));
        }
        failures.extend(
            words
                .iter()
                .filter(|w| !seen.contains(**w))
                .map(|w| format!("{name}: {w:?} is not in the report")),
        );
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn no_awkward_file_is_forgotten() {
    let folder = crate::data().join("awkward");
    let mut n_files = 0;
    for entry in fs::read_dir(folder).unwrap() {
        n_files += 1;
        let name = entry.unwrap().file_name().into_string().unwrap();
        let is_listed = EXPECTED.iter().any(|(expected, ..)| *expected == name);
        assert!(
            is_listed || name == "README.md",
            "{name} has no expected verdict"
        );
    }
    assert!(n_files >= EXPECTED.len(), "{n_files} files");
}
