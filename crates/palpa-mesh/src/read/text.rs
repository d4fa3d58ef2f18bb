//! Common parts of the text formats: encodings, lines, numbers.

use std::borrow::Cow;

use super::{Fault, Parsed, Place};

/// The text of a file, and whether it was UTF-16. Invalid bytes become the replacement character.
/// In names and comments this does no harm, and in a number it causes an error.
pub(super) fn decode(bytes: &[u8]) -> (Cow<'_, str>, bool) {
    match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => (String::from_utf8_lossy(rest), false),
        [0xFE, 0xFF, rest @ ..] => (utf16(rest, u16::from_be_bytes).into(), true),
        [0xFF, 0xFE, rest @ ..] => (utf16(rest, u16::from_le_bytes).into(), true),
        _ => (String::from_utf8_lossy(bytes), false),
    }
}

fn utf16(bytes: &[u8], unit: impl Fn([u8; 2]) -> u16) -> String {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units)
        .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
        .collect()
}

/// The lines of a text with their numbers from 1, without comments after `#` and without
/// surrounding blanks.
///
/// Lines end with `\n` or `\r\n`, or with `\r` alone in old files.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let (lf, cr) = (text.contains('\n'), '\r');
    text.split(if lf { '\n' } else { cr })
        .enumerate()
        .map(|(i, line)| (i + 1, line.split('#').next().unwrap_or("").trim()))
}

/// A number as the nearest `f64`. `nan` and `inf` count as numbers here; the check of the surface
/// finds them.
pub(super) fn number(word: &str) -> Option<f64> {
    word.parse().ok()
}

/// Three coordinates from the first words.
pub(super) fn point<'a>(
    words: &mut impl Iterator<Item = &'a str>,
    line: usize,
) -> Parsed<crate::Vec3> {
    let mut p = crate::Vec3::zeros();
    for x in p.iter_mut() {
        let word = words.next().ok_or_else(|| {
            Fault::new(
                Place::Line(line),
                "a vertex with fewer than three coordinates",
            )
        })?;
        *x = number(word).ok_or_else(|| {
            Fault::new(
                Place::Line(line),
                format!("{:?} is not a number", shorten(word)),
            )
        })?;
    }
    Ok(p)
}

/// A word for a message, cut to fit on a screen line.
pub(super) fn shorten(word: &str) -> String {
    const LONGEST: usize = 40;
    if word.chars().count() <= LONGEST {
        word.to_owned()
    } else {
        word.chars().take(LONGEST).chain(['…']).collect()
    }
}
