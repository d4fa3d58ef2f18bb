//! The control API's document, for people: made on the server, of the document itself.

use serde_json::{Map, Value};
use std::fmt::{self, Write};

const HEAD: &str = "<!doctype html>
<html lang=en>
<meta charset=utf-8>
<meta name=viewport content=\"width=device-width, initial-scale=1\">
<title>Palpa viewer: control API</title>
<style>
:root { color-scheme: light dark; --line: light-dark(#d8dde3, #363c44); --soft: light-dark(#f3f5f7, #1d2126);
  --accent: light-dark(#0b5c7a, #7cc7e6); font: 16px/1.5 system-ui, sans-serif }
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; background: light-dark(#fff, #14171a); color: light-dark(#1b2024, #dfe4e8) }
h1 { font-size: 1.7rem } h2 { margin-top: 2.5rem } h3 { margin: 2rem 0 .3rem; font-size: 1.05rem }
a { color: var(--accent) } code { font: .9em ui-monospace, monospace }
section { border: 1px solid var(--line); border-radius: 8px; padding: .3rem 1rem 1rem; margin: 1rem 0 }
section h3 { margin-top: .7rem }
table { border-collapse: collapse; width: 100% } th, td { text-align: left; vertical-align: top; padding: .3rem .8rem .3rem 0; border-top: 1px solid var(--line) }
th { font-weight: 600; border-top: 0 } td:first-child { white-space: nowrap; width: 7rem } td:nth-child(2):not(:last-child) { width: 15rem }
.method { display: inline-block; min-width: 3.2rem; padding: 0 .4rem; border-radius: 4px; background: var(--soft); color: var(--accent); text-align: center }
.kinds { columns: 4 10rem; padding: 0; list-style: none }
pre { background: var(--soft); padding: .8rem 1rem; border-radius: 8px; white-space: pre-wrap }
</style>
";

const EXAMPLE: &str = "curl -H 'Content-Type: application/json' -d '{\"type\": \"run_motion\"}' http://127.0.0.1:7750/api/control
curl -O http://127.0.0.1:7750/api/body.vtu";

/// A page that shows the document. `query` is that of its address, with the token, for its link.
pub(crate) fn html(document: &Value, query: Option<&str>) -> String {
    let mut page = String::from(HEAD);
    let query = query.map_or(String::new(), |query| format!("?{}", escape(query)));
    // A string takes all that is written.
    let _ = write(&mut page, document, &query);
    page
}

fn write(page: &mut String, document: &Value, query: &str) -> fmt::Result {
    let info = &document["info"];
    write!(
        page,
        "<h1>{}: control API</h1><p>Version {}. {}</p><p>The same for programs: <a href=\"/api/openapi.json{query}\">openapi.json</a>. For example:</p><pre>{}</pre>",
        text(&info["title"]),
        text(&info["version"]),
        text(&info["description"]),
        escape(EXAMPLE)
    )?;
    page.push_str("<h2>What can be asked</h2>");
    for (path, methods) in entries(&document["paths"]) {
        for (method, operation) in entries(methods) {
            endpoint(page, path, method, operation)?;
        }
    }
    page.push_str("<h2>Types</h2><ul class=kinds>");
    let schemas = &document["components"]["schemas"];
    for (name, _) in entries(schemas) {
        write!(page, "<li><a href=\"#{0}\">{0}</a>", escape(name))?;
    }
    page.push_str("</ul>");
    for (name, schema) in entries(schemas) {
        write!(page, "<section id=\"{0}\"><h3>{0}</h3>", escape(name))?;
        describe(page, schema)?;
        page.push_str("</section>");
    }
    page.push_str("</html>\n");
    Ok(())
}

fn endpoint(page: &mut String, path: &str, method: &str, operation: &Value) -> fmt::Result {
    write!(
        page,
        "<section><h3><span class=method>{}</span> <code>{}</code> {}</h3><p>{}</p>",
        escape(&method.to_uppercase()),
        escape(path),
        text(&operation["summary"]),
        text(&operation["description"])
    )?;
    page.push_str("<table>");
    for parameter in list(&operation["parameters"]) {
        write!(
            page,
            "<tr><td>{} <code>{}</code><td>{}<td>{}",
            text(&parameter["in"]),
            text(&parameter["name"]),
            kind(&parameter["schema"]),
            text(&parameter["description"])
        )?;
    }
    if let Some(body) = operation.get("requestBody") {
        page.push_str("<tr><td>body<td>");
        content(page, body)?;
        page.push_str("<td>");
    }
    for (status, response) in entries(&operation["responses"]) {
        write!(page, "<tr><td>{}<td>", escape(status))?;
        content(page, response)?;
        write!(page, "<td>{}", text(&response["description"]))?;
    }
    page.push_str("</table></section>");
    Ok(())
}

/// What a body is: its type, or the kind of file.
fn content(page: &mut String, body: &Value) -> fmt::Result {
    for (media, of) in entries(&body["content"]) {
        match of.get("schema") {
            Some(schema) => page.push_str(&kind(schema)),
            None => write!(page, "<code>{}</code>", escape(media))?,
        }
    }
    Ok(())
}

/// A type: what it is, what it holds, and its alternatives.
fn describe(page: &mut String, schema: &Value) -> fmt::Result {
    write!(page, "<p>{}</p>", text(&schema["description"]))?;
    let alternatives: Vec<&Value> = list(&schema["oneOf"])
        .chain(list(&schema["anyOf"]))
        .collect();
    if !alternatives.is_empty() {
        page.push_str("<table>");
        for alternative in alternatives {
            let (name, rest) = alternative_of(alternative);
            write!(
                page,
                "<tr><td><code>{name}</code><td>{}{rest}",
                text(&alternative["description"])
            )?;
        }
        page.push_str("</table>");
    }
    if schema["properties"].is_object() {
        page.push_str(&properties(schema));
    }
    Ok(())
}

/// What an alternative is told by, and what it holds beside.
fn alternative_of(schema: &Value) -> (String, String) {
    if let Some(name) = schema["const"].as_str() {
        return (escape(name), String::new());
    }
    let mut name = String::new();
    let mut rest = String::new();
    for part in std::iter::once(schema).chain(list(&schema["allOf"])) {
        for (key, property) in entries(&part["properties"]) {
            if let Some(tag) = property["const"].as_str() {
                let _ = write!(name, "{}: {}", escape(key), escape(tag));
            }
        }
        if part["$ref"].is_string() {
            let _ = write!(rest, " All of {}.", kind(part));
        }
        rest += &properties(part);
    }
    (name, rest)
}

/// A table of what an object holds, but for what it is told by.
fn properties(schema: &Value) -> String {
    let required: Vec<&Value> = list(&schema["required"]).collect();
    let mut rows = String::new();
    for (name, property) in entries(&schema["properties"]) {
        if property.get("const").is_some() {
            continue;
        }
        let optional = if required.iter().any(|&r| r == name) {
            ""
        } else {
            " (may be missing)"
        };
        let _ = write!(
            rows,
            "<tr><td><code>{}</code><td>{}{optional}<td>{}",
            escape(name),
            kind(property),
            text(&property["description"])
        );
    }
    if rows.is_empty() {
        rows
    } else {
        format!("<table>{rows}</table>")
    }
}

/// A type in a word or two.
fn kind(schema: &Value) -> String {
    if let Some(reference) = schema["$ref"].as_str() {
        let name = escape(reference.rsplit('/').next().unwrap_or(reference));
        return format!("<a href=\"#{name}\">{name}</a>");
    }
    let several: Vec<String> = ["anyOf", "oneOf", "allOf"]
        .iter()
        .flat_map(|key| list(&schema[*key]))
        .map(kind)
        .collect();
    if !several.is_empty() {
        return several.join(" or ");
    }
    let of_items = || kind(&schema["items"]);
    let one = |name: &str| match name {
        "array" if schema["prefixItems"].is_array() => {
            let items: Vec<String> = list(&schema["prefixItems"]).map(kind).collect();
            format!("[{}]", items.join(", "))
        }
        "array" => match schema["maxItems"].as_u64() {
            Some(n) if schema["minItems"] == n => format!("{n} × {}", of_items()),
            _ => format!("list of {}", of_items()),
        },
        name => escape(name),
    };
    match &schema["type"] {
        Value::String(name) => one(name),
        Value::Array(names) => {
            let names: Vec<String> = names.iter().filter_map(Value::as_str).map(one).collect();
            names.join(" or ")
        }
        _ => "anything".into(),
    }
}

/// Words out of the document, `code` shown as such, links of our own documentation as their names.
fn text(value: &Value) -> String {
    let plain = escape(value.as_str().unwrap_or_default())
        .replace("[`", "`")
        .replace("`]", "`");
    let mut out = String::with_capacity(plain.len());
    for (i, part) in plain.split('`').enumerate() {
        if i % 2 == 1 {
            let _ = write!(out, "<code>{part}</code>");
        } else {
            out.push_str(part);
        }
    }
    out
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

fn entries(value: &Value) -> impl Iterator<Item = (&str, &Value)> {
    value
        .as_object()
        .into_iter()
        .flat_map(Map::iter)
        .map(|(key, value)| (key.as_str(), value))
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}
