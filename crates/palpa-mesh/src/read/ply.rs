//! PLY: a text header declares elements and their properties. Their values follow as text, or as
//! bytes in either byte order.

use std::str::SplitWhitespace;

use super::text::{number, shorten};
use super::{Builder, Fault, Parsed, Place, ReadNote};
use crate::Vec3;

/// Longest header, in bytes. The header is short and comes first. The limit stops the search for
/// `end_header` in a file without one.
const LONGEST_HEADER: usize = 1 << 20;

pub(super) fn parse(bytes: &[u8], builder: &mut Builder) -> Parsed<()> {
    let header = Header::parse(bytes)?;
    let body = &bytes[header.len..];
    let mut values = match header.encoding {
        Encoding::Ascii => {
            let text = std::str::from_utf8(body).map_err(|e| {
                let place = Place::Byte(header.len + e.valid_up_to());
                Fault::new(place, "the header says ASCII, but here is something else")
            })?;
            Values::Ascii {
                words: text.split_whitespace(),
                len: text.len(),
            }
        }
        Encoding::Binary { is_big_endian } => Values::Binary {
            rest: body,
            start: bytes.len(),
            is_big_endian,
        },
    };
    for element in &header.elements {
        values.check_room(element)?;
        match element.name.as_str() {
            "vertex" => read_vertices(element, &mut values, builder)?,
            "face" => read_faces(element, &mut values, builder)?,
            _ => skip(element, &mut values)?,
        }
    }
    if header
        .elements
        .iter()
        .any(|e| e.name == "tristrips" && e.count > 0)
    {
        builder.note(ReadNote::NotFaces { count: 1 });
    }
    Ok(())
}

#[derive(Debug, Clone, Copy)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

#[derive(Debug)]
struct Property {
    name: String,
    /// The type of the list's length, if the property is a list.
    list: Option<Scalar>,
    scalar: Scalar,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
    line: usize,
}

#[derive(Debug, Clone, Copy)]
enum Encoding {
    Ascii,
    Binary { is_big_endian: bool },
}

#[derive(Debug)]
struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
    /// Number of bytes before the first value.
    len: usize,
}

impl Header {
    fn parse(bytes: &[u8]) -> Parsed<Self> {
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut len = 0;
        for (i, raw) in bytes[..bytes.len().min(LONGEST_HEADER)]
            .split_inclusive(|&b| b == b'\n')
            .enumerate()
        {
            len += raw.len();
            let line = i + 1;
            let fault = |problem: String| Fault::new(Place::Line(line), problem);
            let text = String::from_utf8_lossy(raw);
            let mut words = text.split_whitespace();
            let first = words.next().unwrap_or("");
            match (i, first) {
                (0, "ply") | (_, "comment" | "obj_info" | "") => {}
                (0, _) => return Err(fault("a PLY file starts with the word ply; give a file of another format its own extension".to_owned())),
                (_, "format") => {
                    encoding = Some(match words.next().unwrap_or("") {
                        "ascii" => Encoding::Ascii,
                        "binary_little_endian" => Encoding::Binary {
                            is_big_endian: false,
                        },
                        "binary_big_endian" => Encoding::Binary {
                            is_big_endian: true,
                        },
                        other => return Err(fault(format!("unknown format {:?}", shorten(other)))),
                    });
                }
                (_, "element") => {
                    let name = words.next().unwrap_or("").to_owned();
                    let count = words.next().and_then(|w| w.parse().ok()).ok_or_else(|| {
                        fault(format!(
                            "the number of elements {:?} is no whole number",
                            shorten(&name)
                        ))
                    })?;
                    elements.push(Element {
                        name,
                        count,
                        properties: Vec::new(),
                        line,
                    });
                }
                (_, "property") => {
                    let property = parse_property(&mut words).ok_or_else(|| {
                        fault(format!("{:?} is no property", shorten(text.trim())))
                    })?;
                    elements
                        .last_mut()
                        .ok_or_else(|| fault("a property before any element".to_owned()))?
                        .properties
                        .push(property);
                }
                (_, "end_header") => {
                    let encoding =
                        encoding.ok_or_else(|| fault("the header names no format".to_owned()))?;
                    return Ok(Self {
                        encoding,
                        elements,
                        len,
                    });
                }
                (_, other) => {
                    return Err(fault(format!(
                        "{:?} is no word of a PLY header",
                        shorten(other)
                    )));
                }
            }
        }
        Err(Fault::new(
            Place::File,
            "the header has no end_header; the file is cut off",
        ))
    }
}

fn parse_property(words: &mut SplitWhitespace<'_>) -> Option<Property> {
    let first = words.next()?;
    let (list, scalar) = if first == "list" {
        (
            Some(Scalar::parse(words.next()?)?),
            Scalar::parse(words.next()?)?,
        )
    } else {
        (None, Scalar::parse(first)?)
    };
    let name = words.next()?.to_owned();
    Some(Property { name, list, scalar })
}

/// The rest of the body, read value by value.
#[derive(Debug)]
enum Values<'a> {
    Ascii {
        words: SplitWhitespace<'a>,
        len: usize,
    },
    Binary {
        rest: &'a [u8],
        start: usize,
        is_big_endian: bool,
    },
}

impl Values<'_> {
    /// The next value. The error is `None` at the end of the file, or the word that is not a
    /// number.
    fn next(&mut self, scalar: Scalar) -> Result<f64, Option<String>> {
        match self {
            Self::Ascii { words, .. } => {
                let word = words.next().ok_or(None)?;
                number(word).ok_or_else(|| Some(shorten(word)))
            }
            Self::Binary {
                rest,
                is_big_endian,
                ..
            } => {
                let mut raw = [0; 8];
                let size = scalar.size();
                let (value, left) = rest.split_at_checked(size).ok_or(None)?;
                *rest = left;
                raw[..size].copy_from_slice(value);
                if *is_big_endian {
                    raw[..size].reverse();
                }
                let [a, b, c, d, ..] = raw;
                Ok(match scalar {
                    Scalar::I8 => f64::from(i8::from_le_bytes([a])),
                    Scalar::U8 => f64::from(a),
                    Scalar::I16 => f64::from(i16::from_le_bytes([a, b])),
                    Scalar::U16 => f64::from(u16::from_le_bytes([a, b])),
                    Scalar::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
                    Scalar::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
                    Scalar::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
                    Scalar::F64 => f64::from_le_bytes(raw),
                })
            }
        }
    }

    /// Upper bound on the number of remaining bytes.
    fn bytes_left(&self) -> usize {
        match self {
            Self::Ascii { len, .. } => *len,
            Self::Binary { rest, .. } => rest.len(),
        }
    }

    /// Returns an error if the remaining bytes cannot hold all values of an element, before memory
    /// is reserved for them.
    fn check_room(&self, element: &Element) -> Parsed<()> {
        let least: usize = match self {
            // A digit and a blank for each value; the last value may lack the blank.
            Self::Ascii { .. } => 2 * element.properties.len(),
            Self::Binary { .. } => element
                .properties
                .iter()
                .map(|p| p.list.unwrap_or(p.scalar).size())
                .sum(),
        };
        let needed = (least.max(1)).saturating_mul(element.count);
        if needed > self.bytes_left().saturating_add(1) {
            let problem = format!(
                "{} elements {:?} are announced, which take at least {needed} bytes, but {} are left; \
                 if the file was cut off, copy it again",
                element.count,
                shorten(&element.name),
                self.bytes_left()
            );
            return Err(Fault::new(Place::Line(element.line), problem));
        }
        Ok(())
    }

    fn value(
        &mut self,
        property: &Property,
        scalar: Scalar,
        element: &Element,
        i: usize,
    ) -> Parsed<f64> {
        self.next(scalar).map_err(|word| {
            let what = shorten(&element.name);
            let problem = match word {
                Some(word) => format!(
                    "{what} {i}, property {:?}: {word:?} is not a number",
                    shorten(&property.name)
                ),
                None => format!(
                    "ends in {what} {i} of {}; the file is cut off",
                    element.count
                ),
            };
            let place = match self {
                Self::Ascii { .. } => Place::Record(i),
                Self::Binary { rest, start, .. } => Place::Byte(*start - rest.len()),
            };
            Fault::new(place, problem)
        })
    }

    /// The length of a list. Checks that the remaining bytes can hold that many values.
    fn list_len(
        &mut self,
        property: &Property,
        length: Scalar,
        element: &Element,
        i: usize,
    ) -> Parsed<usize> {
        let n = self.value(property, length, element, i)?;
        if n < 0.0 || n.fract() != 0.0 || n > self.bytes_left() as f64 {
            let problem = format!("{} {i} has a list of {n} values", shorten(&element.name));
            return Err(Fault::new(Place::Record(i), problem));
        }
        #[expect(clippy::cast_sign_loss, reason = "checked to be a whole number from 0")]
        Ok(n as usize)
    }
}

fn read_vertices(element: &Element, values: &mut Values<'_>, builder: &mut Builder) -> Parsed<()> {
    let axes = ["x", "y", "z"];
    for axis in axes {
        if !element
            .properties
            .iter()
            .any(|p| p.name == axis && p.list.is_none())
        {
            let problem = format!("the vertices have no coordinate {axis}");
            return Err(Fault::new(Place::Line(element.line), problem));
        }
    }
    builder.points.reserve(element.count);
    for i in 0..element.count {
        let mut p = Vec3::zeros();
        for property in &element.properties {
            let axis = axes.iter().position(|a| *a == property.name);
            if let Some(length) = property.list {
                for _ in 0..values.list_len(property, length, element, i)? {
                    values.value(property, property.scalar, element, i)?;
                }
            } else {
                let value = values.value(property, property.scalar, element, i)?;
                if let Some(axis) = axis {
                    p[axis] = value;
                }
            }
        }
        builder.points.push(p);
    }
    Ok(())
}

fn read_faces(element: &Element, values: &mut Values<'_>, builder: &mut Builder) -> Parsed<()> {
    let is_corners = |p: &Property| {
        p.list.is_some() && matches!(p.name.as_str(), "vertex_indices" | "vertex_index")
    };
    if element.count > 0 && !element.properties.iter().any(is_corners) {
        let problem = "the faces have no list vertex_indices";
        return Err(Fault::new(Place::Line(element.line), problem));
    }
    builder.reserve_faces(element.count);
    let mut corners = Vec::new();
    for i in 0..element.count {
        for property in &element.properties {
            let Some(length) = property.list else {
                values.value(property, property.scalar, element, i)?;
                continue;
            };
            let is_corners = is_corners(property);
            corners.clear();
            for _ in 0..values.list_len(property, length, element, i)? {
                let value = values.value(property, property.scalar, element, i)?;
                if is_corners {
                    if value.fract() != 0.0 {
                        let problem = format!("vertex {value} is no whole number");
                        return Err(Fault::new(Place::Record(i), problem));
                    }
                    corners.push(builder.vertex(value as i64, Place::Record(i))?);
                }
            }
            if is_corners {
                builder.face(&corners, Place::Record(i))?;
            }
        }
    }
    Ok(())
}

fn skip(element: &Element, values: &mut Values<'_>) -> Parsed<()> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for i in 0..element.count {
        for property in &element.properties {
            let n = match property.list {
                Some(length) => values.list_len(property, length, element, i)?,
                None => 1,
            };
            for _ in 0..n {
                values.value(property, property.scalar, element, i)?;
            }
        }
    }
    Ok(())
}
