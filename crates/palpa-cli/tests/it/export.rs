//! `palpa export`: the deck has the body, the laws and the supports of the scene.

#![expect(
    clippy::float_cmp,
    reason = "coordinates of a block in millimetres are exact in the deck"
)]

use std::collections::{BTreeMap, BTreeSet};

use palpa_mesh::Vec3;
use palpa_testkit::{Bench, Layer, Lump, Scene};
use serde_json::Value;

use crate::palpa;

/// A block of 5 × 5 vertices on 3 levels, held by planes of symmetry, pressed in the middle.
fn block(soft: &str, other: &str) -> Scene {
    Scene::block([40.0, 40.0, 30.0], 10.0)
        .set("body", "cut_faces", "symmetric")
        .layer(
            Layer::of(&format!(r#"name = "soft fat", {soft}"#))
                .thick(10.0)
                .levels(1),
        )
        .layer(Layer::of(&format!(r#"name = "other", {other}"#)).levels(1))
        .disc(12.0)
        .press(3.0)
        .set("press", "step", "1 mm")
        .set("mesh", "refine", false)
}

/// `palpa export` of a scene.
struct Export(Bench);

impl Export {
    /// Of the block whose second layer has this law.
    fn new(tissue: &str) -> Self {
        Self::with(&block(SOFT, tissue))
    }

    fn with(scene: &Scene) -> Self {
        let bench = palpa();
        bench.file("scene.toml", scene);
        Self(bench)
    }

    fn report(&self, args: &[&str]) -> Value {
        let command = ["export", "scene.toml", "--json"];
        self.0.report(&[&command, args].concat())
    }

    fn deck(&self, args: &[&str]) -> Inp {
        self.report(args);
        Inp::read(&self.0.read("out/export/body.inp"))
    }

    fn refusal(&self, args: &[&str]) -> String {
        let (code, _, text) = self.0.run(&[&["export", "scene.toml"], args].concat());
        assert_eq!(code, 2, "{text}");
        assert_eq!(text.trim_end().lines().count(), 1, "one paragraph: {text}");
        assert!(!self.0.path("out/export/body.inp").exists());
        text
    }
}

const SOFT: &str = r#"young = "10 kPa", poisson = 0.45"#;
const ELASTIC: &str = r#"young = "40 kPa", poisson = 0.45"#;

/// A deck taken apart again: blocks of a keyword line and its data lines.
struct Inp {
    comments: String,
    blocks: Vec<(String, Vec<Vec<String>>)>,
}

impl Inp {
    fn read(text: &str) -> Self {
        let mut inp = Self {
            comments: String::new(),
            blocks: Vec::new(),
        };
        for line in text.lines() {
            assert!(line.len() <= 132, "CalculiX reads 132 characters: {line}");
            if let Some(comment) = line.strip_prefix("**") {
                inp.comments += comment;
            } else if line.starts_with('*') {
                inp.blocks.push((line.to_owned(), Vec::new()));
            } else {
                let fields = line.trim_end_matches(',').split(',');
                let fields: Vec<String> = fields.map(str::to_owned).collect();
                assert!(
                    fields.len() <= 16 && fields.iter().all(|f| f.len() <= 20),
                    "{line}"
                );
                inp.blocks.last_mut().unwrap().1.push(fields);
            }
        }
        inp
    }

    fn blocks(&self, keyword: &str) -> Vec<&(String, Vec<Vec<String>>)> {
        let is_it = |line: &str| line.split(',').next() == Some(keyword);
        self.blocks.iter().filter(|(line, _)| is_it(line)).collect()
    }

    fn nodes(&self) -> BTreeMap<usize, Vec3> {
        let [(_, lines)] = self.blocks("*NODE")[..] else {
            panic!("one block of nodes");
        };
        let number = |text: &String| text.parse::<f64>().unwrap();
        lines
            .iter()
            .map(|f| {
                let p = Vec3::new(number(&f[1]), number(&f[2]), number(&f[3]));
                (f[0].parse().unwrap(), p)
            })
            .collect()
    }

    fn elements(&self) -> Vec<Vec<usize>> {
        let lines = self
            .blocks("*ELEMENT")
            .into_iter()
            .flat_map(|(_, lines)| lines);
        lines
            .map(|f| f[1..].iter().map(|n| n.parse().unwrap()).collect())
            .collect()
    }

    fn set(&self, name: &str) -> BTreeSet<usize> {
        let header = format!("*NSET, NSET={name}");
        let sets: Vec<_> = self
            .blocks
            .iter()
            .filter(|(line, _)| *line == header)
            .collect();
        let [(_, lines)] = sets[..] else {
            panic!("one set {name}");
        };
        lines.iter().flatten().map(|n| n.parse().unwrap()).collect()
    }

    /// The numbers under the n-th material's law, and its keyword.
    fn law(&self, n: usize) -> (String, Vec<f64>) {
        let at = (self.blocks.iter().enumerate())
            .filter(|(_, (line, _))| line.starts_with("*MATERIAL"))
            .nth(n)
            .unwrap();
        let (keyword, lines) = &self.blocks[at.0 + 1];
        let numbers = lines.iter().flatten().map(|n| n.parse().unwrap()).collect();
        (keyword.clone(), numbers)
    }
}

#[test]
fn elements_are_whole_and_turned_as_calculix_wants() {
    for (element, n_corners, n_nodes) in [("c3d15", 15, 0), ("c3d6", 6, 75)] {
        let inp = Export::new(ELASTIC).deck(&["--element", element]);
        let (nodes, elements) = (inp.nodes(), inp.elements());
        assert_eq!(elements.len(), 32 * 2);
        if n_nodes > 0 {
            assert_eq!(nodes.len(), n_nodes);
        }
        let mut used = BTreeSet::new();
        let mut volume = 0.0;
        for element in &elements {
            assert_eq!(element.len(), n_corners);
            used.extend(element.iter().copied());
            let p: Vec<Vec3> = element.iter().map(|n| nodes[n]).collect();
            let jacobian = (p[1] - p[0]).cross(&(p[2] - p[0])).dot(&(p[3] - p[0]));
            assert!(jacobian > 0.0, "{element:?}");
            volume += 0.5 * jacobian;
            let edges = [
                (0, 1),
                (1, 2),
                (2, 0),
                (3, 4),
                (4, 5),
                (5, 3),
                (0, 3),
                (1, 4),
                (2, 5),
            ];
            for (middle, (a, b)) in p[6..].iter().zip(edges) {
                assert!((middle - 0.5 * (p[a] + p[b])).norm() < 1e-9, "{element:?}");
            }
        }
        assert!((volume - 40.0 * 40.0 * 30.0).abs() < 1e-6, "{volume} mm³");
        assert_eq!(used.len(), nodes.len(), "every node belongs to an element");
        // No two nodes at one place: the middles of edges are shared.
        let places: BTreeSet<[i64; 3]> = nodes
            .values()
            .map(|p| [p.x, p.y, p.z].map(|x| (x * 1e6).round() as i64))
            .collect();
        assert_eq!(places.len(), nodes.len());
    }
}

#[test]
fn the_patch_moves_the_base_stays_and_the_sides_slide() {
    let inp = Export::new(ELASTIC).deck(&[]);
    let nodes = inp.nodes();
    let all = |is_in: &dyn Fn(&Vec3) -> bool| -> BTreeSet<usize> {
        let those = nodes.iter().filter(|(_, p)| is_in(p));
        those.map(|(n, _)| *n).collect()
    };
    // Five vertices lie within 12 mm; with them goes what lies between two of them.
    let elements = inp.elements();
    let is_under = |n: &usize| nodes[n].z == 0.0 && nodes[n].xy().norm() < 12.0;
    let mut patch = BTreeSet::new();
    for element in &elements {
        let corners = &element[3..6];
        patch.extend(corners.iter().copied().filter(is_under));
        for (i, j, middle) in [(0, 1, 9), (1, 2, 10), (2, 0, 11)] {
            if is_under(&corners[i]) && is_under(&corners[j]) {
                patch.insert(element[middle]);
            }
        }
    }
    assert_eq!(inp.set("PATCH"), patch);
    assert!(patch.len() >= 5 + 4);
    assert_eq!(inp.set("BASE"), all(&|p| p.z == -30.0));
    assert_eq!(inp.set("FIXED"), inp.set("BASE"));
    let cut: Vec<_> = (1..=4).map(|i| inp.set(&format!("CUT{i}"))).collect();
    for side in [-20.0, 20.0] {
        assert!(cut.contains(&all(&|p| p.x == side)) && cut.contains(&all(&|p| p.y == side)));
    }
    // Each node of the sides keeps its normal directions, the corners two of them, unless it is
    // fixed.
    let fixed = inp.set("FIXED");
    let mut kept: BTreeMap<usize, BTreeSet<String>> = BTreeMap::new();
    for (_, lines) in inp.blocks("*BOUNDARY") {
        for line in lines.iter().filter(|line| line[0].starts_with("SLIDE")) {
            assert_eq!(line[1], line[2]);
            for node in inp.set(&line[0]) {
                assert!(kept.entry(node).or_default().insert(line[1].clone()));
            }
        }
    }
    for (node, p) in &nodes {
        let mut expected = BTreeSet::new();
        if p.x.abs() == 20.0 && !fixed.contains(node) {
            expected.insert("1".to_owned());
        }
        if p.y.abs() == 20.0 && !fixed.contains(node) {
            expected.insert("2".to_owned());
        }
        assert_eq!(
            kept.get(node).cloned().unwrap_or_default(),
            expected,
            "{p:?}"
        );
    }
    assert!(inp.blocks("*TRANSFORM").is_empty());
    let step = inp.blocks("*BOUNDARY").last().unwrap().1.clone();
    assert_eq!(step.len(), 3);
    assert_eq!(step[2][..3], ["PATCH", "3", "3"].map(str::to_owned));
    assert_eq!(step[2][3].parse::<f64>().unwrap(), -3.0);
    assert_eq!(inp.blocks("*TIME POINTS")[0].1.len(), 3);
}

#[test]
fn each_law_is_written_in_its_own_words() {
    let [young, nu] = [0.04, 0.45];
    let (shear, bulk): (f64, f64) = (young / (2.0 * (1.0 + nu)), young / (3.0 * (1.0 - 2.0 * nu)));
    let (c10, d1) = (0.5 * shear, 2.0 / bulk);
    let none = 1e20;
    for (tissue, keyword, numbers) in [
        (ELASTIC, "*HYPERELASTIC, NEO HOOKE", vec![c10, d1]),
        (
            r#"law = "mooney-rivlin", young = "40 kPa", c01 = "2 kPa", poisson = 0.45"#,
            "*HYPERELASTIC, MOONEY-RIVLIN",
            vec![c10 - 2e-3, 2e-3, d1],
        ),
        (
            r#"law = "yeoh", young = "40 kPa", c20 = "1 kPa", c30 = "3 kPa", poisson = 0.45"#,
            "*HYPERELASTIC, YEOH",
            vec![c10, 1e-3, 3e-3, d1, none, none],
        ),
        (
            r#"law = "ogden", terms = [{ mu = "9 kPa", alpha = 8 }, { mu = "2 kPa", alpha = -3 }, { mu = "1 kPa", alpha = 2 }], bulk = "100 kPa""#,
            "*HYPERELASTIC, OGDEN, N=3",
            vec![9e-3, 8.0, 2e-3, -3.0, 1e-3, 2.0, 20.0, none, none],
        ),
        (
            r#"law = "st-venant-kirchhoff", young = "40 kPa", poisson = 0.45"#,
            "*ELASTIC",
            vec![young, nu],
        ),
        // At rest, 40 % has relaxed; the volume has not.
        (
            r#"young = "40 kPa", poisson = 0.45, prony = { terms = [{ g = 0.4, tau = "1 s" }], moduli = "instantaneous" }"#,
            "*HYPERELASTIC, NEO HOOKE",
            vec![0.6 * c10, d1],
        ),
    ] {
        let inp = Export::new(tissue).deck(&[]);
        let (found, values) = inp.law(1);
        assert_eq!(found, keyword);
        assert_eq!(values.len(), numbers.len(), "{tissue}");
        for (value, number) in values.iter().zip(&numbers) {
            assert!(
                (value / number - 1.0).abs() < 1e-9,
                "{tissue}: {values:?} {numbers:?}"
            );
        }
        assert!(inp.blocks("*STEP")[0].0.contains("NLGEOM"));
        assert_eq!(inp.comments.contains("relaxes"), tissue.contains("prony"));
    }
}

#[test]
fn a_linear_body_is_one_of_small_strain() {
    let linear = block(
        r#"law = "linear", young = "10 kPa", poisson = 0.45"#,
        r#"law = "linear", young = "40 kPa""#,
    );
    let inp = Export::with(&linear).deck(&[]);
    assert!(!inp.blocks("*STEP")[0].0.contains("NLGEOM"));
    assert_eq!(inp.law(0).0, "*ELASTIC");
    let mixed = Export::new(r#"law = "linear", young = "40 kPa""#).refusal(&[]);
    assert!(
        mixed.contains("\"other\" is linear and tissue \"soft fat\" is not"),
        "{mixed}"
    );
}

#[test]
fn what_calculix_cannot_say_is_refused_or_noted() {
    for (tissue, says, keyword) in [
        (
            r#"law = "fung", young = "40 kPa", b = 5"#,
            "Fung's exponential",
            "YEOH",
        ),
        (
            r#"law = "gent", young = "40 kPa", jm = 5"#,
            "Gent's logarithm",
            "YEOH",
        ),
        (
            r#"young = "40 kPa", volume = "logarithmic""#,
            "(ln J)²",
            "NEO HOOKE",
        ),
    ] {
        let export = Export::new(tissue);
        let text = export.refusal(&[]);
        assert!(
            text.contains(says) && text.contains("--approximate"),
            "{text}"
        );
        let inp = export.deck(&["--approximate"]);
        assert!(
            inp.comments.contains("note: tissue \"other\""),
            "{}",
            inp.comments
        );
        assert!(inp.law(1).0.contains(keyword));
    }
    let tense = block(SOFT, ELASTIC).with_layer(1, |other| other.set("prestress", "5 kPa"));
    let tense = Export::with(&tense).refusal(&[]);
    assert!(tense.contains("tension at rest"), "{tense}");
    let terms = r#"{ mu = "1 kPa", alpha = 2 }, "#.repeat(4);
    let many = Export::new(&format!(r#"law = "ogden", terms = [{terms}]"#));
    assert!(
        many.refusal(&["--approximate"])
            .contains("4 terms of Ogden's")
    );
    let springs = Export::new(r#"spring = "90 dyn/cm""#).refusal(&["--approximate"]);
    assert!(springs.contains("stiffness of springs"), "{springs}");
    let ball = Export::with(&block(SOFT, ELASTIC).sphere(12.0)).refusal(&[]);
    assert!(ball.contains("presses by contact"), "{ball}");
}

#[test]
fn a_lump_has_the_prisms_whose_middle_it_holds() {
    let lump = |radius: f64| {
        let knot = Lump::sphere(radius, "hard", "300 kPa").set("name", "knot");
        Export::with(&block(SOFT, ELASTIC).lump(knot.set("depth", "10 mm")))
    };
    let report = lump(15.0).report(&[]);
    let materials = report["materials"].as_array().unwrap();
    assert_eq!(materials[2]["name"], "M3_HARD");
    let inp = lump(15.0).deck(&[]);
    let (nodes, centre) = (inp.nodes(), Vec3::new(0.0, 0.0, -10.0));
    let elements = inp.elements();
    let is_in = |element: &Vec<usize>| {
        let middle = element[..6].iter().map(|n| nodes[n]).sum::<Vec3>() / 6.0;
        (middle - centre).norm() < 15.0
    };
    let n_inside = elements.iter().filter(|e| is_in(e)).count();
    assert!(n_inside > 4);
    assert_eq!(materials[2]["n_elements"], n_inside);
    let hard = inp
        .blocks("*ELEMENT")
        .into_iter()
        .find(|(line, _)| line.ends_with("M3_HARD"));
    assert_eq!(hard.unwrap().1.len(), n_inside);
    // One that falls between is said to be missing.
    let report = lump(1.0).report(&[]);
    let notes = report["notes"].as_array().unwrap();
    let is_said = |note: &Value| {
        note.as_str()
            .unwrap()
            .contains("holds the middle of no prism")
    };
    assert!(notes.iter().any(is_said), "{notes:?}");
}

#[test]
fn the_deck_has_the_mesh_and_the_patch_of_the_press() {
    let refined = block(SOFT, ELASTIC)
        .without("mesh", "refine")
        .near_tool(4.0);
    let export = Export::with(&refined);
    let report = export.report(&["--element", "c3d6"]);
    let press = export.0.report(&[
        "press",
        "scene.toml",
        "--json",
        "--frames",
        "0",
        "--no-retract",
        "--depth",
        "0.1 mm",
        "--step",
        "0.1 mm",
    ]);
    let press = &press["press"];
    assert_eq!(report["n_nodes"], press["n_nodes"]);
    assert_eq!(report["n_elements"], press["n_prisms"]);
    assert_eq!(report["n_patch_nodes"], press["n_operated_nodes"]);
    let radius = report["patch_radius_mm"].as_f64().unwrap();
    assert!((radius / 12.0 - 1.0).abs() < 1e-3, "{radius}");
}
