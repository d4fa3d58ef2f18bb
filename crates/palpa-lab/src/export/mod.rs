//! Writes a layered body and its press as an input deck for CalculiX, to check the forces with
//! another solver.
//!
//! Lengths in the deck are in millimetres, forces in newtons, stresses in megapascals. Nodes of the
//! body keep their order, numbered from 1; the middle nodes of edges follow. Prisms, materials and
//! supports are those of Palpa's model, but the element is CalculiX's, so the forces agree only as
//! far as both meshes are fine enough.
//!
//! A feature that CalculiX cannot express is a *departure*. With a departure the deck is refused,
//! unless the caller accepts the nearest feature that CalculiX has.

mod material;
mod mesh;
mod note;
mod results;
mod sets;
mod write;

pub use note::{DeckNote, Departure};
pub use results::{PatchForce, patch_forces};

use std::io;

use anyhow::bail;
use palpa_fem::Supports;
use palpa_fem::law::{Law, Material};
use palpa_fem::lump::Lump;
use palpa_mesh::{LayeredBody, Vec3};

use self::material::{Card, card};
use self::mesh::DeckMesh;
use self::sets::Sets;

/// The CalculiX element used for a prism.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Element {
    /// Quadratic, 15 nodes: the most accurate
    #[default]
    C3d15,
    /// Linear, 6 nodes: a small file, but much too stiff for nearly incompressible tissue
    C3d6,
}

/// The input of an export.
#[derive(Debug, Clone, Copy)]
pub struct Export<'a> {
    /// The body at rest.
    pub body: &'a LayeredBody,
    /// Materials: entry i for layer i, then those that the lumps refer to.
    pub materials: &'a [Material],
    /// Lumps; where two overlap, the later one counts. A prism belongs to a lump if its middle
    /// does.
    pub lumps: &'a [Lump],
    /// Supports of the body.
    pub supports: &'a Supports,
    /// Nodes that move with the tool; nothing else holds them.
    pub patch: &'a [usize],
    /// Straight travel of the tool, m.
    pub travel: Vec3,
    /// Number of results along the travel, equally spaced; at least 1.
    pub n_results: usize,
    /// Element type for the prisms.
    pub element: Element,
    /// Whether to write the nearest feature where CalculiX cannot express the exact one.
    pub is_approximate: bool,
    /// Comment lines at the top of the deck.
    pub title: &'a [String],
}

/// A deck ready to be written.
#[derive(Debug)]
pub struct Deck<'a> {
    export: Export<'a>,
    mesh: DeckMesh,
    cards: Vec<Card>,
    sets: Sets,
    is_linear: bool,
    /// Notes for the user: departures of the deck, and other facts about it.
    pub notes: Vec<DeckNote>,
}

/// A material of the deck and its elements.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Section {
    /// Name of the material and of its element set.
    pub name: String,
    /// CalculiX's name of the law.
    pub law: String,
    /// Number of elements with this material.
    pub n_elements: usize,
}

impl<'a> Deck<'a> {
    /// Makes the deck.
    ///
    /// # Errors
    /// If CalculiX has no law like that of a material, or only an approximate one and
    /// `is_approximate` is false; if nothing moves; if a layer or lump has no material.
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
                "CalculiX cannot represent all of this scene: {}. With --approximate, Palpa writes the nearest and notes it in the deck",
                (departures
                    .iter()
                    .map(Departure::to_string)
                    .collect::<Vec<_>>())
                .join("; ")
            );
        }
        notes.extend(departures.into_iter().map(DeckNote::Departure));
        let mesh = DeckMesh::build(export);
        for lump in export.lumps {
            if !mesh.material.contains(&lump.material()) {
                notes.push(DeckNote::LumpMissing {
                    tissue: export.materials[lump.material()].name.clone(),
                });
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

    /// Number of nodes, including the middle nodes of edges.
    pub fn n_nodes(&self) -> usize {
        self.mesh.nodes.len()
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.mesh.elements.len()
    }

    /// Number of nodes that move with the tool, including the middle nodes of edges.
    pub fn n_patch_nodes(&self) -> usize {
        self.sets.patch.len()
    }

    /// The materials in their order, with the number of elements of each.
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
    /// If `out` cannot be written.
    pub fn write(&self, out: &mut dyn io::Write) -> io::Result<()> {
        write::write(self, out)
    }
}

/// Whether the body is computed at small strain. Then all laws must be linear.
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
