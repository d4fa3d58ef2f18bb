//! Access control: pages of this server and programs on this machine are let in. With a token,
//! every client that knows it is.
//!
//! A browser lets any web page open a WebSocket to 127.0.0.1, but names the page's site in
//! `Origin`, so pages of other sites are refused. A foreign name that resolves to 127.0.0.1 (DNS
//! rebinding) shows in `Host`.

use crate::hub::Hub;
use axum::{
    extract::{Query, Request, State},
    http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, Uri, header},
    middleware::Next,
    response::{IntoResponse, Response},
};
use serde::Deserialize;
use std::{net::IpAddr, sync::Arc};
use subtle::ConstantTimeEq;

/// Scripts, styles and connections only from this server; inline styles are allowed.
const CONTENT_SECURITY_POLICY: &str = "default-src 'self'; connect-src 'self' ws: wss:; \
    img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; worker-src 'self' blob:; object-src 'none'; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Requirements on a request.
#[derive(Debug)]
pub(crate) struct Guard {
    /// Whether the server listens on loopback only. Then `Host` must name this machine.
    pub(crate) is_loopback: bool,
    /// The token that a request must carry.
    pub(crate) token: Option<String>,
}

/// Middleware for every route: checks the request's origin, and restricts what a browser may do
/// with the answer.
pub(crate) async fn origin(State(hub): State<Arc<Hub>>, request: Request, next: Next) -> Response {
    let mut response = match hub.guard.check_origin(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(why) => (StatusCode::FORBIDDEN, why).into_response(),
    };
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (
            HeaderName::from_static("cross-origin-opener-policy"),
            "same-origin",
        ),
        (
            HeaderName::from_static("cross-origin-resource-policy"),
            "same-origin",
        ),
    ] {
        let value = HeaderValue::from_static(value);
        response.headers_mut().insert(name, value);
    }
    response
}

/// Middleware for the routes that show or change the session: checks the token.
pub(crate) async fn token(State(hub): State<Arc<Hub>>, request: Request, next: Next) -> Response {
    if hub
        .guard
        .has_token(request.method(), request.uri(), request.headers())
    {
        let mut response = next.run(request).await;
        response
            .headers_mut()
            .entry(header::CACHE_CONTROL)
            .or_insert(HeaderValue::from_static("no-store"));
        return response;
    }
    let why = "the token is missing or another one; the program that was started with --token prints the address with it. \
               Give it as `Authorization: Bearer …`; to read, and for the WebSocket, ?token=… does too\n";
    let challenge = [(header::WWW_AUTHENTICATE, "Bearer")];
    (StatusCode::UNAUTHORIZED, challenge, why).into_response()
}

impl Guard {
    fn check_origin(&self, headers: &HeaderMap) -> Result<(), String> {
        let host = only(headers, &header::HOST)?.ok_or("a request without a Host header\n")?;
        if self.is_loopback && !is_this_machine(host) {
            return Err(format!(
                "the Host header {host:?} does not name this machine; open the address that the program printed \
                 (127.0.0.1 or localhost)\n"
            ));
        }
        match only(headers, &header::ORIGIN)? {
            Some(origin) if !is_same_place(origin, host) => Err(format!(
                "the request comes from a page of {origin:?}, not from this server's own ({host:?}); open the address that the program printed\n"
            )),
            _ => Ok(()),
        }
    }

    fn has_token(&self, method: &Method, uri: &Uri, headers: &HeaderMap) -> bool {
        #[derive(Deserialize)]
        struct Asked {
            token: Option<String>,
        }
        let Some(token) = &self.token else {
            return true;
        };
        let is_it = |given: &[u8]| bool::from(given.ct_eq(token.as_bytes()));
        let in_header = headers
            .get(header::AUTHORIZATION)
            .and_then(|value| value.as_bytes().split_at_checked("Bearer ".len()))
            .is_some_and(|(scheme, given)| {
                scheme.eq_ignore_ascii_case(b"Bearer ") && is_it(given.trim_ascii())
            });
        // A browser cannot send a header with a WebSocket or a download. A request that changes
        // something always can.
        let in_query = || {
            [Method::GET, Method::HEAD].contains(method)
                && Query::<Asked>::try_from_uri(uri)
                    .is_ok_and(|asked| asked.0.token.is_some_and(|given| is_it(given.as_bytes())))
        };
        in_header || in_query()
    }
}

/// The single value of a header; an error if the header is given twice.
fn only<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Result<Option<&'a str>, String> {
    let mut values = headers.get_all(name).iter();
    let Some(value) = values.next() else {
        return Ok(None);
    };
    match (value.to_str(), values.next()) {
        (Ok(value), None) => Ok(Some(value)),
        _ => Err(format!("{name} is given twice or is no text\n")),
    }
}

/// Whether a Host header names this machine's loopback. Any port is allowed: tunnels and proxies
/// change it.
fn is_this_machine(host: &str) -> bool {
    let name = without_port(host);
    let name = name
        .strip_prefix('[')
        .and_then(|n| n.strip_suffix(']'))
        .unwrap_or(name);
    name.eq_ignore_ascii_case("localhost") || name.parse().is_ok_and(|ip: IpAddr| ip.is_loopback())
}

fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) && !name.is_empty() => {
            // "::1" without brackets has no port.
            if name.contains(':') && !name.ends_with(']') {
                host
            } else {
                name
            }
        }
        _ => host,
    }
}

/// Whether an origin (`http://127.0.0.1:7750`) is a page of this host (`127.0.0.1:7750`).
fn is_same_place(origin: &str, host: &str) -> bool {
    let (rest, usual_port) = if let Some(rest) = origin.strip_prefix("http://") {
        (rest, ":80")
    } else if let Some(rest) = origin.strip_prefix("https://") {
        (rest, ":443")
    } else {
        return false;
    };
    let bare = |place: &str| {
        let place = place.to_ascii_lowercase();
        place
            .strip_suffix(usual_port)
            .map_or(place.clone(), str::to_owned)
    };
    bare(rest) == bare(host)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_this_machine() {
        for host in [
            "localhost",
            "LOCALHOST:1",
            "127.0.0.1:7750",
            "127.8.9.10",
            "[::1]:7750",
            "[::1]",
        ] {
            assert!(is_this_machine(host), "{host}");
        }
        for host in [
            "",
            "evil.example",
            "localhost.evil.example",
            "127.0.0.1.evil.example:7750",
            "10.0.0.1",
            "[::2]:80",
            "::1:x",
            "127.0.0.1@evil.example",
            "localhost:7750:1",
        ] {
            assert!(!is_this_machine(host), "{host}");
        }
    }

    #[test]
    fn pages_of_this_server() {
        for (origin, host) in [
            ("http://127.0.0.1:7750", "127.0.0.1:7750"),
            ("http://localhost", "localhost:80"),
            ("https://Palpa.Lab", "palpa.lab:443"),
            ("http://[::1]:9", "[::1]:9"),
        ] {
            assert!(is_same_place(origin, host), "{origin} {host}");
        }
        for (origin, host) in [
            ("null", "localhost"),
            ("http://127.0.0.1:7751", "127.0.0.1:7750"),
            ("http://evil.example", "127.0.0.1:7750"),
            ("http://127.0.0.1:7750.evil.example", "127.0.0.1:7750"),
            ("file://", ""),
            ("ftp://localhost", "localhost"),
        ] {
            assert!(!is_same_place(origin, host), "{origin} {host}");
        }
    }
}
