//! A body of one's own, and changes of the scene undone: over HTTP, as a program does.

use std::fmt::Write as _;

use palpa_mesh::{Surface, generate, write_surface};

use super::*;

impl Viewer {
    /// Uploads a file: status, and the answer or the words of the refusal.
    fn upload(&self, name: &str, bytes: &[u8]) -> (u16, Value) {
        let mut answer = self
            .agent
            .post(format!("{}api/upload?name={name}", self.url))
            .header("Content-Type", "application/octet-stream")
            .send(bytes)
            .unwrap();
        let body = answer.body_mut().read_to_string().unwrap();
        let value = serde_json::from_str(&body).unwrap_or_else(|_| json!(body));
        (answer.status().as_u16(), value)
    }

    /// Uploads a surface in the format of its name.
    fn upload_surface(&self, name: &str, surface: &Surface) -> Value {
        let path = self.bench.path(name);
        write_surface(&path, surface).unwrap();
        let (status, uploaded) = self.upload(name, &fs::read(path).unwrap());
        assert_eq!(status, 200, "{uploaded}");
        uploaded
    }

    /// Asks for another scene, and waits until its body is there.
    fn load(&self, request: &Value) -> Value {
        let before = self.json("api/state")["origin"].clone();
        self.ask(request);
        self.wait_until(|state| state["phase"] == "running" && state["origin"] != before)
    }

    /// Waits for the Young's modulus of the first layer, Pa.
    fn wait_for_young(&self, young: f64) -> Value {
        self.wait_until(|state| {
            let now = state["layers"][0]["stiffness"].as_f64().unwrap_or(0.0);
            state["phase"] == "running" && (now - young).abs() < 1e-3 * young
        })
    }

    fn edit_young(&self, text: &str) {
        let edits = json!([{ "path": "/layer/0/tissue/young", "value": text }]);
        self.ask(&json!({ "type": "edit", "edits": edits }));
    }

    fn temporary_folders(&self) -> usize {
        fs::read_dir(self.bench.path("tmp")).unwrap().count()
    }
}

/// A limb of 20 cm and its bone, m.
fn limb() -> (Surface, Surface) {
    generate::cylinder(0.2, 0.04, 0.01, 0.012)
}

#[test]
fn a_surface_grows_down_to_its_bone_is_pressed_saved_and_leaves_nothing_behind() {
    let viewer = Viewer::start(&[]);
    let (skin, bone) = limb();
    let skin = viewer.upload_surface("skin.stl", &skin.scaled(1e3));
    assert_eq!(skin["content"]["unit"], "mm");
    assert_eq!(skin["content"]["verdict"], "good");
    let bone = viewer.upload_surface("bone.ply", &bone.scaled(1e3));
    // Nothing has changed yet.
    assert_eq!(viewer.json("api/state")["origin"], 1);
    let (status, mesh) = viewer.get(&format!("api/upload/mesh?id={}", skin["id"]));
    assert!(status == 200 && mesh.len() > 1000);
    let grow = json!({ "type": "grow", "skin": skin["id"], "bones": [bone["id"]], "unit": "mm", "template": "limb" });
    let state = viewer.load(&grow);
    assert_eq!(state["files"], json!(["bone.ply", "skin.stl"]));
    assert_eq!(state["layers"].as_array().unwrap().len(), 3);
    assert_eq!(state["is_changed"], false);
    viewer.press(3e-3);

    let (status, zip) = viewer.get("api/scene.zip");
    assert!(status == 200 && zip.starts_with(b"PK"));
    let (status, uploaded) = viewer.upload("scene.zip", &zip);
    assert_eq!(status, 200, "{uploaded}");
    assert_eq!(uploaded["content"]["files"], state["files"]);
    let again = viewer.load(&json!({ "type": "load_uploaded", "file": uploaded["id"] }));
    assert_eq!(again["n_nodes"], state["n_nodes"]);
    // Back to the body before, whose files are still there.
    viewer.ask(&json!({ "type": "undo" }));
    viewer.wait_until(|s| s["phase"] == "running" && s["origin"] == state["origin"]);

    assert!(cfg!(not(unix)) || viewer.temporary_folders() >= 3);
    #[cfg(unix)]
    {
        let tmp = viewer.bench.path("tmp");
        // The bench is removed with the viewer, so look before.
        palpa_testkit::interrupt(&viewer.process);
        wait_for("the temporary folders are removed", || {
            (fs::read_dir(&tmp).unwrap().count() == 0).then_some(())
        });
        viewer.stop();
    }
}

#[test]
fn what_cannot_be_grown_is_refused_with_place_and_reason_and_the_body_stays() {
    let viewer = Viewer::start(&[]);
    let (status, why) = viewer.upload("skin.obj", b"v 0 0 0\nf 1 2 3\n");
    let why = why.as_str().unwrap();
    assert!(
        status == 422 && why.contains("skin.obj") && why.contains("line 2"),
        "{why}"
    );
    // A Möbius strip has no inside.
    let n = 24;
    let mut text = String::new();
    for i in 0..n {
        let u = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        for side in [-0.02, 0.02] {
            let r = 0.1 + side * (u / 2.0).cos();
            let [x, y, z] = [r * u.cos(), r * u.sin(), side * (u / 2.0).sin()];
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
    }
    for i in 0..n {
        let [a, b] = [2 * i + 1, 2 * i + 2];
        let [c, d] = if i + 1 < n { [a + 2, b + 2] } else { [2, 1] };
        writeln!(text, "f {a} {b} {c}\nf {b} {d} {c}").unwrap();
    }
    let (status, strip) = viewer.upload("strip.obj", text.as_bytes());
    assert_eq!(status, 200, "{strip}");
    assert_eq!(strip["content"]["verdict"], "bad");
    let grow = json!({ "type": "grow", "skin": strip["id"], "unit": "m", "template": "thin" });
    viewer.ask(&grow);
    let state = viewer.wait_until(|s| s["phase"] == "running" && s["problem"]["kind"] == "refused");
    let why = state["problem"]["text"].as_str().unwrap();
    assert!(why.contains("skin") && !why.contains("tmp"), "{why}");
    assert_eq!((&state["origin"], &state["n_undo"]), (&json!(1), &json!(0)));
    // Refused at once.
    for (request, words) in [
        (
            json!({ "type": "grow", "skin": 99, "unit": "m", "template": "limb" }),
            "send it again",
        ),
        (
            json!({ "type": "load_uploaded", "file": strip["id"] }),
            "no scene",
        ),
        (
            json!({ "type": "load_text", "text": "[body]\nsurface = \"other.obj\"\n[[layer]]\ntissue = \"fat\"\nthickness = \"5 mm\"\n[press]\ndepth = \"1 mm\"\n", "files": [strip["id"]] }),
            "other.obj",
        ),
        (json!({ "type": "cancel_build" }), "no body is being built"),
    ] {
        let (code, found) = viewer.post(&request.to_string());
        assert!(
            code == 409 && found.contains(words),
            "{request}: {code} {found}"
        );
    }
    viewer.press(2e-3);
}

#[test]
fn changes_are_undone_and_redone_but_not_while_they_are_recorded() {
    let viewer = Viewer::start(&[]);
    let (code, why) = viewer.post(r#"{"type":"undo"}"#);
    assert!(code == 409 && why.contains("nothing to undo"), "{why}");
    viewer.edit_young("20 kPa");
    let state = viewer.wait_for_young(20e3);
    assert_eq!(
        (&state["is_changed"], &state["n_undo"]),
        (&json!(true), &json!(1))
    );
    let block = json!({ "type": "load_scene", "key": "block" });
    let state = viewer.load(&block);
    assert_eq!(
        (&state["is_changed"], &state["n_undo"]),
        (&json!(false), &json!(2))
    );
    viewer.ask(&json!({ "type": "undo" }));
    let state = viewer.wait_for_young(20e3);
    assert_eq!((&state["origin"], &state["n_redo"]), (&json!(1), &json!(1)));
    viewer.ask(&json!({ "type": "undo" }));
    assert_eq!(viewer.wait_for_young(10e3)["is_changed"], false);
    viewer.ask(&json!({ "type": "redo" }));
    viewer.wait_for_young(20e3);
    viewer.ask(&json!({ "type": "reset_scene" }));
    let state = viewer.wait_for_young(10e3);
    assert_eq!(
        (&state["is_changed"], &state["n_redo"]),
        (&json!(false), &json!(0))
    );
    let (code, why) = viewer.post(r#"{"type":"reset_scene"}"#);
    assert!(code == 409 && why.contains("as it was loaded"), "{why}");

    viewer.ask(&json!({ "type": "start_recording" }));
    for request in ["undo", "redo", "reset_scene"] {
        let (code, why) = viewer.post(&json!({ "type": request }).to_string());
        assert!(code == 409, "{why}");
    }
    let (_, why) = viewer.post(r#"{"type":"undo"}"#);
    assert!(why.contains("stop the recording first"), "{why}");
    viewer.ask(&json!({ "type": "stop_recording" }));
    viewer.ask(&json!({ "type": "undo" }));
    viewer.wait_for_young(20e3);
}

#[test]
fn a_scene_that_a_page_remembers_comes_back_and_names_no_files_of_the_machine() {
    let viewer = Viewer::start(&[]);
    viewer.edit_young("30 kPa");
    let mut scene = viewer.wait_for_young(30e3)["scene"].clone();
    viewer.load(&json!({ "type": "load_scene", "key": "block" }));
    viewer.load(&json!({ "type": "load_table", "scene": scene }));
    viewer.wait_for_young(30e3);
    // As a changed version of a scene of the gallery.
    let block = viewer.load(&json!({ "type": "load_scene", "key": "block" }))["scene"].clone();
    let mut changed = block.clone();
    changed["layer"][0]["tissue"]["young"] = json!("77 kPa");
    let state = viewer.load(&json!({ "type": "load_table", "scene": changed, "key": "block" }));
    assert_eq!(
        (&state["gallery_key"], &state["is_changed"]),
        (&json!("block"), &json!(true))
    );
    viewer.ask(&json!({ "type": "reset_scene" }));
    let state = viewer.wait_until(|s| s["phase"] == "running" && s["is_changed"] == false);
    assert_eq!(state["scene"], block);

    scene["body"] = json!({ "surface": "/etc/passwd" });
    scene["layer"][0]["thickness"] = json!("10 mm");
    let (code, why) = viewer.post(&json!({ "type": "load_table", "scene": scene }).to_string());
    assert!(
        code == 409 && why.contains("needs its file passwd"),
        "{why}"
    );
    for nonsense in [json!(null), json!([1]), json!({ "layer": 3 }), json!("x")] {
        let (code, _) =
            viewer.post(&json!({ "type": "load_table", "scene": nonsense }).to_string());
        assert_eq!(code, 409, "{nonsense}");
    }
}
