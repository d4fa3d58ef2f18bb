//! Errors in a scene file, and their place.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use crate::limits::Limits;
use crate::units::shortened;

/// Two words are alike from this Jaro–Winkler similarity on.
const LEAST_LIKENESS: f64 = 0.75;

/// The reason why a scene file is refused. Every message names the place, the text found and the
/// remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file could not be read.
    #[error("{}: cannot be read: {source}; check the path and its permissions", path.display())]
    Io {
        /// The scene file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The scene is larger than the limit.
    #[error(
        "{place}: is larger than {limit} bytes; a scene is a short text, so this is probably another file"
    )]
    TooLarge {
        /// The scene.
        place: Box<Place>,
        /// The limit, in bytes.
        limit: u64,
    },
    /// The text is not TOML.
    #[error("{place}: is not valid TOML: {message}")]
    Syntax {
        /// The place.
        place: Box<Place>,
        /// Message of the parser.
        message: String,
    },
    /// An unknown key, or a word that a key does not accept.
    #[error("{place}: unknown {what} `{found}`; {}", advice(nearest.as_deref(), allowed))]
    Unknown {
        /// The place.
        place: Box<Place>,
        /// `key`, `value` or `tissue`.
        what: &'static str,
        /// The unknown word.
        found: String,
        /// The nearest allowed word, if one is near.
        nearest: Option<String>,
        /// The allowed words.
        allowed: Vec<String>,
    },
    /// A value outside the range of its key.
    #[error("{place}: {found} is outside the allowed range {allowed}; check the number{}", if found.starts_with('"') { " and its unit" } else { "" })]
    OutOfRange {
        /// The place.
        place: Box<Place>,
        /// The value as written.
        found: String,
        /// The range.
        allowed: String,
    },
    /// A value of the wrong kind, a missing key, or keys that exclude each other.
    #[error("{place}: {message}")]
    Invalid {
        /// The place.
        place: Box<Place>,
        /// The message: text found, text expected, and remedy.
        message: String,
    },
}

impl SceneError {
    /// The same error with the key only, without line and column: for a text that a program made
    /// and no user has seen.
    #[must_use]
    pub fn by_key(mut self) -> Self {
        match &mut self {
            Self::Io { .. } => {}
            Self::TooLarge { place, .. }
            | Self::Syntax { place, .. }
            | Self::Unknown { place, .. }
            | Self::OutOfRange { place, .. }
            | Self::Invalid { place, .. } => (place.line, place.column) = (0, 0),
        }
        self
    }
}

fn advice(nearest: Option<&str>, allowed: &[String]) -> String {
    let list = allowed.join("`, `");
    match (nearest, allowed) {
        (Some(nearest), [_]) => format!("did you mean `{nearest}`?"),
        (Some(nearest), _) => format!("did you mean `{nearest}`? Possible are `{list}`"),
        (None, []) => "nothing is expected here; remove it".to_owned(),
        (None, _) => format!("possible are `{list}`"),
    }
}

/// A place in a scene file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file, unless the scene was given as text.
    pub file: Option<PathBuf>,
    /// Line, from 1; 0 when the whole file is meant.
    pub line: usize,
    /// Column in characters, from 1; 0 when the whole file is meant.
    pub column: usize,
    /// Path of the key, such as `layer[0].thickness`, counted from 0; empty outside any key.
    pub key: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.file {
            Some(file) => write!(f, "{}", file.display())?,
            None => f.write_str("scene")?,
        }
        if self.line > 0 {
            write!(f, ":{}:{}", self.line, self.column)?;
        }
        if !self.key.is_empty() {
            write!(f, ": {}", self.key)?;
        }
        Ok(())
    }
}

/// The text of a scene, for finding the place of an error.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Document<'a> {
    pub(crate) text: &'a str,
    pub(crate) file: Option<&'a Path>,
}

/// A step of a key's path.
#[derive(Debug, Clone, Copy)]
enum Step {
    Key(&'static str),
    Index(usize),
}

/// A key of the scene, for reporting errors of its value.
#[derive(Debug, Clone)]
pub(crate) struct Site<'a> {
    document: Document<'a>,
    path: Vec<Step>,
}

impl<'a> Document<'a> {
    pub(crate) fn site(self, key: &'static str) -> Site<'a> {
        Site {
            document: self,
            path: vec![Step::Key(key)],
        }
    }

    /// The scene as a whole, for errors that have no place in the text.
    pub(crate) fn whole(self, key: String) -> Place {
        Place {
            file: self.file.map(Path::to_owned),
            line: 0,
            column: 0,
            key,
        }
    }

    /// The error for a file that stops being UTF-8 at this offset, which is the end of `self.text`.
    pub(crate) fn not_text(self, offset: usize) -> SceneError {
        SceneError::Syntax {
            place: self.place(offset, String::new()).into(),
            message: "a byte that is not UTF-8 text; save the scene as UTF-8".to_owned(),
        }
    }

    fn place(self, offset: usize, key: String) -> Place {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Place {
            file: self.file.map(Path::to_owned),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            key,
        }
    }

    /// Converts an error of the TOML library. `is_syntax` says that the text itself is not TOML.
    pub(crate) fn toml_error(self, error: &toml::de::Error, is_syntax: bool) -> SceneError {
        let span = error.span().unwrap_or(0..0);
        let mut message = plain(error.message());
        if is_syntax {
            let place = self.place(span.start, String::new()).into();
            let found = self.text.get(span).unwrap_or_default().trim();
            if let Some(line) = found.lines().next() {
                message.extend([", at `", &shortened(line), "`"]);
            }
            return SceneError::Syntax { place, message };
        }
        let key = DeTable::parse(self.text)
            .ok()
            .and_then(|root| key_at(&DeValue::Table(root.into_inner()), &span))
            .unwrap_or_default();
        if ["layer", "lump"].contains(&key.as_str()) && message.contains("expected a sequence") {
            message = format!(
                "a single table; write every {key} under its own [[{key}]], in two brackets"
            );
        }
        let place = self.place(span.start, key);
        // serde names an unknown word only in its message: unknown field `a`, expected `b` or `c`
        let what = match () {
            () if message.starts_with("unknown field") => "key",
            () if message.starts_with("unknown variant") => "value",
            () => {
                return SceneError::Invalid {
                    place: place.into(),
                    message,
                };
            }
        };
        let (found, expected) = message.rsplit_once("`, expected").unwrap_or((&message, ""));
        let found = found.split_once('`').map_or(found, |(_, found)| found);
        let allowed = expected.split('`').skip(1).step_by(2).map(str::to_owned);
        unknown(place, what, shortened(found), allowed.collect())
    }
}

/// A message of the parser, with Rust's terms replaced by those of a scene file.
fn plain(message: &str) -> String {
    let message = message.trim();
    // Some messages repeat a value of any length; the expected kind stands at the end.
    let message = if message.len() > 500 {
        let end = message.char_indices().rev().nth(250);
        let end = end.map_or(message, |(i, _)| &message[i..]);
        format!("{} {end}", shortened(message))
    } else {
        message.to_owned()
    };
    message
        .replace('\n', "; ")
        .replace("missing field", "missing key")
        .replace("expected u32", "expected a whole number, 0 or more")
        .replace("expected f64", "expected a number")
        .replace("an array of length 3", "three values in brackets")
}

fn unknown(place: Place, what: &'static str, found: String, allowed: Vec<String>) -> SceneError {
    let nearest = nearest(&found, allowed.iter().map(String::as_str)).map(str::to_owned);
    SceneError::Unknown {
        place: place.into(),
        what,
        found,
        nearest,
        allowed,
    }
}

/// The known word that `found` is most alike, for "did you mean"; `None` if it is like none of them.
pub fn nearest<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    (known.into_iter())
        .map(|name| (strsim::jaro_winkler(found, name), name))
        .filter(|&(likeness, _)| likeness > LEAST_LIKENESS)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

impl Site<'_> {
    pub(crate) fn key(&self, key: &'static str) -> Self {
        self.step(Step::Key(key))
    }

    pub(crate) fn index(&self, index: usize) -> Self {
        self.step(Step::Index(index))
    }

    fn step(&self, step: Step) -> Self {
        let mut site = self.clone();
        site.path.push(step);
        site
    }

    /// The value, or an error if it is out of its limits.
    pub(crate) fn within<T: PartialOrd + fmt::Display>(
        &self,
        value: T,
        limits: &Limits<T>,
    ) -> Result<T, SceneError> {
        if limits.contains(&value) {
            return Ok(value);
        }
        let (place, found) = self.locate();
        Err(SceneError::OutOfRange {
            place: place.into(),
            found: found.unwrap_or_else(|| value.to_string()),
            allowed: limits.to_string(),
        })
    }

    pub(crate) fn invalid(&self, message: impl Into<String>) -> SceneError {
        SceneError::Invalid {
            place: self.locate().0.into(),
            message: message.into(),
        }
    }

    pub(crate) fn unknown(
        &self,
        what: &'static str,
        found: &str,
        allowed: Vec<String>,
    ) -> SceneError {
        unknown(self.locate().0, what, shortened(found), allowed)
    }

    /// Place of this key's value, or of the innermost table around it in the text, and the value as
    /// written.
    fn locate(&self) -> (Place, Option<String>) {
        let text = self.document.text;
        let mut key = String::new();
        for step in &self.path {
            match step {
                Step::Key(name) if key.is_empty() => key.push_str(name),
                Step::Key(name) => key.extend([".", name]),
                Step::Index(index) => key.extend(["[", &index.to_string(), "]"]),
            }
        }
        let place = |key, span: Option<Range<usize>>| match span {
            Some(span) => self.document.place(span.start, key),
            None => self.document.whole(key),
        };
        let Ok(root) = DeTable::parse(text) else {
            return (place(key, None), None);
        };
        let mut span = None;
        let mut value = &DeValue::Table(root.into_inner());
        for step in &self.path {
            let next = match (step, value) {
                (Step::Key(name), DeValue::Table(table)) => table.get(*name),
                (Step::Index(index), DeValue::Array(array)) => array.get(*index),
                _ => None,
            };
            let Some(next) = next else {
                return (place(key, span), None);
            };
            span = Some(next.span());
            value = next.get_ref();
        }
        let written = span.clone().and_then(|span| text.get(span)).map(shortened);
        (place(key, span), written)
    }
}

/// Path of the innermost key whose value contains this span.
fn key_at(value: &DeValue<'_>, span: &Range<usize>) -> Option<String> {
    let holds = |outer: Range<usize>| outer.start <= span.start && span.end <= outer.end;
    match value {
        DeValue::Table(table) => table.iter().find_map(|(key, value)| {
            let name = shortened(key.get_ref());
            if holds(key.span()) {
                return Some(name);
            }
            match key_at(value.get_ref(), span) {
                Some(inner) if inner.starts_with('[') => Some(format!("{name}{inner}")),
                Some(inner) => Some(format!("{name}.{inner}")),
                None => holds(value.span()).then_some(name),
            }
        }),
        DeValue::Array(array) => {
            array
                .iter()
                .enumerate()
                .find_map(|(i, value)| match key_at(value.get_ref(), span) {
                    Some(inner) if inner.starts_with('[') => Some(format!("[{i}]{inner}")),
                    Some(inner) => Some(format!("[{i}].{inner}")),
                    None => holds(value.span()).then(|| format!("[{i}]")),
                })
        }
        _ => None,
    }
}
