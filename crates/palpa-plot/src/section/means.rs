//! A field of prisms as means at their corners, so that it can be drawn smoothly.

use palpa_mesh::quality::prism_volume;
use palpa_mesh::{LayeredBody, Vec3};

use super::{EdgePlace, Section};

/// Values at the six corners of every prism. Two prisms share the value at a common node if they are
/// of the same tissue; between tissues the field may jump.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CornerMeans {
    /// `[n_prisms]`; the corners in the order of [`LayeredBody::prism`].
    values: Vec<[f64; 6]>,
    /// The nodes of each prism, in the same order. `[n_prisms]`
    nodes: Vec<[usize; 6]>,
}

/// At each corner of a prism, the mean of a field over the prisms of the same tissue around that node,
/// weighted by their volumes at rest. `tissue` names the tissue of each prism, and `field` has its
/// value. Both `[n_prisms]`
///
/// # Panics
/// If the lengths do not fit the body.
pub fn tissue_means(body: &LayeredBody, tissue: &[usize], field: &[f64]) -> CornerMeans {
    let n_prisms = body.n_prisms();
    assert_eq!(
        [tissue.len(), field.len()],
        [n_prisms; 2],
        "one tissue and one value per prism"
    );
    let n_intervals = body.n_levels - 1;
    let nodes: Vec<[usize; 6]> = (0..n_prisms)
        .map(|p| body.prism(p / n_intervals, p % n_intervals))
        .collect();
    // Few tissues meet at a node: a list is searched faster than a map.
    let mut at_nodes: Vec<Vec<Sum>> = vec![Vec::new(); body.n_nodes()];
    for (p, prism) in nodes.iter().enumerate() {
        let corners: [Vec3; 6] = prism.map(|node| body.positions[node]);
        let weight = prism_volume(&corners);
        for &node in prism {
            let sums = &mut at_nodes[node];
            let known = sums.iter().position(|sum| sum.tissue == tissue[p]);
            let index = known.unwrap_or(sums.len());
            if index == sums.len() {
                sums.push(Sum {
                    tissue: tissue[p],
                    value: 0.0,
                    weight: 0.0,
                });
            }
            let of_tissue = &mut sums[index];
            of_tissue.value += weight * field[p];
            of_tissue.weight += weight;
        }
    }
    let mean = |node: usize, p: usize| {
        let sum = at_nodes[node].iter().find(|sum| sum.tissue == tissue[p]);
        // Without volume there is no mean, and the prism is not seen.
        sum.filter(|sum| sum.weight > 0.0)
            .map_or(field[p], |sum| sum.value / sum.weight)
    };
    let values = (nodes.iter().enumerate())
        .map(|(p, prism)| prism.map(|node| mean(node, p)))
        .collect();
    CornerMeans { values, nodes }
}

#[derive(Debug, Clone)]
struct Sum {
    tissue: usize,
    value: f64,
    weight: f64,
}

impl CornerMeans {
    /// The value at a place on an edge of a prism.
    ///
    /// # Panics
    /// If the prism does not have that edge.
    pub fn at(&self, prism: usize, place: &EdgePlace) -> f64 {
        place.value(|node| {
            let corner = self.nodes[prism].iter().position(|&n| n == node);
            self.values[prism][corner.expect("an edge of the prism")]
        })
    }

    /// The values at the corners of all cut prisms.
    ///
    /// # Panics
    /// If the section is that of another body.
    pub fn in_section(&self, section: &Section) -> Vec<f64> {
        let of_cell = |cell: &super::Cell| -> Vec<f64> {
            let places = cell.places.iter();
            places.map(|place| self.at(cell.prism, place)).collect()
        };
        section.cells.iter().flat_map(of_cell).collect()
    }
}
