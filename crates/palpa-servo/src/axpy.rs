//! The kernel that takes most of a tick's time. It adds three columns of the compliance matrix,
//! times a force, to the positions.
//!
//! The operations and their order do not depend on wide registers, so the results are equal bit for
//! bit with and without them.

#[cfg(target_arch = "x86_64")]
cpufeatures::new!(has_avx, "avx");

/// `x += c0 f0 + c1 f1 + c2 f2`, over the length of the shortest slice.
pub(crate) fn add_three(x: &mut [f64], columns: [&[f64]; 3], f: [f64; 3]) {
    #[cfg(target_arch = "x86_64")]
    if has_avx::get() {
        #[expect(unsafe_code, reason = "calls what needs a processor feature")]
        // SAFETY: the processor, and the system, were just asked for the feature.
        unsafe {
            return add_three_avx(x, columns, f);
        }
    }
    add_three_plain(x, columns, f);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx")]
fn add_three_avx(x: &mut [f64], columns: [&[f64]; 3], f: [f64; 3]) {
    add_three_plain(x, columns, f);
}

#[inline(always)]
#[expect(
    clippy::inline_always,
    reason = "compiled anew with the features of its caller"
)]
fn add_three_plain(x: &mut [f64], [c0, c1, c2]: [&[f64]; 3], [f0, f1, f2]: [f64; 3]) {
    for (((x, a), b), c) in x.iter_mut().zip(c0).zip(c1).zip(c2) {
        *x += a * f0 + b * f1 + c * f2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_and_plain_agree_to_the_bit() {
        let column =
            |k: usize| core::array::from_fn::<f64, 177, _>(|i| libm::sin((i * (k + 3)) as f64));
        let (a, b, c) = (column(0), column(1), column(2));
        let (mut wide, mut plain) = (column(3), column(3));
        add_three(&mut wide, [&a, &b, &c], [0.3, -1e-3, 7.0]);
        add_three_plain(&mut plain, [&a, &b, &c], [0.3, -1e-3, 7.0]);
        assert_eq!(wide.map(f64::to_bits), plain.map(f64::to_bits));
    }
}
