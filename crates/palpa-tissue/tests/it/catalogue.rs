//! The tissues inside the program.

use std::collections::BTreeSet;
use std::path::Path;

use palpa_tissue::{Law, Scene, Status, catalogue};

#[test]
fn every_tissue_is_complete_and_within_the_ranges_of_a_scene() {
    let names: BTreeSet<_> = catalogue().iter().map(|t| &t.name).collect();
    assert_eq!(names.len(), catalogue().len(), "names are unique");
    for tissue in catalogue() {
        let Law::Elastic { young, poisson } = &tissue.law else {
            panic!("{}: the catalogue has moduli", tissue.name)
        };
        for number in [Some(young), Some(poisson), tissue.density.as_ref()]
            .into_iter()
            .flatten()
        {
            assert!(
                !number.source.is_empty(),
                "{}: a number without a source",
                tissue.name
            );
            assert_ne!(number.status, Status::Given, "{}", tissue.name);
            // No paper was read for this catalogue: nothing in it may pass for measured.
            assert_ne!(number.status, Status::Measured, "{}", tissue.name);
            let is_from_memory = number.source.contains("from memory");
            assert!(
                !is_from_memory || number.status == Status::Assumed,
                "{}: what is from memory is assumed",
                tissue.name
            );
        }
        // The same values given by hand must pass the ranges that a scene is held to.
        let text = format!(
            "[body]\nsurface = \"s.ply\"\n[[layer]]\nthickness = \"9 mm\"\n\
             tissue = {{ young = \"{} Pa\", poisson = {}, density = \"{} kg/m³\" }}",
            young.value,
            poisson.value,
            tissue.density.as_ref().map_or(1000.0, |d| d.value)
        );
        Scene::parse(&text, Path::new("")).unwrap_or_else(|e| panic!("{}: {e}", tissue.name));
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
