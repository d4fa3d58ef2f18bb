//! Wavefront OBJ: `v` and `f` lines. All other content (normals, texture, materials, groups) is
//! ignored.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::text::{decode, lines, number, shorten};
use super::{Builder, Fault, Parsed, Place, ReadNote};
use crate::Vec3;

pub(super) fn parse(bytes: &[u8], builder: &mut Builder) -> Parsed<()> {
    let (text, is_utf16) = decode(bytes);
    if is_utf16 {
        builder.note(ReadNote::Utf16);
    }
    let text = join_continued(&text);

    // Vertices are read first, because faces may come before the vertices that they use.
    let mut unread: BTreeMap<u32, (usize, &str)> = BTreeMap::new();
    for (line, text) in lines(&text) {
        let mut words = text.split_whitespace();
        match words.next() {
            Some("v") => match vertex(words, line)? {
                Ok(p) => builder.points.push(p),
                Err(word) => {
                    unread.insert(builder.points.len() as u32, (line, word));
                    builder.points.push(Vec3::repeat(f64::NAN));
                }
            },
            Some("o") => builder.n_objects += 1,
            _ => {}
        }
    }

    let mut n_before = 0_u64;
    let mut n_other = 0;
    let mut corners = Vec::new();
    for (line, text) in lines(&text) {
        let mut words = text.split_whitespace();
        match words.next() {
            Some("v") => n_before += 1,
            // The first version of the format used `fo`.
            Some("f" | "fo") => {
                corners.clear();
                for word in words {
                    let v = corner(word, n_before, line, builder)?;
                    if let Some((at, word)) = unread.get(&v) {
                        let word = shorten(word);
                        let problem = format!(
                            "{word:?} is not a number, and the face in line {line} uses this vertex"
                        );
                        return Err(Fault::new(Place::Line(*at), problem));
                    }
                    corners.push(v);
                }
                builder.face(&corners, Place::Line(line))?;
            }
            Some("l" | "p" | "curv" | "surf") => n_other += 1,
            _ => {}
        }
    }
    if let Some((line, _)) = unread.values().next() {
        let (count, first) = (unread.len(), Place::Line(*line));
        builder.note(ReadNote::UnreadVertices { count, first });
    }
    if n_other > 0 {
        builder.note(ReadNote::NotFaces { count: n_other });
    }
    Ok(())
}

/// Joins each line that ends in a backslash with the next. Empty lines are added, so that line
/// numbers stay the same.
fn join_continued(text: &str) -> Cow<'_, str> {
    if !text.contains("\\\n") && !text.contains("\\\r\n") {
        return text.into();
    }
    let mut joined = String::with_capacity(text.len());
    let mut n_owed = 0;
    for line in text.split('\n') {
        let line = line.trim_end_matches('\r');
        if let Some(part) = line.strip_suffix('\\') {
            joined.push_str(part);
            joined.push(' ');
            n_owed += 1;
        } else {
            joined.push_str(line);
            joined.extend(std::iter::repeat_n('\n', n_owed + 1));
            n_owed = 0;
        }
    }
    joined.into()
}

/// The three coordinates of a vertex, or the word that is not a number. Colours and a weight may
/// follow.
fn vertex<'a>(words: impl Iterator<Item = &'a str>, line: usize) -> Parsed<Result<Vec3, &'a str>> {
    let mut p = Vec3::zeros();
    let mut n = 0;
    for (x, word) in p.iter_mut().zip(words) {
        match number(word) {
            Some(value) => *x = value,
            None => return Ok(Err(word)),
        }
        n += 1;
    }
    if n < 3 {
        return Err(Fault::new(
            Place::Line(line),
            format!("a vertex with {n} coordinates instead of 3"),
        ));
    }
    Ok(Ok(p))
}

/// The vertex of a face corner: `7`, `7/1`, `7//3`, `7/1/3`, or `-2`, counted back from the latest
/// vertex.
fn corner(word: &str, n_before: u64, line: usize, builder: &Builder) -> Parsed<u32> {
    let place = Place::Line(line);
    let index = word.split('/').next().unwrap_or("");
    let index: i64 = index
        .parse()
        .map_err(|_| Fault::new(place, format!("{:?} is not a face corner", shorten(word))))?;
    let n = builder.points.len();
    let from_zero = match index {
        1.. => index - 1,
        0 => -1,
        _ => index.saturating_add_unsigned(n_before),
    };
    match usize::try_from(from_zero) {
        Ok(v) if v < n => Ok(v as u32),
        _ => {
            let problem = match (index, n) {
                (_, 0) => format!("a face uses vertex {index}, but there are no vertices"),
                (0, _) => "a face uses vertex 0, but OBJ counts from 1".to_owned(),
                (..0, _) => {
                    format!("a face uses vertex {index}, but only {n_before} come before it")
                }
                _ => format!("a face uses vertex {index}, but the vertices are 1 to {n}"),
            };
            Err(Fault::new(place, problem))
        }
    }
}
