//! The tissues inside the program.

use std::collections::BTreeSet;
use std::path::Path;

use palpa_scene::{MaterialStatus, Scene, Status, Tissue, catalogue};

/// A scene of one layer of this tissue.
fn scene_of(tissue: &Tissue) -> Scene {
    let text = format!(
        "[body]\nsurface = \"s.ply\"\n[[layer]]\nthickness = \"9 mm\"\ntissue = \"{}\"",
        tissue.name
    );
    Scene::parse(&text, Path::new("")).unwrap()
}

#[test]
fn every_tissue_is_complete_and_within_the_ranges_of_a_scene() {
    let names: BTreeSet<_> = catalogue().iter().map(|t| &t.name).collect();
    assert_eq!(names.len(), catalogue().len(), "names are unique");
    for tissue in catalogue() {
        let mut scene = scene_of(tissue);
        let status = scene.material_status().remove(0);
        assert!(
            tissue.elastic().is_some(),
            "{}: the catalogue has laws",
            tissue.name
        );
        assert!(status.parameters.len() >= 2, "{}", tissue.name);
        for number in &status.parameters {
            let what = format!("{}: {}", tissue.name, number.name);
            assert!(!number.source.is_empty(), "{what} without a source");
            assert_ne!(number.status, Status::Given, "{what}");
            // No paper was read for this catalogue: nothing in it may pass for measured.
            assert_ne!(number.status, Status::Measured, "{what}");
            let is_from_memory = number.source.contains("from memory");
            assert!(
                !is_from_memory || number.status == Status::Assumed,
                "{what}: what is from memory is assumed"
            );
        }
        // The same values given by hand must pass the ranges that a scene is held to.
        scene.layers[0].tissue.name.push_str(" by hand");
        let written = scene.to_toml();
        let again = Scene::parse(&written, Path::new(""))
            .unwrap_or_else(|e| panic!("{}: {e}", tissue.name));
        let [again] = again.material_status().try_into().unwrap();
        let values = |status: &MaterialStatus| -> Vec<_> {
            (status.parameters.iter().map(|p| (p.name.clone(), p.value))).collect()
        };
        assert_eq!(values(&again), values(&status), "{written}");
    }
}

/// What can be put into a body: the layers of a limb, what is hidden in them, and phantoms.
#[test]
fn there_is_a_tissue_for_every_part() {
    let law = |name: &str| {
        let tissue = catalogue().iter().find(|t| t.name == name);
        tissue.unwrap_or_else(|| panic!("{name}")).law.name()
    };
    for name in [
        "skin",
        "epidermis",
        "dermis",
        "fat",
        "muscle",
        "fibrous lump",
        "soft silicone",
    ] {
        assert_eq!(law(name), "neo-hookean", "{name}");
    }
    assert_eq!(law("stiffening skin"), "fung");
    for name in ["skin", "fat", "muscle"] {
        let tissue = catalogue().iter().find(|t| t.name == name).unwrap();
        assert!(tissue.prony.is_some(), "{name} relaxes");
    }
}

/// E and ν of an isotropic body from C₁₀ = µ/2 and K, which the abstract of Tran et al. 2007 gives.
#[test]
fn derived_moduli_follow_from_the_figures_they_cite() {
    for (name, c10, bulk) in [
        ("epidermis", 0.12e6, 5.45e6),
        ("dermis", 1.11e6, 29.6e6),
        ("fat", 0.42e3, 36.0e3),
    ] {
        let mu = 2.0 * c10;
        let young: f64 = 9.0 * bulk * mu / (3.0 * bulk + mu);
        let poisson: f64 = (3.0 * bulk - 2.0 * mu) / (6.0 * bulk + 2.0 * mu);
        let tissue = catalogue().iter().find(|t| t.name == name).unwrap();
        assert!(
            (tissue.young().unwrap() / young - 1.0).abs() < 1e-3,
            "{name}: E = {young}"
        );
        assert!(
            (tissue.poisson().unwrap() - poisson).abs() < 5e-4,
            "{name}: nu = {poisson}"
        );
    }
}
