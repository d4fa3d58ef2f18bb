//! Reads the results that CalculiX computed from a deck.

use palpa_mesh::Vec3;

/// The force of the tool on the body at one result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchForce {
    /// Share of the travel, 0 to 1.
    pub share: f64,
    /// Force that holds the patch in its place, N.
    pub force: Vec3,
}

/// The forces on the patch in the text of a `.dat` file, in the order of the file. Other content is
/// skipped.
pub fn patch_forces(dat: &str) -> Vec<PatchForce> {
    const BEFORE: &str = "total force (fx,fy,fz) for set PATCH and time";
    let mut forces = Vec::new();
    let mut lines = dat.lines().map(str::trim).filter(|line| !line.is_empty());
    while let Some(line) = lines.next() {
        let Some(share) = line.strip_prefix(BEFORE).and_then(number) else {
            continue;
        };
        let numbers: Option<Vec<f64>> = lines
            .next()
            .map(|line| line.split_whitespace().map(number).collect())
            .unwrap_or_default();
        if let Some(&[x, y, z]) = numbers.as_deref() {
            let force = Vec3::new(x, y, z);
            forces.push(PatchForce { share, force });
        }
    }
    forces
}

/// Reads a number as Fortran writes it: without the E if the exponent has three digits.
fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    text.parse().ok().or_else(|| {
        let (mantissa, exponent) = text.split_at(text.rfind(['+', '-'])?);
        format!("{mantissa}E{exponent}").parse().ok()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_read_as_calculix_writes_them() {
        let dat = "
 total force (fx,fy,fz) for set PATCH and time  0.5000000E+00

       -1.494031E-16 -2.844947-101 -1.310799E+00

 total force (fx,fy,fz) for set BASE and time  0.5000000E+00

        1.663166E-16  4.531965E-16  1.310799E+00

 total force (fx,fy,fz) for set PATCH and time  0.1000000E+01

        1.000000E-03  2.000000E+00  *************
";
        assert_eq!(
            patch_forces(dat),
            [PatchForce {
                share: 0.5,
                force: Vec3::new(-1.494031e-16, -2.844947e-101, -1.310799)
            }]
        );
    }
}
