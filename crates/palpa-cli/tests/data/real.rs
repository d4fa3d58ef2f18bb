//! Real shapes, grown and pressed through the command: forearm, calf, thigh, upper arm, abdomen.
//!
//! Results stay in the build folder's `tmp/results`, where meshio and pyvista open them.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// A body of the data, and how it is pressed.
struct Case {
    name: &'static str,
    skin: &'static str,
    bones: &'static [&'static str],
    /// Thickness of the muscle; down to the bones without one.
    muscle: Option<&'static str>,
    at: Option<&'static str>,
    /// At least this many prisms, so that a part is not taken for the whole.
    n_prisms: u64,
    /// Largest share of the skin with thinned layers, as seen when the growth was looked at, and
    /// some.
    thinned_share: f64,
}

const FOREARM: Case = Case {
    name: "forearm_2k",
    skin: "forearm/forearm_skin_open_2k.ply",
    bones: &["forearm/ulna.ply", "forearm/radius.ply"],
    muscle: None,
    at: Some(r#"["130 mm", "0 mm", "40 mm"]"#),
    n_prisms: 20_000,
    thinned_share: 0.12,
};

const CALF: Case = Case {
    name: "calf_2k",
    skin: "calf_mri/calf_skin_open_2k.ply",
    bones: &["calf_mri/tibia.ply", "calf_mri/fibula.ply"],
    muscle: None,
    at: Some(r#"["400 mm", "395 mm", "135 mm"]"#),
    n_prisms: 17_000,
    thinned_share: 0.08,
};

const PART: Case = Case {
    name: "",
    skin: "",
    bones: &[],
    muscle: Some(r#"thickness = "15 mm""#),
    at: None,
    n_prisms: 18_000,
    thinned_share: 0.03,
};

impl Case {
    fn scene(&self, data: &Path) -> String {
        let path = |file: &str| format!("{:?}", data.join(file).display().to_string());
        let bones: Vec<String> = self.bones.iter().map(|b| path(b)).collect();
        format!(
            r#"
            [body]
            surface = {}
            bones = [{}]
            [[layer]]
            tissue = "skin"
            thickness = "1.5 mm"
            [[layer]]
            tissue = "fat"
            thickness = "4 mm"
            [[layer]]
            tissue = "muscle"
            {}
            levels = 4
            [tool]
            shape = "disc"
            radius = "8 mm"
            [press]
            {}
            depth = "2 mm"
            step = "1 mm"
            hold = "0 s"
            retract = false
            "#,
            path(self.skin),
            bones.join(", "),
            self.muscle.unwrap_or_default(),
            self.at.map(|at| format!("at = {at}")).unwrap_or_default(),
        )
    }

    /// Presses, checks what every case owes, and returns the report.
    fn press(&self, data: &Path) -> Value {
        let out = results().join(self.name);
        std::fs::create_dir_all(&out).unwrap();
        let scene = out.join("scene.toml");
        std::fs::write(&scene, self.scene(data)).unwrap();
        let run = Command::new(env!("CARGO_BIN_EXE_palpa"))
            .args(["press", "--json", "--frames", "2", "--out"])
            .arg(&out)
            .arg(&scene)
            .output()
            .unwrap();
        assert!(
            run.status.success(),
            "{}: {}",
            self.name,
            String::from_utf8_lossy(&run.stderr)
        );
        let report: Value = serde_json::from_slice(&run.stdout).unwrap();
        let body = &report["body"];
        println!("{}: {}", self.name, serde_json::to_string(body).unwrap());
        assert!(
            body["n_prisms"].as_u64().unwrap() >= self.n_prisms,
            "{body}"
        );
        assert!(
            body["scaled_jacobian"]["min"].as_f64().unwrap() > 0.0,
            "{body}"
        );
        assert!(
            body["scaled_jacobian"]["p05"].as_f64().unwrap() > 0.25,
            "{body}"
        );
        assert!(
            body["thinned_share"].as_f64().unwrap() <= self.thinned_share,
            "{body}"
        );
        assert_eq!(body["n_base_overlaps"], 0, "the body overlaps itself");
        let samples = report["samples"].as_array().unwrap();
        let forces: Vec<f64> = samples
            .iter()
            .map(|s| s["force_n"].as_f64().unwrap())
            .collect();
        println!("{}: forces {forces:?} N", self.name);
        let loading = &forces[..3];
        assert!(
            loading[0].abs() < 1e-9 && loading[1] > 0.01 && loading[2] > loading[1],
            "{forces:?}"
        );
        let keeps_volume = |s: &Value| s["volume_ratio_min"].as_f64().unwrap() > 0.5;
        assert!(
            samples
                .iter()
                .all(|s| keeps_volume(s) && s["outcome"] == "converged"),
            "{samples:?}"
        );
        assert_eq!(report["result"]["n_turned_prisms"], 0);
        for (sample, force) in samples.iter().zip(&forces).skip(1) {
            let share = sample["error_bar_n"].as_f64().unwrap() / force;
            println!("{}: {force:.4} N ± {:.1} %", self.name, 100.0 * share);
            assert!((1e-3..0.25).contains(&share), "{sample}");
        }
        for file in [
            "press.csv",
            "press.pvd",
            "force_depth.svg",
            "force_depth.png",
            "section.svg",
            "section.png",
        ] {
            assert!(out.join(file).is_file(), "{}: no {file}", self.name);
        }
        report
    }
}

fn results() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("results")
}

fn last_force(report: &Value) -> f64 {
    report["samples"].as_array().unwrap().last().unwrap()["force_n"]
        .as_f64()
        .unwrap()
}

#[test]
fn a_forearm_with_its_bones_is_pressed_at_both_resolutions() {
    let data = crate::data();
    let coarse = FOREARM.press(&data);
    let fine = Case {
        name: "forearm_10k",
        skin: "forearm/forearm_skin_open_10k.ply",
        n_prisms: 100_000,
        ..FOREARM
    };
    let fine = fine.press(&data);
    for report in [&coarse, &fine] {
        let stand_off = &report["body"]["stand_off"];
        assert!(stand_off["median"].as_f64().unwrap() < 2e-3, "{stand_off}");
        assert!(stand_off["max"].as_f64().unwrap() < 16e-3, "{stand_off}");
        assert!(stand_off["min"].as_f64().unwrap() > -1e-3, "{stand_off}");
    }
    // The same body and tool; bars and a disc of few nodes leave the force to the mesh within this
    // factor.
    let ratio = last_force(&coarse) / last_force(&fine);
    println!("force on the coarse over the fine forearm: {ratio:.3}");
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
}

#[test]
fn a_calf_with_its_bones_is_pressed_at_both_resolutions() {
    let data = crate::data();
    CALF.press(&data);
    let fine = Case {
        name: "calf_10k",
        skin: "calf_mri/calf_skin_open_10k.ply",
        n_prisms: 80_000,
        ..CALF
    };
    fine.press(&data);
}

#[test]
fn closed_limbs_grow_as_their_open_skins_do() {
    let data = crate::data();
    let closed = Case {
        name: "forearm_2k_closed",
        skin: "forearm/forearm_skin_2k.obj",
        ..FOREARM
    };
    let report = closed.press(&data);
    assert_eq!(report["body"]["n_caps"], 2);
}

#[test]
fn parts_without_bones_are_pressed_at_a_fixed_depth() {
    let data = crate::data();
    for (name, skin, at) in [
        ("thigh", "parts/thigh_3k.obj", None),
        ("upperarm", "parts/upperarm_2k.obj", None),
        // On the belly, beside the navel.
        (
            "abdomen",
            "parts/abdomen_3k.obj",
            Some(r#"["30 mm", "280 mm", "130 mm"]"#),
        ),
    ] {
        let report = Case {
            name,
            skin,
            at,
            ..PART
        }
        .press(&data);
        assert_eq!(
            report["body"]["n_caps"], 2,
            "{name}: the cut faces are found"
        );
    }
}
