//! Formats errors for a reader.

use std::fmt::Write as _;

/// The error and its causes, joined by colons; a cause that an earlier text already contains is
/// left out.
pub fn one_paragraph(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            let _ = write!(text, ": {cause}");
        }
    }
    text
}
