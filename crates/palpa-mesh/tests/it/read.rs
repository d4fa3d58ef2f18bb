//! Readers: what each format may say, and what lies and slips must come to.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use base64::Engine;
use palpa_mesh::read::{Place, ReadNote};
use palpa_mesh::{Format, ReadError, Surface, SurfaceFile, Vec3, read_surface, read_surface_bytes};
use proptest::prelude::*;

fn read(format: Format, content: impl AsRef<[u8]>) -> SurfaceFile {
    read_surface_bytes(content.as_ref(), format).unwrap_or_else(|e| panic!("{e}"))
}

fn refuse(format: Format, content: impl AsRef<[u8]>) -> String {
    match read_surface_bytes(content.as_ref(), format) {
        Ok(file) => panic!("read as {file:?}"),
        Err(e) => e.to_string(),
    }
}

fn volume(surface: &Surface) -> f64 {
    let sixth = |t| {
        let [a, b, c]: [Vec3; 3] = surface.corners(t);
        a.cross(&b).dot(&c) / 6.0
    };
    (0..surface.triangles.len()).map(sixth).sum()
}

const CUBE_OBJ: &str = "o cube\n\
    v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn obj_corners_in_all_their_forms() {
    let forms = CUBE_OBJ
        .replace("f 4 3 2 1", "f 4/1 3/2 2/3 1/4")
        .replace("f 5 6 7 8", "f 5//1 6//1 7//1 8//1")
        .replace("f 1 2 6 5", "f 1/1/1 2/2/2 6/3/3 5/4/4")
        .replace("f 2 3 7 6", "f -7 -6 -2 -3")
        .replace("f 3 4 8 7", "f 3// 4// \\\n 8// 7//");
    for text in [
        CUBE_OBJ.to_owned(),
        forms,
        CUBE_OBJ.replace('\n', "\r\n"),
        CUBE_OBJ.replace('\n', "\r"),
    ] {
        let file = read(Format::Obj, &text);
        assert_eq!(file.surface.triangles.len(), 12);
        assert!((volume(&file.surface) - 1.0).abs() < 1e-15, "{text}");
        assert_eq!((file.counts.n_polygons, file.counts.n_objects), (6, 1));
        assert_eq!(file.notes, []);
    }
}

#[test]
fn obj_in_utf_16_and_with_faces_first() {
    let be: Vec<u8> = [0xFE, 0xFF]
        .into_iter()
        .chain(CUBE_OBJ.encode_utf16().flat_map(u16::to_be_bytes))
        .collect();
    let le: Vec<u8> = [0xFF, 0xFE]
        .into_iter()
        .chain(CUBE_OBJ.encode_utf16().flat_map(u16::to_le_bytes))
        .collect();
    for bytes in [be, le] {
        let file = read(Format::Obj, bytes);
        assert_eq!(
            (file.surface.triangles.len(), &file.notes[..]),
            (12, &[ReadNote::Utf16][..])
        );
    }
    assert_eq!(
        read(Format::Obj, "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0")
            .surface
            .triangles,
        [[0, 1, 2]]
    );
}

#[test]
fn obj_keeps_every_digit() {
    let file = read(
        Format::Obj,
        "v 4500000.0310 -1200000.0131 2.9999996970000001e5 1.0\nv 0 0 0\nv 1 0 0\nf 1 2 3",
    );
    assert_eq!(
        file.surface.points[0],
        Vec3::new(4500000.031, -1200000.0131, 299999.9697)
    );
}

#[test]
fn obj_parts_that_can_be_passed_over_are_noted() {
    let file = read(
        Format::Obj,
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 3.1+e2 0 0\nf 1 2 3\nf 1 2\nl 1 2\n",
    );
    let notes = [
        ReadNote::UnreadVertices {
            count: 1,
            first: Place::Line(4),
        },
        ReadNote::NotFaces { count: 1 },
        ReadNote::ShortFaces {
            count: 1,
            first: Place::Line(6),
        },
    ];
    assert_eq!(file.notes, notes);
    // A polygon that doubles back on itself.
    let folded = read(
        Format::Obj,
        "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 2 4 0\nf 1 2 3 4 5\n",
    );
    assert_eq!(
        folded.notes,
        [ReadNote::FoldedPolygons {
            count: 1,
            first: Place::Line(6)
        }]
    );
}

#[test]
fn obj_refusals() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let refuse = |rest: &str| refuse(Format::Obj, format!("{vertices}{rest}"));
    insta::assert_snapshot!(refuse("f 1 2 4"), @"OBJ, line 4: a face uses vertex 4, but the vertices are 1 to 3");
    insta::assert_snapshot!(refuse("f 1 2 0"), @"OBJ, line 4: a face uses vertex 0, but OBJ counts from 1");
    insta::assert_snapshot!(refuse("f 1 2 -4"), @"OBJ, line 4: a face uses vertex -4, but only 3 come before it");
    insta::assert_snapshot!(refuse("f 1 2 x/1"), @r#"OBJ, line 4: "x/1" is not a face corner"#);
    insta::assert_snapshot!(refuse("f 1 2 99999999999999999999"), @r#"OBJ, line 4: "99999999999999999999" is not a face corner"#);
    insta::assert_snapshot!(refuse("v 1 2"), @"OBJ, line 4: a vertex with 2 coordinates instead of 3");
    insta::assert_snapshot!(refuse("v 1 1,5 2\nf 1 2 4"), @r#"OBJ, line 4: "1,5" is not a number, and the face in line 5 uses this vertex"#);
    insta::assert_snapshot!(refuse(""), @"OBJ, the file: 3 vertices but no faces; reconstruct a surface from the points first");
    insta::assert_snapshot!(refuse(&format!("f{}", " 1 2 3".repeat(2000))), @"OBJ, line 4: a face with 6000 corners, more than the 4096 that are read; cut it into triangles in a mesh program");
}

#[test]
fn polygons_of_very_many_corners_do_not_take_minutes() {
    // A star whose spikes all cross is the worst for cutting: no corner is ever an ear.
    let n = 4000;
    let mut text = String::new();
    for i in 0..n {
        let (y, x) = (f64::from(i) * 2.5).sin_cos();
        writeln!(text, "v {x} {y} 0").unwrap();
    }
    let corners: Vec<String> = (1..=n).map(|i: i32| i.to_string()).collect();
    for _ in 0..40 {
        writeln!(text, "f {}", corners.join(" ")).unwrap();
    }
    let message = refuse(Format::Obj, text);
    assert!(
        message.contains("its polygons have too many corners"),
        "{message}"
    );
}

fn binary_stl(n_announced: u32, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend(n_announced.to_le_bytes());
    for t in triangles {
        bytes.extend([0; 12]);
        bytes.extend(t.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn stl_binary_and_ascii() {
    let mut named_solid = binary_stl(1, &[TRIANGLE]);
    named_solid[..14].copy_from_slice(b"solid facet xy");
    assert_eq!(
        read(Format::Stl, &named_solid).surface.triangles,
        [[0, 1, 2]]
    );

    let mut longer = named_solid.clone();
    longer[0] = b'x';
    longer.extend([0; 7]);
    assert_eq!(
        read(Format::Stl, &longer).notes,
        [ReadNote::TrailingBytes { bytes: 7 }]
    );

    let facet = |z: i32| {
        format!(
            "facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 1.0E0 0 {z}\nVERTEX 0 1 {z}\nendloop\nendfacet\n"
        )
    };
    let two = format!(
        "solid a b c\n{}endsolid a\nsolid\n{}endsolid\n",
        facet(0),
        facet(1)
    );
    let file = read(Format::Stl, two);
    assert_eq!(
        (file.surface.triangles.len(), file.counts.n_objects),
        (2, 2)
    );
}

#[test]
fn stl_refusals() {
    let lying = binary_stl(1_000_000_000, &[TRIANGLE, TRIANGLE]);
    insta::assert_snapshot!(refuse(Format::Stl, lying), @r#"STL, byte 80: neither ASCII (it does not start with "solid") nor binary (for the 1000000000 triangles that it announces it would have 50000000084 bytes, and has 184); if it was cut off, copy it again"#);
    insta::assert_snapshot!(refuse(Format::Stl, "oops"), @"STL, the file: 4 bytes are too few for an STL file");
    let ascii = |body: &str| {
        refuse(
            Format::Stl,
            format!("solid\nfacet normal 0 0 1\nouter loop\n{body}"),
        )
    };
    insta::assert_snapshot!(ascii("vertex 0 0\n"), @"STL, line 4: a vertex with fewer than three coordinates");
    insta::assert_snapshot!(ascii("vertex 0 0 z\n"), @r#"STL, line 4: "z" is not a number"#);
    insta::assert_snapshot!(ascii("vertex 0 0 0\n"), @"STL, line 3: the loop that starts here has no end; the file is cut off");
    insta::assert_snapshot!(ascii("outer loop\n"), @"STL, line 4: a loop starts before the one of line 3 has ended");
    insta::assert_snapshot!(refuse(Format::Stl, "solid\nvertex 0 0 0\n"), @r#"STL, line 2: a vertex outside of "outer loop""#);
    insta::assert_snapshot!(refuse(Format::Stl, "solid\nfoo\n"), @r#"STL, line 2: "foo" is no word of an STL file"#);
    insta::assert_snapshot!(refuse(Format::Stl, binary_stl(0, &[])), @"STL, the file: no vertices and no faces; export the mesh itself");
}

/// A header with the properties that programs add, in another order than usual.
fn ply_header(format: &str, n_vertices: usize, n_faces: usize) -> String {
    format!(
        "ply\r\nformat {format} 1.0\ncomment by hand\nelement camera 1\nproperty uchar id\n\
         element vertex {n_vertices}\nproperty uchar red\nproperty double z\nproperty list uchar short tags\n\
         property float x\nproperty float y\n\
         element face {n_faces}\nproperty int flags\nproperty list ushort int vertex_index\nend_header\n"
    )
}

fn binary_ply(is_big_endian: bool) -> Vec<u8> {
    fn put<const N: usize>(out: &mut Vec<u8>, is_big_endian: bool, mut raw: [u8; N]) {
        if is_big_endian {
            raw.reverse();
        }
        out.extend(raw);
    }
    let format = if is_big_endian {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    };
    let mut out = ply_header(format, 4, 1).into_bytes();
    out.push(9);
    for (x, y, z) in [
        (0.0, 0.0, 0.1),
        (1.0, 0.0, 0.1),
        (1.0, 1.0, 0.1),
        (0.0, 1.0, 0.1),
    ] {
        out.push(255);
        put(&mut out, is_big_endian, f64::to_le_bytes(z));
        out.push(2);
        put(&mut out, is_big_endian, i16::to_le_bytes(-7));
        put(&mut out, is_big_endian, i16::to_le_bytes(300));
        put(&mut out, is_big_endian, f32::to_le_bytes(x));
        put(&mut out, is_big_endian, f32::to_le_bytes(y));
    }
    put(&mut out, is_big_endian, i32::to_le_bytes(-1));
    put(&mut out, is_big_endian, u16::to_le_bytes(4));
    for v in 0..4 {
        put(&mut out, is_big_endian, i32::to_le_bytes(v));
    }
    out
}

#[test]
fn ply_in_its_three_encodings() {
    let ascii = ply_header("ascii", 4, 1)
        + "9\n255 0.1 2 -7 300 0 0\n255 0.1 0 1 0\n255 1e-1 1 5 1 1\n255 0.1 0 0 1\n-1 4 0 1 2 3\n";
    let expected = read(Format::Ply, ascii);
    assert_eq!(expected.surface.points[2], Vec3::new(1.0, 1.0, 0.1));
    assert_eq!(expected.surface.triangles, [[0, 1, 2], [0, 2, 3]]);
    for is_big_endian in [false, true] {
        assert_eq!(read(Format::Ply, binary_ply(is_big_endian)), expected);
    }
}

#[test]
fn ply_refusals() {
    let simple = |n_vertices: u64, n_faces: u64, format: &str, body: &str| {
        let header = format!(
            "ply\nformat {format} 1.0\nelement vertex {n_vertices}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {n_faces}\nproperty list uchar int vertex_indices\nend_header\n"
        );
        refuse(Format::Ply, header + body)
    };
    let points = "0 0 0 1 0 0 0 1 0\n";
    let little = "binary_little_endian";
    insta::assert_snapshot!(simple(1_000_000_000, 1, little, "abc"), @r#"PLY, line 3: 1000000000 elements "vertex" are announced, which take at least 12000000000 bytes, but 3 are left; if the file was cut off, copy it again"#);
    insta::assert_snapshot!(simple(u64::MAX, 1, "ascii", points), @r#"PLY, line 3: 18446744073709551615 elements "vertex" are announced, which take at least 18446744073709551615 bytes, but 18 are left; if the file was cut off, copy it again"#);
    insta::assert_snapshot!(simple(3, 1_000_000_000, "ascii", points), @r#"PLY, line 7: 1000000000 elements "face" are announced, which take at least 2000000000 bytes, but 18 are left; if the file was cut off, copy it again"#);
    insta::assert_snapshot!(simple(3, 1, "ascii", points), @"PLY, record 0: ends in face 0 of 1; the file is cut off");
    insta::assert_snapshot!(simple(3, 1, "ascii", &format!("{points}3 0 1 3")), @"PLY, record 0: a face uses vertex 3, but the vertices are 0 to 2");
    insta::assert_snapshot!(simple(3, 1, "ascii", &format!("{points}3 0 1 -1")), @"PLY, record 0: a face uses vertex -1, but the vertices are 0 to 2");
    insta::assert_snapshot!(simple(3, 1, "ascii", &format!("{points}3 0 1 1.5")), @"PLY, record 0: vertex 1.5 is no whole number");
    insta::assert_snapshot!(simple(3, 1, "ascii", &format!("{points}1e9 0 1 2")), @"PLY, record 0: face 0 has a list of 1000000000 values");
    insta::assert_snapshot!(simple(3, 1, "ascii", &format!("{points}nan 0 1 2")), @"PLY, record 0: face 0 has a list of NaN values");
    insta::assert_snapshot!(simple(3, 0, "ascii", points), @"PLY, the file: 3 vertices but no faces; reconstruct a surface from the points first");
    insta::assert_snapshot!(simple(3, 1, "ascii", "0 0 zero 1 0 0 0 1 0 3 0 1 2"), @r#"PLY, record 0: vertex 0, property "z": "zero" is not a number"#);
    insta::assert_snapshot!(simple(3, 1, "binary_middle_endian", ""), @r#"PLY, line 2: unknown format "binary_middle_endian""#);
    insta::assert_snapshot!(refuse(Format::Ply, "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"), @"PLY, the file: the header has no end_header; the file is cut off");
    insta::assert_snapshot!(refuse(Format::Ply, "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0"), @"PLY, line 3: the vertices have no coordinate y");
    insta::assert_snapshot!(refuse(Format::Ply, "ply\nend_header\n"), @"PLY, line 2: the header names no format");
}

#[test]
fn off_with_comments_colours_and_polygons() {
    let square =
        "OFF # a square\n\n4 1 0\n0 0 0\n1 0 0 # second\n1 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n";
    assert_eq!(
        read(Format::Off, square).surface.triangles,
        [[0, 1, 2], [0, 2, 3]]
    );
    let in_one_line = square.replace("# a square\n\n", "");
    assert_eq!(read(Format::Off, in_one_line), read(Format::Off, square));
    insta::assert_snapshot!(refuse(Format::Off, "OFF\n1000000000 1 0\n"), @"OFF, line 2: 1000000000 vertices are announced, more than 19 bytes can hold");
    insta::assert_snapshot!(refuse(Format::Off, square.replace("4 1 0", "4 2 0")), @"OFF, the file: ends after 1 of 2 faces; the file is cut off");
    insta::assert_snapshot!(refuse(Format::Off, square.replace("4 0 1 2 3", "9000000000 0 1 2 3")), @"OFF, line 8: a face uses vertex 255, but the vertices are 0 to 3");
    insta::assert_snapshot!(refuse(Format::Off, "4OFF\n"), @r#"OFF, line 1: "4OFF" is not read; save it as plain ASCII OFF"#);
}

/// Two triangles of a unit square, as a glTF document around `buffers`, with a node that
/// `transform` moves.
fn gltf_square(transform: &str, buffer_uri: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
        "nodes": [{{"children": [1], "translation": [10, 0, 0]}}, {{"mesh": 0 {transform}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
        "accessors": [
            {{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}}],
        "bufferViews": [
            {{"buffer": 0, "byteLength": 64, "byteStride": 16}},
            {{"buffer": 0, "byteOffset": 64, "byteLength": 12}}],
        "buffers": [{{"byteLength": 76 {buffer_uri}}}]}}"#
    )
}

/// The bytes of that square: positions with four bytes between them, then indices.
fn gltf_buffer() -> Vec<u8> {
    let positions = [
        [0.0_f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let mut bytes = Vec::new();
    for p in positions {
        bytes.extend(p.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0xAB; 4]);
    }
    bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, chunk) in [(b"JSON", json.as_bytes()), (b"BIN\0", binary)] {
        let padding = chunk.len().next_multiple_of(4) - chunk.len();
        bytes.extend(((chunk.len() + padding) as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
        bytes.extend(std::iter::repeat_n(b' ', padding));
    }
    bytes
}

#[test]
fn glb_with_strides_and_nested_nodes() {
    let turned =
        r#", "rotation": [0, 0, 0.7071067811865476, 0.7071067811865476], "scale": [2, 3, 1]"#;
    let file = read(Format::Gltf, glb(&gltf_square(turned, ""), &gltf_buffer()));
    // Scaled, turned by 90° about z, then moved: (1, 0, 0) → (2, 0, 0) → (0, 2, 0) → (10, 2, 0).
    assert!((file.surface.points[1] - Vec3::new(10.0, 2.0, 0.0)).norm() < 1e-12);
    assert_eq!(file.surface.triangles, [[0, 1, 2], [0, 2, 3]]);
    let mirrored = read(
        Format::Gltf,
        glb(&gltf_square(r#", "scale": [-1, 1, 1]"#, ""), &gltf_buffer()),
    );
    assert!(
        (0..2).all(|t| mirrored.surface.area_vector(t).z > 0.0),
        "a mirrored instance keeps its outside"
    );
}

#[test]
fn gltf_with_its_buffer_beside_it_or_inside() {
    let folder = tempfile::tempdir().unwrap();
    let skin = folder.path().join("skin.gltf");
    fs::write(folder.path().join("my skin.bin"), gltf_buffer()).unwrap();
    fs::write(&skin, gltf_square("", r#", "uri": "my%20skin.bin""#)).unwrap();
    let beside = read_surface(&skin).unwrap();

    let data = base64::engine::general_purpose::STANDARD.encode(gltf_buffer());
    let uri = format!(r#", "uri": "data:application/octet-stream;base64,{data}""#);
    assert_eq!(read(Format::Gltf, gltf_square("", &uri)), beside);
}

#[test]
fn gltf_refusals() {
    let with = |from: &str, to: &str| {
        let json = gltf_square("", "");
        assert!(json.contains(from), "{from}");
        refuse(Format::Gltf, glb(&json.replace(from, to), &gltf_buffer()))
    };
    insta::assert_snapshot!(with(r#""count": 4"#, r#""count": 1000000000"#), @"glTF, the file: mesh 0, primitive 0: its parts have far more vertices together than a file of this size holds; apply the instances and export again");
    insta::assert_snapshot!(with(r#""count": 4"#, r#""count": 5"#), @"glTF, the file: mesh 0, primitive 0: 5 elements are announced, more than the 64 bytes of their view hold");
    insta::assert_snapshot!(with(r#""byteLength": 12"#, r#""byteLength": 13"#), @"glTF, the file: mesh 0, primitive 0: buffer view 1 reaches beyond its buffer");
    insta::assert_snapshot!(with(r#""children": [1]"#, r#""children": [1, 0]"#), @"glTF, the file: node 0 is reached twice; nodes must form a tree");
    insta::assert_snapshot!(with(r#""buffer": 0, "byteLength": 64"#, r#""buffer": 7, "byteLength": 64"#), @"glTF, the file: mesh 0, primitive 0: buffer view 0 reaches beyond its buffer");
    insta::assert_snapshot!(with(r#""byteStride": 16"#, r#""byteStride": 4"#), @"glTF, the file: mesh 0, primitive 0: a stride of 4 bytes is less than an element of 12");
    insta::assert_snapshot!(with(r#""byteLength": 76"#, r#""byteLength": 77"#), @"glTF, the file: buffer 0: 77 bytes are announced, but it has 76");
    insta::assert_snapshot!(with(r#""byteLength": 76"#, r#""byteLength": 76, "uri": "../../etc/passwd""#), @r#"glTF, the file: buffer 0: "../../etc/passwd" is not the name of a file beside this one; put it there, or export as GLB"#);
    insta::assert_snapshot!(with(r#""scene": 0"#, r#""extensionsRequired": ["KHR_draco_mesh_compression"]"#), @"glTF, the file: it needs the extension KHR_draco_mesh_compression; export without compression and instancing");
    insta::assert_snapshot!(with(r#"{"version": "2.0"}"#, r#"{"version": "1.0"}"#), @r#"glTF, the file: glTF version "1.0" is not read; export version 2"#);
    insta::assert_snapshot!(refuse(Format::Gltf, b"glTF\x02\0\0\0\x01\0\0\0\xFF\xFF\xFF\xFFJSON{}"), @"glTF, byte 12: a chunk of 4294967295 bytes is announced, but 2 are left; the file is cut off");
    insta::assert_snapshot!(refuse(Format::Gltf, "glTF\x02"), @"glTF, byte 4: ends in a header; the file is cut off");
    insta::assert_snapshot!(refuse(Format::Gltf, "{\"asset\": 3}"), @"glTF, line 1: its JSON cannot be read: invalid type: integer `3`, expected struct Asset at line 1 column 11");
    let mut wild = gltf_buffer();
    wild[64] = 4;
    insta::assert_snapshot!(refuse(Format::Gltf, glb(&gltf_square("", ""), &wild)), @"glTF, the file: mesh 0, primitive 0: an index is 4, but there are 4 vertices");
}

#[test]
fn the_content_tells_the_format() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        path
    };
    let stl = binary_stl(1, &[TRIANGLE]);
    for (name, content, format) in [
        ("a.obj", CUBE_OBJ.as_bytes(), Format::Obj),
        ("b", CUBE_OBJ.as_bytes(), Format::Obj),
        ("c.STL", &stl[..], Format::Stl),
        ("d.ply", &binary_ply(true)[..], Format::Ply),
        (
            "e.glb",
            &glb(&gltf_square("", ""), &gltf_buffer())[..],
            Format::Gltf,
        ),
    ] {
        let file = read_surface(&path(name, content)).unwrap();
        assert_eq!((file.format, file.notes), (format, vec![]), "{name}");
    }
    let misnamed = read_surface(&path("f.obj", &stl)).unwrap();
    assert_eq!(misnamed.format, Format::Stl);
    insta::assert_snapshot!(misnamed.notes[0].to_string(), @"named .obj, but its content is STL; read as STL");
    let unknown = read_surface(&path("g.fbx", b"Kaydara FBX Binary")).unwrap_err();
    assert!(matches!(unknown, ReadError::UnknownFormat { .. }));
    assert!(matches!(
        read_surface(folder.path()),
        Err(ReadError::NotAFile { .. })
    ));
    assert!(matches!(
        read_surface(Path::new("not/there.obj")),
        Err(ReadError::Io { .. })
    ));
    for name in ["h.obj", "h.stl", "h.ply", "h.off", "h.glb"] {
        assert!(
            matches!(
                read_surface(&path(name, b"")),
                Err(ReadError::Content { .. })
            ),
            "{name}"
        );
    }
}

proptest! {
    /// Whatever single bytes are changed to, readers answer, and what they give has its vertices.
    #[test]
    fn damage_is_answered(which in 0_usize..6, at in any::<prop::sample::Index>(), byte: u8, cut in any::<prop::sample::Index>()) {
        let (format, mut bytes) = match which {
            0 => (Format::Obj, CUBE_OBJ.as_bytes().to_vec()),
            1 => (Format::Stl, binary_stl(2, &[TRIANGLE, TRIANGLE])),
            2 => (Format::Ply, binary_ply(true)),
            3 => (Format::Ply, binary_ply(false)),
            4 => (Format::Off, b"OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n".to_vec()),
            _ => (Format::Gltf, glb(&gltf_square("", ""), &gltf_buffer())),
        };
        let at = at.index(bytes.len());
        bytes[at] = byte;
        for bytes in [&bytes[..], &bytes[..cut.index(bytes.len())]] {
            if let Ok(file) = read_surface_bytes(bytes, format) {
                let n = file.surface.points.len();
                prop_assert!(file.surface.triangles.iter().flatten().all(|&v| (v as usize) < n));
            }
        }
    }
}
