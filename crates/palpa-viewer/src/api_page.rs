//! A page that lists the operations of the control API. It links the `OpenAPI` document, which has
//! the types of requests and answers.

use serde_json::{Map, Value};

const HEAD: &str = "<!doctype html>
<html lang=en>
<meta charset=utf-8>
<meta name=viewport content=\"width=device-width, initial-scale=1\">
<title>Palpa viewer: control API</title>
<style>
:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif }
body { max-width: 50rem; margin: 2rem auto; padding: 0 1rem }
dt { margin-top: 1rem; font-weight: 600 }
</style>
<h1>Control API</h1>
";

/// HTML of the operations in `document`, an `OpenAPI` document. `query` is the query of the page's
/// own address; its link to the document repeats it, because it needs the same token.
pub(crate) fn html(document: &Value, query: Option<&str>) -> String {
    let query = query.map_or(String::new(), |query| format!("?{}", escape(query)));
    let about = text(&document["info"]["description"]);
    let operations: String = operations(document).collect();
    format!(
        "{HEAD}<p>{about}</p>\n<p>Types of requests and answers: <a href=\"/api/openapi.json{query}\">openapi.json</a> \
         (OpenAPI 3.1).</p>\n<dl>\n{operations}</dl>\n</html>\n"
    )
}

fn operations(document: &Value) -> impl Iterator<Item = String> {
    entries(&document["paths"]).flat_map(|(path, methods)| {
        entries(methods).map(move |(method, operation)| {
            format!(
                "<dt><code>{} {}</code> {}\n<dd>{}\n",
                escape(&method.to_uppercase()),
                escape(path),
                text(&operation["summary"]),
                text(&operation["description"])
            )
        })
    })
}

fn entries(value: &Value) -> impl Iterator<Item = (&str, &Value)> {
    let object = value.as_object().into_iter().flat_map(Map::iter);
    object.map(|(key, value)| (key.as_str(), value))
}

fn text(value: &Value) -> String {
    escape(value.as_str().unwrap_or_default())
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
