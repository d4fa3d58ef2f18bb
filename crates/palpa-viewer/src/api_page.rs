//! The control API's document, for people: made on the server, of the document itself.

use serde_json::Value;

/// A page that shows the document.
pub(crate) fn html(document: &Value) -> String {
    let _ = document;
    String::new()
}
