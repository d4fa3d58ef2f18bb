//! A layered body and its press as an input deck for CalculiX, so that anyone can check our forces with another solver.
//!
//! Lengths in the deck are millimetres, forces newtons, stresses megapascals. Nodes of the body keep their order, numbered
//! from 1; middle nodes of edges follow. The same prisms carry the same materials and supports as in our own model, but the
//! element is CalculiX's, so both agree only as far as both meshes are fine enough.
//!
//! What CalculiX cannot say is a *departure*: the deck is refused, unless the caller takes the nearest that it can say.

mod material;
mod mesh;
mod results;
mod sets;
mod write;

pub use results::{PatchForce, patch_forces};

use std::io;

use anyhow::bail;
use palpa_fem::Supports;
use palpa_fem::law::{Law, Material};
use palpa_fem::lump::Lump;
use palpa_mesh::{LayeredBody, Vec3};

use self::material::{Card, card};
use self::mesh::Mesh;
use self::sets::Sets;

/// The element that a prism becomes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Element {
    /// Quadratic, 15 nodes: CalculiX's own answer at its best
    #[default]
    C3d15,
    /// Linear, 6 nodes: small, but much too stiff where tissue keeps its volume
    C3d6,
}

/// What is exported.
#[derive(Debug, Clone, Copy)]
pub struct Export<'a> {
    /// The body at rest.
    pub body: &'a LayeredBody,
    /// Its materials: of the i-th layer the i-th, and those that the lumps name.
    pub materials: &'a [Material],
    /// Its lumps; where two overlap, the later one counts. A prism is a lump's if its middle is.
    pub lumps: &'a [Lump],
    /// What holds it.
    pub supports: &'a Supports,
    /// Nodes that move with the tool; they are held by nothing else.
    pub patch: &'a [usize],
    /// How far the tool moves, straight. m
    pub travel: Vec3,
    /// Results on the way, equally spaced, at least 1.
    pub n_results: usize,
    /// What a prism becomes.
    pub element: Element,
    /// Whether the nearest is good enough where CalculiX cannot say what is meant.
    pub is_approximate: bool,
    /// Lines of comment on top.
    pub title: &'a [String],
}

/// A deck ready to be written.
#[derive(Debug)]
pub struct Deck<'a> {
    export: Export<'a>,
    mesh: Mesh,
    cards: Vec<Card>,
    sets: Sets,
    is_linear: bool,
    /// Where the deck is not what was meant, or what to know beside it.
    pub notes: Vec<String>,
}

/// A material of the deck and where it is.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Section {
    /// Name of its element set and of its material.
    pub name: String,
    /// The law as CalculiX calls it.
    pub law: String,
    /// Number of its elements.
    pub n_elements: usize,
}

impl<'a> Deck<'a> {
    /// Makes the deck.
    ///
    /// # Errors
    /// When CalculiX has no law like one of the materials, or has one like it only nearly and that is not good enough; when
    /// nothing moves; when a layer or lump has no material.
    pub fn build(export: &Export<'a>) -> anyhow::Result<Self> {
        if export.patch.is_empty() || export.travel.norm() == 0.0 || export.n_results == 0 {
            bail!("nothing is pressed: give nodes that move, a way to go and at least one result");
        }
        let n_materials = export.materials.len();
        let n_layers = export.body.layer_names.len();
        let of_lumps = export.lumps.iter().map(|lump| lump.material() + 1);
        let n_needed = of_lumps.fold(n_layers, usize::max);
        if n_needed > n_materials {
            bail!("{n_materials} materials are too few: layers and lumps name {n_needed}");
        }
        let mut notes = Vec::new();
        let mut departures = Vec::new();
        let is_linear = is_linear(export.materials)?;
        let mut cards = Vec::new();
        for (i, material) in export.materials.iter().enumerate() {
            cards.push(card(i, material, &mut departures, &mut notes)?);
        }
        if !departures.is_empty() && !export.is_approximate {
            bail!(
                "CalculiX cannot say all of this scene: {}. With --approximate this is done and noted in the deck",
                departures.join("; ")
            );
        }
        notes.extend(departures);
        let mesh = Mesh::build(export);
        for lump in export.lumps {
            if !mesh.material.contains(&lump.material()) {
                notes.push(format!(
                    "a lump of tissue \"{}\" holds the middle of no prism, so the deck is without it; make levels and skin finer \
                     there",
                    export.materials[lump.material()].name
                ));
            }
        }
        let sets = Sets::build(export, &mesh);
        Ok(Self {
            export: *export,
            mesh,
            cards,
            sets,
            is_linear,
            notes,
        })
    }

    /// Number of nodes, those in the middle of edges included.
    pub fn n_nodes(&self) -> usize {
        self.mesh.nodes.len()
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.mesh.elements.len()
    }

    /// Number of nodes that move with the tool, those in the middle of edges included.
    pub fn n_patch_nodes(&self) -> usize {
        self.sets.patch.len()
    }

    /// The materials in their order, and how much of the body each is.
    pub fn sections(&self) -> Vec<Section> {
        let count = |i| self.mesh.material.iter().filter(|&&m| m == i).count();
        self.cards
            .iter()
            .enumerate()
            .map(|(i, card)| Section {
                name: card.name.clone(),
                law: card.keyword.clone(),
                n_elements: count(i),
            })
            .collect()
    }

    /// Writes the deck.
    ///
    /// # Errors
    /// When `out` cannot be written.
    pub fn write(&self, out: &mut dyn io::Write) -> io::Result<()> {
        write::write(self, out)
    }
}

/// Whether the body is one of small strain, in which no law but the linear one may occur.
fn is_linear(materials: &[Material]) -> anyhow::Result<bool> {
    let linear = |m: &&Material| matches!(m.law, Law::Linear(_));
    let first = materials.iter().find(linear);
    match (first, materials.iter().find(|m| !linear(m))) {
        (Some(linear), Some(other)) => bail!(
            "tissue \"{}\" is linear and tissue \"{}\" is not; a body is of small strain throughout or not at all: give both \
             the same kind of law",
            linear.name,
            other.name
        ),
        (linear, _) => Ok(linear.is_some()),
    }
}
