//! The scenes, and what is changed in them.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use palpa_scene::{
    Law, Moduli, Prony, PronyTerm, Resistance, Scene, Skin, Sourced, Status, Tissue, Tool,
};

use crate::bench::cases::RELAXING;

/// Poisson's ratio of nearly incompressible tissues, and friction of a tool that rubs.
const POISSON: f64 = 0.49;
const FRICTION: f64 = 0.3;

/// Benchmark B2 of the verification, under a ball in a simulated hand.
const BLOCK: &str = r#"
[body]
generator = { kind = "block", size = ["100 mm", "100 mm", "40 mm"], spacing = "10 mm" }
[[layer]]
tissue = { name = "skin", young = "100 kPa", poisson = 0.45 }
thickness = "2 mm"
[[layer]]
tissue = { name = "fat", young = "5 kPa", poisson = 0.45 }
thickness = "10 mm"
[[layer]]
tissue = { name = "muscle", young = "30 kPa", poisson = 0.45 }
[tool]
shape = "sphere"
radius = "10 mm"
[press]
depth = "4 mm"
[device]
preset = "falcon"
[motion]
kind = "stroke"
depth = "5 mm"
speed = "50 mm/s"
length = "20 mm"
"#;

/// A calf from magnetic resonance, with the tissues of the forearm.
const CALF: &str = r#"
[body]
surface = "calf_mri/calf_skin_open_10k.ply"
bones = ["calf_mri/tibia.ply", "calf_mri/fibula.ply"]
[[layer]]
tissue = { name = "elastic skin", young = "210 kPa", poisson = 0.45 }
thickness = "1.5 mm"
[[layer]]
tissue = { name = "elastic fat", c10 = "0.42 kPa", bulk = "36 kPa" }
thickness = "4 mm"
[[layer]]
tissue = { name = "elastic muscle", young = "22 kPa", poisson = 0.45 }
levels = 3
[tool]
shape = "sphere"
radius = "10 mm"
[press]
at = ["400 mm", "395 mm", "135 mm"]
depth = "4 mm"
[device]
preset = "falcon"
[motion]
kind = "stroke"
depth = "5 mm"
speed = "50 mm/s"
length = "20 mm"
"#;

/// A change of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variant {
    /// None.
    Plain,
    /// The tool rubs.
    Friction,
    /// The tissues are nearly incompressible.
    Incompressible,
    /// The tissues relax.
    Relaxing,
}

impl Variant {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::Plain,
        Self::Friction,
        Self::Incompressible,
        Self::Relaxing,
    ];

    fn suffix(self) -> &'static str {
        match self {
            Self::Plain => "",
            Self::Friction => "-friction",
            Self::Incompressible => "-nu49",
            Self::Relaxing => "-relaxing",
        }
    }

    fn change(self, scene: &mut Scene) {
        let of_layers = scene.layers.iter_mut().map(|layer| &mut layer.tissue);
        let tissues = of_layers.chain(scene.lumps.iter_mut().map(|lump| &mut lump.tissue));
        match self {
            Self::Plain => {}
            Self::Friction => {
                if let Tool::Contact(tool) = &mut scene.tool {
                    tool.friction = FRICTION;
                }
            }
            Self::Incompressible => tissues.for_each(stiffen),
            Self::Relaxing => tissues.for_each(|tissue| tissue.prony = Some(relaxing())),
        }
    }
}

fn stiffen(tissue: &mut Tissue) {
    if let Law::Elastic(elastic) = &mut tissue.law {
        elastic.resistance = Resistance::Poisson(Sourced {
            value: POISSON,
            status: Status::Given,
            source: String::new(),
        });
    }
}

fn relaxing() -> Prony {
    Prony {
        terms: RELAXING.map(|(g, tau)| PronyTerm { g, tau }).to_vec(),
        moduli: Moduli::Instantaneous,
        relaxes_volume: true,
        status: Status::Given,
        source: String::new(),
    }
}

/// Where places are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Region {
    /// Largest distance from the scene's own place, m.
    pub(super) radius: f64,
    /// Least distance from the rim of the skin, m.
    pub(super) off_rim: f64,
}

/// A scene to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct ShippedCase {
    /// Name on the command line, `shipped-…`.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    pub(super) region: Region,
    /// Whether it is measured if no case is named.
    pub is_usual: bool,
}

/// All cases. `lump_forearm` is the scene that `palpa loop-report` runs without another one; `data` is
/// a folder with surfaces from scans, without which their cases are left out.
///
/// # Errors
/// If `data` does not have these surfaces.
pub fn shipped_cases(
    lump_forearm: &Scene,
    data: Option<&Path>,
) -> anyhow::Result<Vec<ShippedCase>> {
    let parse = |text: &str, base: &Path| Scene::parse(text, base).context("a scene of the bench");
    let mut forearm = lump_forearm.clone();
    forearm.lumps.clear();
    let wide = Region {
        radius: 60e-3,
        off_rim: 35e-3,
    };
    let over_lump = Region {
        radius: 12e-3,
        ..wide
    };
    let middle = Region {
        radius: 15e-3,
        off_rim: 20e-3,
    };
    let mut scenes = vec![
        ("shipped-forearm", forearm, wide),
        ("shipped-lump", lump_forearm.clone(), over_lump),
        ("shipped-block", parse(BLOCK, Path::new(""))?, middle),
    ];
    if let Some(data) = data {
        let calf = parse(CALF, data)?;
        if let Skin::File(path) = &calf.body.skin {
            let path: &PathBuf = path;
            anyhow::ensure!(
                path.is_file(),
                "{}: there is no such file; --data names a folder with the surface of a calf in it",
                path.display()
            );
        }
        scenes.push(("shipped-calf", calf, wide));
    }
    let case = |(name, scene, region): &(&str, Scene, Region), variant: Variant| {
        let mut scene = scene.clone();
        variant.change(&mut scene);
        ShippedCase {
            name: format!("{name}{}", variant.suffix()),
            scene,
            region: *region,
            is_usual: variant == Variant::Plain || *name == "shipped-block",
        }
    };
    Ok((scenes.iter())
        .flat_map(|scene| Variant::ALL.map(|variant| case(scene, variant)))
        .collect())
}
