//! The routes for a user's own files.
//!
//! A file is received whole and then read and checked on a thread of its own. Only the client in
//! control may send one; whoever passes the guard may take control, so the number by which a page
//! says who it is need not be secret.

use crate::{
    board::Controller,
    control::UPLOAD_LIMITS,
    hub::Hub,
    limits::{MAX_NAME, UPLOAD_WAIT},
};
use axum::{
    Json,
    body::{Body, to_bytes},
    extract::{Query, State, rejection::QueryRejection},
    http::{HeaderMap, StatusCode, header},
    response::{IntoResponse, Response},
};
use palpa_scene::LengthUnit;
use serde::Deserialize;
use std::sync::Arc;
use tokio::{
    sync::OwnedSemaphorePermit,
    task::{JoinError, spawn_blocking},
    time::timeout,
};

const BUSY: &str = "another file is being checked; send this one when that is done";
const GONE: &str = "there is no such surface any more; send its file again";

/// The query of an upload.
#[derive(Debug, Deserialize)]
pub(crate) struct Sent {
    name: String,
    client: Option<u64>,
}

/// Takes a file.
pub(crate) async fn take(
    State(hub): State<Arc<Hub>>,
    sent: Result<Query<Sent>, QueryRejection>,
    headers: HeaderMap,
    body: Body,
) -> Response {
    let sent = match sent {
        Ok(Query(sent)) => sent,
        Err(why) => return refuse(StatusCode::BAD_REQUEST, &why.body_text()),
    };
    let (name, bytes, permit) = match receive(&hub, sent, &headers, body).await {
        Ok(received) => received,
        Err(refusal) => {
            hub.board.counts.refused.add(1);
            return refusal;
        }
    };
    let host = Arc::clone(&hub.host);
    let taken = spawn_blocking(move || {
        // Held until the file is checked, even if the client has gone: the work goes on.
        let _permit = permit;
        host.upload(&name, bytes)
    });
    match taken.await {
        Ok(Ok(uploaded)) => Json(uploaded).into_response(),
        Ok(Err(why)) => refuse(StatusCode::UNPROCESSABLE_ENTITY, &why),
        Err(why) => failed(&why),
    }
}

/// The name and the bytes of a file, with the permit to check it.
async fn receive(
    hub: &Arc<Hub>,
    Sent { name, client }: Sent,
    headers: &HeaderMap,
    body: Body,
) -> Result<(String, Vec<u8>, OwnedSemaphorePermit), Response> {
    let who = client.map_or(Controller::Program, Controller::Page);
    hub.may_ask(who)
        .map_err(|why| refuse(StatusCode::CONFLICT, why))?;
    if name.is_empty() || name.len() > MAX_NAME {
        let why = format!(
            "a file name of {} bytes; give one of 1 to {MAX_NAME}",
            name.len()
        );
        return Err(refuse(StatusCode::BAD_REQUEST, &why));
    }
    let header_of = |name| {
        let value = headers.get(name);
        value.and_then(|value| value.to_str().ok())
    };
    // Forms of other sites cannot send this content type, and their scripts would need permission.
    if header_of(header::CONTENT_TYPE).is_none_or(|kind| kind != "application/octet-stream") {
        let why = "expected the header `Content-Type: application/octet-stream`";
        return Err(refuse(StatusCode::UNSUPPORTED_MEDIA_TYPE, why));
    }
    let most = UPLOAD_LIMITS.bytes;
    let announced = header_of(header::CONTENT_LENGTH).and_then(|length| length.parse::<u64>().ok());
    let too_large = || {
        let why = format!(
            "{name} is larger than {} MB, the most that can be uploaded; thin the mesh out, or cut the part of interest from it",
            most >> 20
        );
        refuse(StatusCode::PAYLOAD_TOO_LARGE, &why)
    };
    if announced.is_some_and(|length| length > most) {
        return Err(too_large());
    }
    let Ok(permit) = Arc::clone(&hub.uploads).try_acquire_owned() else {
        return Err(refuse(StatusCode::SERVICE_UNAVAILABLE, BUSY));
    };
    let bytes = match timeout(UPLOAD_WAIT, to_bytes(body, most as usize)).await {
        Err(_) => {
            let why = format!(
                "{name} was not there within {} s; try again over a faster connection",
                UPLOAD_WAIT.as_secs()
            );
            return Err(refuse(StatusCode::REQUEST_TIMEOUT, &why));
        }
        // The length was not announced, or the connection broke; then nobody reads this.
        Ok(Err(_)) => return Err(too_large()),
        Ok(Ok(bytes)) => bytes,
    };
    Ok((name, bytes.into(), permit))
}

/// The query of a check in another unit.
#[derive(Debug, Deserialize)]
pub(crate) struct Asked {
    id: u32,
    unit: LengthUnit,
}

/// Checks an uploaded surface in another unit.
pub(crate) async fn check(
    State(hub): State<Arc<Hub>>,
    asked: Result<Query<Asked>, QueryRejection>,
) -> Response {
    let Asked { id, unit } = match asked {
        Ok(Query(asked)) => asked,
        Err(why) => return refuse(StatusCode::BAD_REQUEST, &why.body_text()),
    };
    let Ok(permit) = Arc::clone(&hub.uploads).try_acquire_owned() else {
        return refuse(StatusCode::SERVICE_UNAVAILABLE, BUSY);
    };
    let host = Arc::clone(&hub.host);
    let checked = spawn_blocking(move || {
        let _permit = permit;
        host.check_uploaded(id, unit)
    });
    match checked.await {
        Ok(Some(uploaded)) => Json(uploaded).into_response(),
        Ok(None) => refuse(StatusCode::NOT_FOUND, GONE),
        Err(why) => failed(&why),
    }
}

/// The query of a mesh.
#[derive(Debug, Deserialize)]
pub(crate) struct Wanted {
    id: u32,
}

/// An uploaded surface for the picture.
pub(crate) async fn mesh(
    State(hub): State<Arc<Hub>>,
    wanted: Result<Query<Wanted>, QueryRejection>,
) -> Response {
    let id = match wanted {
        Ok(Query(Wanted { id })) => id,
        Err(why) => return refuse(StatusCode::BAD_REQUEST, &why.body_text()),
    };
    let host = Arc::clone(&hub.host);
    match spawn_blocking(move || host.uploaded_mesh(id)).await {
        Ok(Some(bytes)) => {
            ([(header::CONTENT_TYPE, "application/octet-stream")], bytes).into_response()
        }
        Ok(None) => refuse(StatusCode::NOT_FOUND, GONE),
        Err(why) => failed(&why),
    }
}

fn refuse(status: StatusCode, why: &str) -> Response {
    (status, format!("{why}\n")).into_response()
}

fn failed(why: &JoinError) -> Response {
    let why = format!("the file could not be checked because of a bug in Palpa: {why}");
    refuse(StatusCode::INTERNAL_SERVER_ERROR, &why)
}
