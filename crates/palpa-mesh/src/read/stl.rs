//! STL, binary and ASCII. The normals in the file are ignored: they add nothing to the winding, and
//! they are often wrong.

use super::text::{decode, lines, point};
use super::{Builder, Fault, Parsed, Place, ReadNote};
use crate::Vec3;

/// Length of the header, in bytes: 80 bytes of text and the number of triangles.
const HEADER: usize = 84;
/// Length of a record, in bytes: a normal and three corners as `f32`, and two bytes of attributes.
const RECORD: usize = 50;

/// Whether the length of the bytes fits a binary STL with their number of triangles. A file that
/// starts with `solid` may still be binary, so the length decides.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    n_triangles(bytes).is_some_and(|n| n > 0 && bytes.len() as u64 == expected_len(n))
}

pub(super) fn parse(bytes: &[u8], builder: &mut Builder) -> Parsed<()> {
    let head = decode(&bytes[..bytes.len().min(HEADER)]).0;
    if !is_binary(bytes) && head.trim_start().to_ascii_lowercase().starts_with("solid") {
        return parse_ascii(bytes, builder);
    }
    parse_binary(bytes, builder)
}

fn n_triangles(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEADER - 4..HEADER)?;
    Some(u32::from_le_bytes(count.try_into().ok()?))
}

fn expected_len(n: u32) -> u64 {
    HEADER as u64 + RECORD as u64 * u64::from(n)
}

fn parse_binary(bytes: &[u8], builder: &mut Builder) -> Parsed<()> {
    let Some(n) = n_triangles(bytes) else {
        let problem = format!("{} bytes are too few for an STL file", bytes.len());
        return Err(Fault::new(Place::File, problem));
    };
    let expected = expected_len(n);
    let len = bytes.len() as u64;
    if len < expected {
        let problem = format!(
            "neither ASCII (it does not start with \"solid\") nor binary (for the {n} triangles that it announces it \
             would have {expected} bytes, and has {len}); if it was cut off, copy it again"
        );
        return Err(Fault::new(Place::Byte(HEADER - 4), problem));
    }
    if len > expected {
        let bytes = (len - expected) as usize;
        builder.note(ReadNote::TrailingBytes { bytes });
    }
    let n = n as usize;
    builder.points.reserve(3 * n);
    builder.reserve_faces(n);
    for (i, record) in bytes[HEADER..].chunks_exact(RECORD).take(n).enumerate() {
        let float = |k: usize| {
            let at = 12 + 4 * k;
            f64::from(f32::from_le_bytes([
                record[at],
                record[at + 1],
                record[at + 2],
                record[at + 3],
            ]))
        };
        let first = builder.points.len() as u32;
        for corner in 0..3 {
            let k = 3 * corner;
            builder
                .points
                .push(Vec3::new(float(k), float(k + 1), float(k + 2)));
        }
        builder.face(&[first, first + 1, first + 2], Place::Record(i))?;
    }
    Ok(())
}

fn parse_ascii(bytes: &[u8], builder: &mut Builder) -> Parsed<()> {
    let (text, is_utf16) = decode(bytes);
    if is_utf16 {
        builder.note(ReadNote::Utf16);
    }
    let mut corners: Vec<u32> = Vec::new();
    let mut opened = None;
    for (line, text) in lines(&text) {
        let place = Place::Line(line);
        let mut words = text.split_whitespace();
        let Some(word) = words.next() else { continue };
        match word.to_ascii_lowercase().as_str() {
            "solid" => builder.n_objects += 1,
            "outer" => {
                if let Some(at) = opened {
                    let problem = format!("a loop starts before the one of line {at} has ended");
                    return Err(Fault::new(place, problem));
                }
                opened = Some(line);
                corners.clear();
            }
            "vertex" if opened.is_some() => {
                corners.push(builder.points.len() as u32);
                builder.points.push(point(&mut words, line)?);
            }
            "vertex" => return Err(Fault::new(place, "a vertex outside of \"outer loop\"")),
            "endloop" => {
                opened = None;
                builder.face(&corners, place)?;
            }
            "facet" | "endfacet" | "endsolid" | "color" => {}
            _ => {
                let problem = format!("{:?} is no word of an STL file", super::text::shorten(word));
                return Err(Fault::new(place, problem));
            }
        }
    }
    match opened {
        Some(at) => Err(Fault::new(
            Place::Line(at),
            "the loop that starts here has no end; the file is cut off",
        )),
        None => Ok(()),
    }
}
