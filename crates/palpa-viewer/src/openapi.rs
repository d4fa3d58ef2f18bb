//! The control API's document (OpenAPI 3.1), made from the types themselves.

use crate::control::{EngineFigures, Envelope, Message, Reply, State};
use schemars::Schema;
use schemars::SchemaGenerator;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use serde_json::{Value, json};

/// The document.
pub fn document() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| {
        s.definitions_path = "/components/schemas".into();
        s.meta_schema = None;
        s.transforms.push(Box::new(RecursiveTransform(apart)));
    });
    let mut generator = settings.into_generator();
    let state = body(
        &mut generator,
        "All that pages show beside the moving body.",
        SchemaGenerator::subschema_for::<State>,
    );
    let engine = body(
        &mut generator,
        "How the engine fares.",
        SchemaGenerator::subschema_for::<EngineFigures>,
    );
    let reply = body(
        &mut generator,
        "The answer; refusals come with 409.",
        SchemaGenerator::subschema_for::<Reply>,
    );
    let envelope = generator.subschema_for::<Envelope>();
    generator.subschema_for::<Message>();
    let file = |summary: &str, kind: &str, description: &str| {
        json!({ "get": { "summary": summary, "responses": {
            "200": { "description": description, "content": { kind: {} } },
            "404": { "description": "There is none yet." },
            "500": { "description": "It cannot be made; the text says why." },
            "503": { "description": "Too many files are being made." } } } })
    };
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "Palpa viewer",
            "version": env!("CARGO_PKG_VERSION"),
            "license": { "name": "MIT OR Apache-2.0", "identifier": "MIT OR Apache-2.0" },
            "description": "What a page, or a program in its place, asks of `palpa view` and is told. Where the server was started with \
                a token, every request carries it (401 without): `Authorization: Bearer …`, or `?token=…` for what is only read, as downloads and the WebSocket.",
        },
        "components": {
            "schemas": generator.take_definitions(true),
            "securitySchemes": { "token": { "type": "http", "scheme": "bearer" } },
        },
        "security": [{}, { "token": [] }],
        "paths": {
            "/api/control": { "post": {
                "summary": "Asks for something",
                "description": "As over the WebSocket, but on behalf of a program: refused while a page controls, unless the request is \
                    `take_control`; then pages watch until one of them takes control. At most 1 MiB, and 200 requests a second.",
                "requestBody": { "required": true, "content": { "application/json": { "schema": envelope } } },
                "responses": {
                    "200": reply.clone(),
                    "400": { "description": "It cannot be understood; the reply says where." },
                    "409": reply,
                    "413": { "description": "It is longer than 1 MiB." },
                    "415": { "description": "It is not called application/json." },
                    "429": { "description": "Too many requests." },
                    "504": { "description": "The engine gave no answer." },
                },
            } },
            "/api/state": { "get": { "summary": "The state", "responses": { "200": state, "503": { "description": "The engine starts." } } } },
            "/api/engine": { "get": { "summary": "The engine's figures", "responses": { "200": engine, "503": { "description": "The engine starts." } } } },
            "/api/scene.toml": file("The scene, as a scene file", "application/toml", "The scene with every default written out."),
            "/api/body.vtu": file("The body as it is pressed now", "application/xml", "For ParaView and other readers of VTK files."),
            "/api/recording.mcap": file("The recording", "application/octet-stream", "What `palpa replay` reads."),
            "/api/recording.csv": file("The recording's ticks", "text/csv", "A row per tick of the 1 kHz loop."),
            "/ws": { "get": {
                "summary": "The WebSocket",
                "description": "Text is a Message from the server and an Envelope from the page; bytes are snapshots, whose layout is in \
                    `crates/palpa-viewer/src/wire.rs`. The first who connects controls, the others watch until they take control. A client that \
                    is slow misses frames; one that reads nothing for 10 s, is silent for 14 s (pings go out every 4 s), asks more than 200 times a \
                    second (400 at once) or is not understood 20 times in a row is let go, with the reason.",
                "parameters": [{ "name": "token", "in": "query", "schema": { "type": "string" } }],
                "responses": {
                    "101": { "description": "A WebSocket." },
                    "403": { "description": "It is asked from a page of another place." },
                    "503": { "description": "32 are connected, which is the most." },
                },
            } },
            "/healthz": { "get": { "summary": "Whether it runs", "responses": { "200": { "description": "It runs." }, "503": { "description": "The engine stands; the text says why." } } } },
            "/metrics": { "get": { "summary": "Figures for Prometheus", "responses": { "200": { "description": "Text format 0.0.4." } } } },
        },
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

/// Puts a reference and what stands beside it side by side: tools of `OpenAPI` forget what stands beside a reference.
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
