//! Right-handed frames of three unit vectors, for what is turned in space.

/// Below this cosine's complement two directions are taken for one: nothing can be said of a plane between them.
const PARALLEL: f64 = 1e-6;

/// The frame whose first vector is `first` and whose third is as near to `third` as that lets it; any such frame where
/// both are parallel.
pub(crate) fn keeping_first(first: [f64; 3], third: [f64; 3]) -> [[f64; 3]; 3] {
    let third = across(third, first).unwrap_or_else(|| any_across(first));
    [first, cross(third, first), third]
}

/// The frame whose third vector is `third` and whose first is as near to `first` as that lets it; without `first`, or
/// where both are parallel, as near to x, or to y where `third` is nearly along x.
pub(crate) fn keeping_third(first: Option<[f64; 3]>, third: [f64; 3]) -> [[f64; 3]; 3] {
    let first = first
        .and_then(|first| across(first, third))
        .unwrap_or_else(|| any_across(third));
    [first, cross(third, first), third]
}

/// What of `v` is perpendicular to the unit vector `to`, as a unit vector; `None` where nothing is left.
fn across(v: [f64; 3], to: [f64; 3]) -> Option<[f64; 3]> {
    let along = dot(v, to);
    let rest: [f64; 3] = std::array::from_fn(|i| v[i] - along * to[i]);
    let length = dot(rest, rest).sqrt();
    (length > PARALLEL).then(|| rest.map(|x| x / length))
}

fn any_across(to: [f64; 3]) -> [f64; 3] {
    /// Beyond this angle's cosine (26°) to x, y is taken.
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
