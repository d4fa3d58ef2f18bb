//! The HTTP routes.

use crate::{
    api_page,
    board::Controller,
    client,
    control::Reply,
    guard,
    host::HostFile,
    hub::Hub,
    limits::{ANSWER_WAIT, MAX_CLIENTS, MAX_MESSAGE, Verdict},
    metrics, openapi, page, upload,
};
use axum::{
    Json, Router,
    body::Bytes,
    extract::{
        DefaultBodyLimit, State, WebSocketUpgrade, rejection::BytesRejection,
        ws::rejection::WebSocketUpgradeRejection,
    },
    http::{HeaderMap, StatusCode, Uri, header},
    middleware::from_fn_with_state,
    response::{Html, IntoResponse, Response},
    routing::{get, post},
};
use std::{
    sync::{Arc, PoisonError},
    time::Instant,
};
use tokio::{sync::oneshot, task::spawn_blocking, time::timeout};

/// All routes.
pub(crate) fn router(hub: &Arc<Hub>) -> Router {
    let with_token = Router::new()
        .route("/ws", get(socket))
        .route(
            "/api",
            get(|uri: Uri| async move { Html(api_page::html(&openapi::document(), uri.query())) }),
        )
        .route(
            "/api/openapi.json",
            get(|| async { Json(openapi::document()) }),
        )
        .route("/api/control", post(control))
        .route("/api/state", get(state))
        .route("/api/engine", get(engine))
        .route("/api/scene.toml", get(|hub| file(hub, HostFile::Scene)))
        .route("/api/body.vtu", get(|hub| file(hub, HostFile::Body)))
        .route("/api/map.vtu", get(|hub| file(hub, HostFile::Map)))
        .route("/api/map.csv", get(|hub| file(hub, HostFile::MapCsv)))
        .route("/api/game.csv", get(|hub| file(hub, HostFile::GameCsv)))
        .route(
            "/api/recording.mcap",
            get(|hub| file(hub, HostFile::RecordingLog)),
        )
        .route(
            "/api/recording.csv",
            get(|hub| file(hub, HostFile::RecordingCsv)),
        )
        .route(
            "/api/recording/curve",
            get(|hub| file(hub, HostFile::RecordingCurve)),
        )
        .route("/api/spectrum", get(|hub| file(hub, HostFile::Spectrum)))
        .route(
            "/api/scene.zip",
            get(|hub| file(hub, HostFile::SceneArchive)),
        )
        .route("/api/upload", post(upload::take))
        .route("/api/upload/check", get(upload::check))
        .route("/api/upload/mesh", get(upload::mesh))
        .route("/metrics", get(figures))
        .layer(DefaultBodyLimit::max(MAX_MESSAGE))
        .route_layer(from_fn_with_state(Arc::clone(hub), guard::token));
    Router::new()
        .route("/healthz", get(health))
        .fallback(get(page::file))
        .merge(with_token)
        .method_not_allowed_fallback(async || {
            (
                StatusCode::METHOD_NOT_ALLOWED,
                "this address does not accept the HTTP method; /api lists the methods\n",
            )
        })
        .layer(from_fn_with_state(Arc::clone(hub), guard::origin))
        .with_state(Arc::clone(hub))
}

type Shared = State<Arc<Hub>>;

async fn socket(
    State(hub): Shared,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade,
        Err(why) => {
            let why =
                format!("This endpoint is a WebSocket: {why}. See /api for the other endpoints.\n");
            return (
                StatusCode::UPGRADE_REQUIRED,
                [(header::UPGRADE, "websocket")],
                why,
            )
                .into_response();
        }
    };
    let Ok(place) = Arc::clone(&hub.places).try_acquire_owned() else {
        let why = format!("{MAX_CLIENTS} pages are connected, which is the most; close one\n");
        return (StatusCode::SERVICE_UNAVAILABLE, why).into_response();
    };
    upgrade
        .max_message_size(MAX_MESSAGE)
        .max_frame_size(MAX_MESSAGE)
        .on_upgrade(move |socket| client::serve(socket, hub, place))
}

/// A program's request. Refused with status 409 while a page is in control, unless it takes
/// control.
async fn control(
    State(hub): Shared,
    headers: HeaderMap,
    body: Result<Bytes, BytesRejection>,
) -> Response {
    let body = match body {
        Ok(body) => body,
        Err(why) if why.status() == StatusCode::PAYLOAD_TOO_LARGE => {
            return refuse(why.status(), None, "a request is longer than 1 MiB");
        }
        Err(why) => return refuse(why.status(), None, &why.body_text()),
    };
    let verdict = {
        let mut programs = hub.programs.lock().unwrap_or_else(PoisonError::into_inner);
        programs.ask(body.len(), Instant::now())
    };
    if verdict != Verdict::Taken {
        hub.board.counts.refused.add(1);
        let why = "too many requests; at most 200 a second";
        return refuse(StatusCode::TOO_MANY_REQUESTS, None, why);
    }
    // Protection against other sites: their forms cannot send this content type, and their scripts
    // would need CORS permission.
    let is_json = headers
        .get(header::CONTENT_TYPE)
        .and_then(|v| v.to_str().ok())
        .and_then(|v| v.split(';').next())
        .is_some_and(|v| v.trim().eq_ignore_ascii_case("application/json"));
    if !is_json {
        let why = "expected the header `Content-Type: application/json`";
        return refuse(StatusCode::UNSUPPORTED_MEDIA_TYPE, None, why);
    }
    let envelope = std::str::from_utf8(&body)
        .map_err(|why| Reply {
            id: None,
            error: Some(format!("not understood: {why}")),
        })
        .and_then(client::understand);
    let envelope = match envelope {
        Ok(envelope) => envelope,
        Err(reply) => {
            hub.board.counts.malformed.add(1);
            return (StatusCode::BAD_REQUEST, Json(reply)).into_response();
        }
    };
    let (answer, outcome) = oneshot::channel();
    let id = envelope.id;
    hub.ask(Controller::Program, envelope.request, move |outcome| {
        // The receiver may have timed out.
        let _ = answer.send(outcome);
    });
    match timeout(ANSWER_WAIT, outcome).await {
        Ok(Ok(Ok(()))) => Json(Reply { id, error: None }).into_response(),
        Ok(Ok(Err(why))) => refuse(StatusCode::CONFLICT, id, &why),
        Ok(Err(_)) | Err(_) => {
            let why = "the engine gave no answer within 30 s";
            refuse(StatusCode::GATEWAY_TIMEOUT, id, why)
        }
    }
}

fn refuse(status: StatusCode, id: Option<u32>, why: &str) -> Response {
    let error = Some(why.to_owned());
    (status, Json(Reply { id, error })).into_response()
}

async fn state(State(hub): Shared) -> Response {
    json(
        hub.board.state_alone(),
        "no state is known yet: the engine starts",
    )
}

async fn engine(State(hub): Shared) -> Response {
    let figures = hub
        .board
        .engine
        .borrow()
        .as_ref()
        .map(|(figures, _)| Arc::clone(figures));
    let text = figures.and_then(|figures| serde_json::to_string(&*figures).ok());
    json(text, "no figures are known yet: the engine starts")
}

fn json(text: Option<String>, missing: &'static str) -> Response {
    match text {
        Some(text) => ([(header::CONTENT_TYPE, "application/json")], text).into_response(),
        None => (StatusCode::SERVICE_UNAVAILABLE, format!("{missing}\n")).into_response(),
    }
}

async fn file(State(hub): Shared, file: HostFile) -> Response {
    let (kind, name) = match file {
        HostFile::Scene => ("application/toml", "scene.toml"),
        HostFile::SceneArchive => ("application/zip", "scene.zip"),
        HostFile::Body => ("application/xml", "body.vtu"),
        HostFile::Map => ("application/xml", "palpation-map.vtu"),
        HostFile::MapCsv => ("text/csv; charset=utf-8", "palpation-map.csv"),
        HostFile::GameCsv => ("text/csv; charset=utf-8", "find-the-lump.csv"),
        HostFile::RecordingLog => ("application/octet-stream", "palpa-recording.mcap"),
        HostFile::RecordingCsv => ("text/csv; charset=utf-8", "palpa-recording.csv"),
        HostFile::RecordingCurve => ("application/json", "curve of a recording"),
        HostFile::Spectrum => ("application/json", "spectrum"),
    };
    let Ok(permit) = Arc::clone(&hub.files).try_acquire_owned() else {
        let why = "other files are being made; ask again when they are there\n";
        return (StatusCode::SERVICE_UNAVAILABLE, why).into_response();
    };
    let host = Arc::clone(&hub.host);
    let made = spawn_blocking(move || {
        // Held until the file is made, even if the client has gone: the work goes on.
        let _permit = permit;
        host.file(file)
    })
    .await;
    match made {
        Ok(Ok(Some(bytes))) => {
            let mut response = ([(header::CONTENT_TYPE, kind)], bytes).into_response();
            let disposition = format!("attachment; filename=\"{name}\"");
            if kind != "application/json"
                && let Ok(disposition) = disposition.parse()
            {
                (response.headers_mut()).insert(header::CONTENT_DISPOSITION, disposition);
            }
            response
        }
        Ok(Ok(None)) => {
            (StatusCode::NOT_FOUND, format!("there is no {name} yet\n")).into_response()
        }
        Ok(Err(why)) => {
            let why = format!("{name} cannot be made: {why}\n");
            (StatusCode::INTERNAL_SERVER_ERROR, why).into_response()
        }
        Err(_) => {
            let why = format!("{name} cannot be made: the program failed\n");
            (StatusCode::INTERNAL_SERVER_ERROR, why).into_response()
        }
    }
}

async fn figures(State(hub): Shared) -> impl IntoResponse {
    let text = metrics::text(&hub.board, hub.host.problem().is_none());
    let kind = "text/plain; version=0.0.4; charset=utf-8";
    ([(header::CONTENT_TYPE, kind)], text)
}

async fn health(State(hub): Shared) -> Response {
    let fresh = [(header::CACHE_CONTROL, "no-store")];
    match hub.host.problem() {
        None => (fresh, "ok\n").into_response(),
        Some(why) => (StatusCode::SERVICE_UNAVAILABLE, fresh, why + "\n").into_response(),
    }
}
