//! The web page's files, embedded in the binary.

use axum::{
    body::Bytes,
    http::{HeaderMap, StatusCode, Uri, header},
    response::{Html, IntoResponse, Response},
};
use rust_embed::RustEmbed;
use std::{borrow::Cow, fmt::Write as _};

/// The output of Vite from `web/`. It may be missing if this library is built alone.
#[derive(RustEmbed)]
#[folder = "../../web/dist"]
#[allow_missing = true]
struct Dist;

const MISSING: &str = "<!doctype html>
<html lang=en>
<meta charset=utf-8>
<title>Palpa: built without its page</title>
<style>:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif } body { max-width: 40rem; margin: 4rem auto; padding: 0 1rem }</style>
<h1>This binary was built without its page</h1>
<p>The engine runs, and <a href=/api>its control API</a> answers; only the page that shows the body is missing. To have it, with
<a href=https://nodejs.org>Node</a> 20 or later:</p>
<pre>make run</pre>
<p>or</p>
<pre>cd web
npm ci
npm run build
cd ..
cargo build --release</pre>
";

/// Serves one file of the page.
pub(crate) async fn file(uri: Uri, headers: HeaderMap) -> Response {
    serve(uri.path().trim_start_matches('/'), &headers)
}

fn serve(path: &str, headers: &HeaderMap) -> Response {
    let path = if path.is_empty() { "index.html" } else { path };
    // Names that start with a dot are not part of the page: they keep the empty folder in the
    // repository.
    let found = (!path.starts_with('.')).then(|| Dist::get(path)).flatten();
    let Some(found) = found else {
        return if path == "index.html" {
            let fresh = [(header::CACHE_CONTROL, "no-cache")];
            (fresh, Html(MISSING)).into_response()
        } else {
            (StatusCode::NOT_FOUND, "there is no such page\n").into_response()
        };
    };
    let tag = tag(&found.metadata.sha256_hash()[..16]);
    // Vite puts a hash of the content into the name of each file in `assets`, so these never
    // change.
    let keep = if path.starts_with("assets/") {
        "public, max-age=31536000, immutable"
    } else {
        "no-cache"
    };
    let is_known = headers
        .get(header::IF_NONE_MATCH)
        .and_then(|v| v.to_str().ok())
        .is_some_and(|known| known.split(',').any(|k| k.trim() == tag));
    let caching = [
        (header::CACHE_CONTROL, keep.to_owned()),
        (header::ETAG, tag),
    ];
    if is_known {
        return (StatusCode::NOT_MODIFIED, caching).into_response();
    }
    let bytes = match found.data {
        Cow::Borrowed(bytes) => Bytes::from_static(bytes),
        Cow::Owned(bytes) => bytes.into(),
    };
    let kind = [(header::CONTENT_TYPE, kind(path))];
    (caching, kind, bytes).into_response()
}

fn tag(hash: &[u8]) -> String {
    let mut tag = String::from("\"");
    for byte in hash {
        let _ = write!(tag, "{byte:02x}");
    }
    tag + "\""
}

fn kind(path: &str) -> &'static str {
    match path.rsplit_once('.').map_or("", |(_, ending)| ending) {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" | "map" => "application/json",
        "webmanifest" => "application/manifest+json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        "woff" => "font/woff",
        "wasm" => "application/wasm",
        "glb" => "model/gltf-binary",
        "txt" => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}
