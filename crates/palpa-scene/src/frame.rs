//! Right-handed frames of three unit vectors.

/// Two directions count as parallel if the component of one across the other is shorter than this.
const PARALLEL: f64 = 1e-6;

/// The frame whose first vector is `first` and whose third is as near to `third` as possible. If
/// both are parallel, any such frame.
pub(crate) fn keeping_first(first: [f64; 3], third: [f64; 3]) -> [[f64; 3]; 3] {
    let third = across(third, first).unwrap_or_else(|| any_across(first));
    [first, cross(third, first), third]
}

/// The frame whose third vector is `third` and whose first is as near to `first` as possible.
/// Without `first`, or if both are parallel, the first vector is as near to x as possible, or to y
/// if `third` is nearly along x.
pub(crate) fn keeping_third(first: Option<[f64; 3]>, third: [f64; 3]) -> [[f64; 3]; 3] {
    let first = first
        .and_then(|first| across(first, third))
        .unwrap_or_else(|| any_across(third));
    [first, cross(third, first), third]
}

/// Unit vector of the part of `v` that is perpendicular to the unit vector `to`; `None` if `v` is
/// parallel to it.
fn across(v: [f64; 3], to: [f64; 3]) -> Option<[f64; 3]> {
    let along = dot(v, to);
    let rest: [f64; 3] = std::array::from_fn(|i| v[i] - along * to[i]);
    let length = dot(rest, rest).sqrt();
    (length > PARALLEL).then(|| rest.map(|x| x / length))
}

fn any_across(to: [f64; 3]) -> [f64; 3] {
    /// If the cosine of the angle to x is larger than this (26°), y is used instead.
    const NEAR_X: f64 = 0.9;
    let start = if to[0].abs() < NEAR_X {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    across(start, to).unwrap_or(start)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
