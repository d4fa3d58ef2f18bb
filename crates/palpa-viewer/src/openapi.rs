//! The control API's document (OpenAPI 3.1), generated from the types.

use crate::control::{
    EngineFigures, Envelope, Message, RecordingCurve, Reply, Spectrum, State, Uploaded,
};
use schemars::Schema;
use schemars::SchemaGenerator;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use serde_json::{Value, json};

/// The `OpenAPI` document, with all types of [`crate::control`].
pub fn document() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| {
        s.definitions_path = "/components/schemas".into();
        s.meta_schema = None;
        s.transforms.push(Box::new(RecursiveTransform(apart)));
    });
    let mut generator = settings.into_generator();
    let paths: serde_json::Map<String, Value> = [
        requests(&mut generator),
        uploads(&mut generator),
        files(&mut generator),
        connections(),
    ]
    .into_iter()
    .flat_map(|group| match group {
        Value::Object(paths) => paths,
        _ => serde_json::Map::new(),
    })
    .collect();
    generator.subschema_for::<Message>();
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "Palpa viewer",
            "version": env!("CARGO_PKG_VERSION"),
            "license": { "name": "MIT OR Apache-2.0", "identifier": "MIT OR Apache-2.0" },
            "description": "Requests and answers of `palpa view`, for pages and programs. If the server was started with a token, every \
                request must carry it: as `Authorization: Bearer …`, or as `?token=…` for downloads and the WebSocket. \
                Without it the answer is 401.",
        },
        "components": {
            "schemas": generator.take_definitions(true),
            "securitySchemes": { "token": { "type": "http", "scheme": "bearer" } },
        },
        "security": [{}, { "token": [] }],
        "paths": paths,
    })
}

/// Requests, and what the engine says of itself.
fn requests(generator: &mut SchemaGenerator) -> Value {
    let state = body(
        generator,
        "Everything that pages show, except the moving body.",
        SchemaGenerator::subschema_for::<State>,
    );
    let engine = body(
        generator,
        "Figures of the engine.",
        SchemaGenerator::subschema_for::<EngineFigures>,
    );
    let reply = body(
        generator,
        "The answer. A refusal has status 409.",
        SchemaGenerator::subschema_for::<Reply>,
    );
    let envelope = generator.subschema_for::<Envelope>();
    json!({
        "/api/control": { "post": {
            "summary": "Send a request",
            "description": "The same requests as over the WebSocket. They are refused while a page is in control, unless the request is \
                `take_control`. Pages then watch until one of them takes control. Limits: 1 MiB a request, 200 requests a second.",
            "requestBody": { "required": true, "content": { "application/json": { "schema": envelope } } },
            "responses": {
                "200": reply.clone(),
                "400": { "description": "The request cannot be parsed. The reply says where." },
                "409": reply,
                "413": { "description": "The request is longer than 1 MiB." },
                "415": { "description": "The content type is not application/json." },
                "429": { "description": "Too many requests." },
                "504": { "description": "The engine gave no answer within 30 s." },
            },
        } },
        "/api/state": { "get": { "summary": "The state", "responses": { "200": state, "503": { "description": "The engine is starting." } } } },
        "/api/engine": { "get": { "summary": "The engine's figures", "responses": { "200": engine, "503": { "description": "The engine is starting." } } } },
    })
}

/// Files of the user's.
fn uploads(generator: &mut SchemaGenerator) -> Value {
    let uploaded = body(
        generator,
        "The file, its number and, of a surface, the findings of its check.",
        SchemaGenerator::subschema_for::<Uploaded>,
    );
    json!({
        "/api/upload": { "post": {
            "summary": "Upload a user's file",
            "description": "A surface (STL, PLY, OBJ, OFF, GLB), a ZIP of a scene with its files, or a table of thicknesses (CSV). Nothing \
                changes until a request names the file: `grow`, `load_uploaded`, `load_text` or `load_table`. The same rules as for \
                `/api/control` say who may upload. Files are kept in a temporary folder of the program, which removes it when it ends. \
                At most 64 MiB and 500,000 triangles.",
            "parameters": [
                { "name": "name", "in": "query", "required": true, "schema": { "type": "string" }, "description": "Name of the file; its ending helps where the content leaves the format open." },
                { "name": "client", "in": "query", "schema": { "type": "integer" }, "description": "Number of the connection of the page that sends it." },
            ],
            "requestBody": { "required": true, "content": { "application/octet-stream": {} } },
            "responses": {
                "200": uploaded.clone(),
                "400": { "description": "The query cannot be parsed, or the name is empty or too long." },
                "409": { "description": "The client is not in control." },
                "408": { "description": "The file was not there within 2 minutes." },
                "413": { "description": "The file is too large." },
                "415": { "description": "The content type is not application/octet-stream." },
                "422": { "description": "The file cannot be used. The text says why, where, and what to do." },
                "503": { "description": "Another file is being checked." },
            },
        } },
        "/api/upload/check": { "get": {
            "summary": "Check an uploaded surface in another unit",
            "parameters": [
                { "name": "id", "in": "query", "required": true, "schema": { "type": "integer" } },
                { "name": "unit", "in": "query", "required": true, "schema": { "enum": ["m", "cm", "mm", "in"] } },
            ],
            "responses": { "200": uploaded, "400": { "description": "The query cannot be parsed." }, "404": { "description": "There is no such surface." }, "503": { "description": "Another file is being checked." } },
        } },
        "/api/upload/mesh": { "get": {
            "summary": "An uploaded surface as a mesh snapshot of one level",
            "parameters": [{ "name": "id", "in": "query", "required": true, "schema": { "type": "integer" } }],
            "responses": { "200": { "description": "`crates/palpa-viewer/src/wire.rs` defines the layout.", "content": { "application/octet-stream": {} } }, "400": { "description": "The query cannot be parsed." }, "404": { "description": "There is no such surface." } },
        } },
    })
}

/// Files and tables to take away.
fn files(generator: &mut SchemaGenerator) -> Value {
    let curve = body(
        generator,
        "The course of the recording.",
        SchemaGenerator::subschema_for::<RecordingCurve>,
    );
    let spectrum = body(
        generator,
        "Amplitudes of the force over about the last second.",
        SchemaGenerator::subschema_for::<Spectrum>,
    );
    let file = |summary: &str, kind: &str, description: &str| {
        json!({ "get": { "summary": summary, "responses": {
            "200": { "description": description, "content": { kind: {} } },
            "404": { "description": "There is no such file yet." },
            "500": { "description": "The file cannot be made. The text says why." },
            "503": { "description": "Too many files are being made." } } } })
    };
    json!({
        "/api/scene.zip": file("The scene with its files", "application/zip", "The scene file and the files that it refers to. Unpacked, `palpa view scene.toml` shows it."),
        "/api/scene.toml": file("The scene file", "application/toml", "The scene with all defaults written out."),
        "/api/body.vtu": file("The deformed body", "application/xml", "For ParaView and other readers of VTK files."),
        "/api/map.vtu": file("The palpation map", "application/xml", "The skin at rest with the stiffness that was felt, for ParaView and other readers of VTK files."),
        "/api/game.csv": file("The results of the last game", "text/csv", "One row for each lump of each round that was revealed."),
        "/api/map.csv": file("The places of the palpation map", "text/csv", "One row for each place that was felt."),
        "/api/recording.mcap": file("The recording", "application/octet-stream", "A log for `palpa replay`."),
        "/api/recording.csv": file("The ticks of the recording", "text/csv", "One row for each tick of the 1 kHz loop."),
        "/api/recording/curve": { "get": { "summary": "The course of the recording, in a bounded number of points", "responses": {
            "200": curve, "404": { "description": "There is no recording yet." },
            "500": { "description": "The log cannot be read. The text says why." },
            "503": { "description": "Too many files are being made." } } } },
        "/api/spectrum": { "get": { "summary": "The spectrum of the force", "responses": {
            "200": spectrum, "404": { "description": "The engine has not run for a second yet." },
            "503": { "description": "Too many files are being made." } } } },
    })
}

fn connections() -> Value {
    json!({
        "/ws": { "get": {
            "summary": "The WebSocket",
            "description": "Text messages are `Message` from the server and `Envelope` from the client. Binary messages are snapshots; \
                `crates/palpa-viewer/src/wire.rs` defines their layout. The first client to connect is in control, the others watch \
                until they take control. A slow client misses frames. The server closes a connection, with the reason, if the client \
                reads nothing for 10 s, is silent for 14 s (pings go out every 4 s), sends more than 200 requests a second (400 at \
                once), or sends 20 requests in a row that cannot be parsed.",
            "parameters": [{ "name": "token", "in": "query", "schema": { "type": "string" } }],
            "responses": {
                "101": { "description": "A WebSocket." },
                "403": { "description": "The request comes from a page of another origin." },
                "503": { "description": "32 clients are connected, which is the limit." },
            },
        } },
        "/healthz": { "get": { "summary": "Health check", "responses": { "200": { "description": "The engine runs." }, "503": { "description": "The engine has stopped. The text says why." } } } },
        "/metrics": { "get": { "summary": "Figures for Prometheus", "responses": { "200": { "description": "Text format 0.0.4." } } } },
    })
}

fn body(
    generator: &mut SchemaGenerator,
    description: &str,
    schema: impl FnOnce(&mut SchemaGenerator) -> Schema,
) -> Value {
    let schema = schema(generator);
    json!({ "description": description, "content": { "application/json": { "schema": schema } } })
}

/// Moves the keys beside a reference into an `allOf`: `OpenAPI` tools ignore keys beside a
/// reference.
fn apart(schema: &mut Schema) {
    let Some(object) = schema.as_object_mut() else {
        return;
    };
    if !(object.contains_key("$ref") && object.contains_key("properties")) {
        return;
    }
    let rest: Vec<&str> = ["type", "properties", "required"].into();
    let beside: serde_json::Map<String, Value> = rest
        .iter()
        .filter_map(|&key| object.remove(key).map(|value| (key.to_owned(), value)))
        .collect();
    if let Some(reference) = object.remove("$ref") {
        object.insert("allOf".into(), json!([{ "$ref": reference }, beside]));
    }
}
