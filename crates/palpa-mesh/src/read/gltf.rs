//! glTF 2.0 and GLB: the triangles of every mesh instance of the scene, in the frame of the scene.
//!
//! Only the parts that hold geometry are read. From the `gltf` crate we would need only the JSON
//! types, but it panics on a short GLB length and refuses files because of faults in materials. So
//! the few types are defined here.

mod document;

use std::collections::BTreeSet;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use nalgebra::{Matrix4, Point3};

use super::{Builder, Fault, MAX_FILE_BYTES, Parsed, Place, ReadNote, load};
use document::{Accessor, Document, Primitive};

/// Largest number of corners that the instances of a file may have together, per byte of the file.
/// Many nodes may use the same mesh; a corner of a mesh that is used once takes several bytes.
const MAX_CORNERS_PER_BYTE: usize = 4;
/// Number of corners that is always allowed, however short the file is.
const MIN_CORNER_LIMIT: usize = 1 << 20;

pub(super) fn parse(bytes: &[u8], folder: Option<&Path>, builder: &mut Builder) -> Parsed<()> {
    let (json, chunk) = if bytes.starts_with(b"glTF") {
        split_glb(bytes)?
    } else {
        (bytes, None)
    };
    let document: Document = serde_json::from_slice(json).map_err(|e| {
        Fault::new(
            Place::Line(e.line()),
            format!("its JSON cannot be read: {e}"),
        )
    })?;
    document.check_supported()?;
    let buffers = (0..document.buffers.len())
        .map(|i| load_buffer(&document, i, chunk, folder))
        .collect::<Parsed<Vec<_>>>()?;
    let n_bytes = bytes.len() + buffers.iter().map(Vec::len).sum::<usize>();
    let mut scene = Scene {
        document: &document,
        buffers: &buffers,
        builder,
        n_corners_left: MIN_CORNER_LIMIT.max(MAX_CORNERS_PER_BYTE.saturating_mul(n_bytes)),
        n_not_faces: 0,
    };
    scene.add_nodes()?;
    if scene.n_not_faces > 0 {
        let count = scene.n_not_faces;
        scene.builder.note(ReadNote::NotFaces { count });
    }
    Ok(())
}

fn fault(problem: impl Into<String>) -> Fault {
    Fault::new(Place::File, problem)
}

fn missing(what: &str, index: usize) -> Fault {
    fault(format!(
        "{what} {index} does not exist, but the file refers to it; export it again"
    ))
}

/// The JSON and the binary chunk of a GLB: a header of 12 bytes, then chunks of length, type and
/// content.
fn split_glb(bytes: &[u8]) -> Parsed<(&[u8], Option<&[u8]>)> {
    let word = |at: usize| -> Parsed<u32> {
        let word = bytes
            .get(at..at + 4)
            .ok_or_else(|| Fault::new(Place::Byte(at), "ends in a header; the file is cut off"))?;
        Ok(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
    };
    let version = word(4)?;
    if version != 2 {
        let problem = format!("glTF version {version} is not read; export version 2");
        return Err(Fault::new(Place::Byte(4), problem));
    }
    let mut json = None;
    let mut at = 12;
    while at < bytes.len() {
        let (len, kind) = (word(at)? as usize, word(at + 4)?.to_le_bytes());
        let left = bytes.len() - at - 8;
        let chunk = bytes.get(at + 8..at + 8 + len).ok_or_else(|| {
            let problem = format!(
                "a chunk of {len} bytes is announced, but {left} are left; the file is cut off"
            );
            Fault::new(Place::Byte(at), problem)
        })?;
        match (&kind, json) {
            (b"JSON", None) => json = Some(chunk),
            (b"BIN\0", Some(json)) => return Ok((json, Some(chunk))),
            _ => {}
        }
        at += 8 + len.next_multiple_of(4);
    }
    let json = json.ok_or_else(|| fault("the GLB has no JSON chunk"))?;
    Ok((json, None))
}

/// The bytes of a buffer: the GLB's own chunk, a data URI, or a file beside this one.
fn load_buffer(
    document: &Document,
    index: usize,
    chunk: Option<&[u8]>,
    folder: Option<&Path>,
) -> Parsed<Vec<u8>> {
    let buffer = &document.buffers[index];
    let in_buffer = |problem: String| fault(format!("buffer {index}: {problem}"));
    let bytes = match buffer.uri.as_deref() {
        None if index == 0 => chunk
            .ok_or_else(|| in_buffer("has neither a URI nor a binary chunk".to_owned()))?
            .to_vec(),
        None => return Err(in_buffer("has no URI".to_owned())),
        Some(uri) if uri.starts_with("data:") => {
            let data = uri
                .split_once(";base64,")
                .ok_or_else(|| in_buffer("its data URI is not in base64".to_owned()))?
                .1;
            BASE64
                .decode(data)
                .map_err(|e| in_buffer(format!("its base64 cannot be read: {e}")))?
        }
        Some(uri) => {
            let name = file_name(uri).ok_or_else(|| {
                in_buffer(format!("{uri:?} is not the name of a file beside this one; put it there, or export as GLB"))
            })?;
            let folder = folder
                .ok_or_else(|| in_buffer(format!("needs the file {name:?}; export as GLB")))?;
            load(&folder.join(name), MAX_FILE_BYTES).map_err(|e| in_buffer(e.to_string()))?
        }
    };
    if bytes.len() < buffer.byte_length {
        let problem = format!(
            "{} bytes are announced, but it has {}",
            buffer.byte_length,
            bytes.len()
        );
        return Err(in_buffer(problem));
    }
    Ok(bytes)
}

/// The file name in a relative URI without folders, with `%20` and the like decoded. `None` for a
/// name that could lead out of the folder.
fn file_name(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        rest = tail;
        if *first == b'%' {
            let digits = std::str::from_utf8(tail.get(..2)?).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = &tail[2..];
        } else {
            bytes.push(*first);
        }
    }
    let name = String::from_utf8(bytes).ok()?;
    let is_plain =
        !name.contains(['/', '\\', ':', '\0']) && !matches!(name.as_str(), "" | "." | "..");
    is_plain.then_some(name)
}

#[derive(Debug)]
struct Scene<'a> {
    document: &'a Document,
    buffers: &'a [Vec<u8>],
    builder: &'a mut Builder,
    n_corners_left: usize,
    n_not_faces: usize,
}

impl Scene<'_> {
    /// Visits the tree of nodes from the roots of the scene. Each node may be reached only once, as
    /// the format requires.
    fn add_nodes(&mut self) -> Parsed<()> {
        let mut seen = BTreeSet::new();
        let mut open: Vec<(usize, Matrix4<f64>)> = self
            .document
            .roots()?
            .into_iter()
            .rev()
            .map(|n| (n, Matrix4::identity()))
            .collect();
        while let Some((index, scene_from_parent)) = open.pop() {
            let node = self
                .document
                .nodes
                .get(index)
                .ok_or_else(|| missing("node", index))?;
            if !seen.insert(index) {
                return Err(fault(format!(
                    "node {index} is reached twice; nodes must form a tree"
                )));
            }
            let scene_from_node = scene_from_parent * node.parent_from_node();
            open.extend(
                node.children
                    .iter()
                    .rev()
                    .map(|&child| (child, scene_from_node)),
            );
            if let Some(mesh) = node.mesh {
                self.add_mesh(mesh, &scene_from_node)?;
            }
        }
        Ok(())
    }

    fn add_mesh(&mut self, index: usize, scene_from_node: &Matrix4<f64>) -> Parsed<()> {
        let mesh = self
            .document
            .meshes
            .get(index)
            .ok_or_else(|| missing("mesh", index))?;
        self.builder.n_objects += 1;
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            self.add_primitive(primitive, scene_from_node)
                .map_err(|f| {
                    Fault::new(
                        f.place,
                        format!("mesh {index}, primitive {i}: {}", f.problem),
                    )
                })?;
        }
        Ok(())
    }

    fn add_primitive(
        &mut self,
        primitive: &Primitive,
        scene_from_node: &Matrix4<f64>,
    ) -> Parsed<()> {
        let Some(position) = primitive.attributes.position else {
            self.n_not_faces += 1;
            return Ok(());
        };
        if !matches!(primitive.mode, 4..=6) {
            self.n_not_faces += 1;
            return Ok(());
        }
        let base = self.builder.points.len() as u32;
        let accessor = self.document.accessor(position)?;
        self.spend(accessor.count)?;
        let coordinates = self.values(accessor, 3)?;
        let n = coordinates.len() / 3;
        let points = coordinates.chunks_exact(3).map(|x| {
            let p = Point3::new(x[0], x[1], x[2]);
            // The last row of a node's matrix is (0, 0, 0, 1).
            (scene_from_node * p.to_homogeneous()).xyz()
        });
        self.builder.points.extend(points);

        let order: Vec<u32> = match primitive.indices {
            None => (0..n as u32).collect(),
            Some(i) => {
                let accessor = self.document.accessor(i)?;
                self.spend(accessor.count)?;
                let indices = self.values(accessor, 1)?;
                let checked = indices.iter().map(|&i| match i {
                    i if i >= 0.0 && i < n as f64 && i.fract() == 0.0 =>
                    {
                        #[expect(clippy::cast_sign_loss, reason = "checked to be from 0")]
                        Ok(i as u32)
                    }
                    _ => Err(fault(format!(
                        "an index is {i}, but there are {n} vertices"
                    ))),
                });
                checked.collect::<Parsed<_>>()?
            }
        };
        // A mirrored instance turns its triangles inside out, so their winding is reversed again.
        let is_mirrored = scene_from_node.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        let triangles = n_triangles(primitive.mode, order.len());
        self.builder.reserve_faces(triangles);
        for t in 0..triangles {
            let [a, b, c] = match primitive.mode {
                4 => [3 * t, 3 * t + 1, 3 * t + 2],
                5 if t % 2 == 0 => [t, t + 1, t + 2],
                5 => [t + 1, t, t + 2],
                _ => [0, t + 1, t + 2],
            }
            .map(|k| base + order[k]);
            let corners = if is_mirrored { [a, c, b] } else { [a, b, c] };
            self.builder.face(&corners, Place::Record(t))?;
        }
        Ok(())
    }

    /// Subtracts corners from the file's limit. A few bytes can use a mesh many times, or announce
    /// a buffer of zeros.
    fn spend(&mut self, n: usize) -> Parsed<()> {
        self.n_corners_left = self.n_corners_left.checked_sub(n).ok_or_else(|| {
            fault("its parts have far more vertices together than a file of this size holds; apply the instances and export again")
        })?;
        Ok(())
    }

    /// The values of an accessor as numbers, `width` values for each element.
    fn values(&self, accessor: &Accessor, width: usize) -> Parsed<Vec<f64>> {
        if accessor.width() != Some(width) {
            return Err(fault(format!(
                "an accessor is of type {:?}, expected {width} value(s)",
                accessor.kind
            )));
        }
        let mut values = match accessor.buffer_view {
            Some(view) => self.strided(
                view,
                accessor.byte_offset,
                accessor.component_type,
                width,
                accessor.count,
            )?,
            None => vec![0.0; width * accessor.count],
        };
        if let Some(sparse) = &accessor.sparse {
            let at = &sparse.indices;
            let places = self.strided(
                at.buffer_view,
                at.byte_offset,
                at.component_type,
                1,
                sparse.count,
            )?;
            let new = &sparse.values;
            let new = self.strided(
                new.buffer_view,
                new.byte_offset,
                accessor.component_type,
                width,
                sparse.count,
            )?;
            for (&place, new) in places.iter().zip(new.chunks_exact(width)) {
                #[expect(
                    clippy::cast_sign_loss,
                    reason = "indices are of unsigned types; a cast saturates"
                )]
                let first = (place as usize).saturating_mul(width);
                values
                    .get_mut(first..first.saturating_add(width))
                    .ok_or_else(|| {
                        fault(format!(
                            "a sparse index is {place}, of {} elements",
                            accessor.count
                        ))
                    })?
                    .copy_from_slice(new);
            }
        }
        if accessor.normalized {
            let scale = scalar(accessor.component_type)?.largest;
            for value in &mut values {
                *value = (*value / scale).max(-1.0);
            }
        }
        Ok(values)
    }

    /// `count` elements of `width` values from a buffer view. Checks first that the view is long
    /// enough.
    fn strided(
        &self,
        view: usize,
        offset: usize,
        component: u32,
        width: usize,
        count: usize,
    ) -> Parsed<Vec<f64>> {
        let bytes = self.document.view(view, self.buffers)?;
        let scalar = scalar(component)?;
        let element = scalar.size * width;
        let stride = self.document.buffer_views[view]
            .byte_stride
            .unwrap_or(element);
        if stride < element {
            return Err(fault(format!(
                "a stride of {stride} bytes is less than an element of {element}"
            )));
        }
        if count == 0 {
            return Ok(Vec::new());
        }
        let end = stride
            .checked_mul(count - 1)
            .and_then(|n| n.checked_add(offset)?.checked_add(element))
            .filter(|&end| end <= bytes.len());
        if end.is_none() {
            let problem = format!(
                "{count} elements are announced, more than the {} bytes of their view hold",
                bytes.len()
            );
            return Err(fault(problem));
        }
        let elements = (0..count).flat_map(|i| {
            let at = offset + i * stride;
            bytes[at..at + element]
                .chunks_exact(scalar.size)
                .map(|raw| (scalar.read)(raw))
        });
        Ok(elements.collect())
    }
}

fn n_triangles(mode: u32, n_corners: usize) -> usize {
    match mode {
        4 => n_corners / 3,
        _ => n_corners.saturating_sub(2),
    }
}

/// How to read one component type. `largest` is the raw value that stands for 1 if values are
/// normalised.
struct Component {
    size: usize,
    largest: f64,
    read: fn(&[u8]) -> f64,
}

fn scalar(component: u32) -> Parsed<Component> {
    let of = |size, largest, read| {
        Ok(Component {
            size,
            largest,
            read,
        })
    };
    match component {
        5120 => of(1, 127.0, |b| f64::from(b[0].cast_signed())),
        5121 => of(1, 255.0, |b| f64::from(b[0])),
        5122 => of(2, 32767.0, |b| f64::from(i16::from_le_bytes([b[0], b[1]]))),
        5123 => of(2, 65535.0, |b| f64::from(u16::from_le_bytes([b[0], b[1]]))),
        5125 => of(4, 4294967295.0, |b| {
            f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        }),
        5126 => of(4, 1.0, |b| {
            f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        }),
        _ => Err(fault(format!(
            "component type {component} is none of glTF's"
        ))),
    }
}

impl Document {
    /// The bytes of a buffer view.
    fn view<'b>(&self, index: usize, buffers: &'b [Vec<u8>]) -> Parsed<&'b [u8]> {
        let view = self
            .buffer_views
            .get(index)
            .ok_or_else(|| missing("buffer view", index))?;
        let end = view.byte_offset.checked_add(view.byte_length);
        buffers
            .get(view.buffer)
            .and_then(|b| b.get(view.byte_offset..end?))
            .ok_or_else(|| fault(format!("buffer view {index} reaches beyond its buffer")))
    }
}

#[cfg(test)]
mod tests {
    use super::file_name;

    #[test]
    fn names_stay_in_the_folder() {
        assert_eq!(file_name("my%20skin.bin").as_deref(), Some("my skin.bin"));
        for uri in [
            "../a.bin",
            "a/b.bin",
            "%2e%2e",
            "..%2fa",
            "/etc/passwd",
            "C:a",
            "file:a",
            "",
            "%zz",
            "%2",
            "%",
        ] {
            assert_eq!(file_name(uri), None, "{uri}");
        }
    }
}
