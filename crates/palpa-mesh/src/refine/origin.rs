//! The places of a refined skin's vertices on the old skin.

use std::ops::{Add, Mul};

/// For each vertex, the old vertices between which it lies, with weights that sum up to 1. An old
/// vertex has one, a vertex on an edge two, a vertex in a triangle three. There are more if a moved
/// vertex was split from another.
#[derive(Debug, Clone, PartialEq)]
pub struct Origins {
    /// Index of the first part of each vertex, and one past the last. `[n_vertices + 1]`
    first: Vec<usize>,
    parts: Vec<(u32, f64)>,
}

impl Origins {
    /// `n` old vertices, each at its own place.
    pub(super) fn identity(n: usize) -> Self {
        Self {
            first: (0..=n).collect(),
            parts: (0..n as u32).map(|v| (v, 1.0)).collect(),
        }
    }

    /// Each vertex at its own place, or moved to another by the given share of the way.
    pub(super) fn moved(place: &[Option<(u32, f64)>]) -> Self {
        let mut origins = Self::identity(0);
        for (v, place) in place.iter().enumerate() {
            let v = v as u32;
            origins.push(match *place {
                None => vec![(v, 1.0)],
                Some((to, share)) => vec![(v, 1.0 - share), (to, share)],
            });
        }
        origins
    }

    /// Adds a vertex between `a` and `b` of these vertices, at `share` of the way from `a`.
    pub(super) fn push_between(&mut self, [a, b]: [u32; 2], share: f64) {
        let weighted = [(a, 1.0 - share), (b, share)];
        let mixed = mix(weighted.iter().flat_map(|&(v, weight)| {
            let parts = self.of(v as usize).iter();
            parts.map(move |&(u, w)| (u, w * weight))
        }));
        self.push(mixed);
    }

    /// Combines these origins with those of their old vertices in `earlier`. The result refers to
    /// the vertices before `earlier`.
    pub(super) fn after(&self, earlier: &Self) -> Self {
        let mut composed = Self::identity(0);
        for v in 0..self.len() {
            let mixed = mix(self.of(v).iter().flat_map(|&(u, weight)| {
                let parts = earlier.of(u as usize).iter();
                parts.map(move |&(old, w)| (old, w * weight))
            }));
            composed.push(mixed);
        }
        composed
    }

    /// Adds a vertex with these parts.
    pub(super) fn push(&mut self, parts: Vec<(u32, f64)>) {
        self.parts.extend(parts);
        self.first.push(self.parts.len());
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.first.len() - 1
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The old vertices of vertex `v`, and their weights.
    pub fn of(&self, v: usize) -> &[(u32, f64)] {
        &self.parts[self.first[v]..self.first[v + 1]]
    }

    /// Weighted means of `stride` values per old vertex, for each new vertex.
    pub(super) fn interpolate<T>(&self, field: &[T], stride: usize) -> Vec<T>
    where
        T: Copy + Mul<f64, Output = T> + Add<Output = T>,
    {
        let mut values = Vec::with_capacity(self.len() * stride);
        for v in 0..self.len() {
            let [(u, weight), rest @ ..] = self.of(v) else {
                unreachable!("a place has at least one part");
            };
            for k in 0..stride {
                let value = |u: u32| field[u as usize * stride + k];
                let first = value(*u) * *weight;
                values.push(rest.iter().fold(first, |sum, &(u, w)| sum + value(u) * w));
            }
        }
        values
    }
}

/// Adds the weights of equal vertices, in the order of their first appearance.
fn mix(parts: impl Iterator<Item = (u32, f64)>) -> Vec<(u32, f64)> {
    let mut mixed: Vec<(u32, f64)> = Vec::with_capacity(3);
    for (v, weight) in parts {
        match mixed.iter_mut().find(|(u, _)| *u == v) {
            Some((_, sum)) => *sum += weight,
            None => mixed.push((v, weight)),
        }
    }
    mixed
}
