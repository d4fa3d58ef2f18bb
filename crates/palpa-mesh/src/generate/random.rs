//! Random numbers for irregular meshes, the same on every machine.
//!
//! The generator is written out here, and again in `palpa-device/src/path/tremor.rs`: a library's
//! may draw other numbers in its next version, which would change recorded figures, and neither
//! crate depends on the other.

/// The generator `SplitMix64` (Steele, Lea & Flood 2014).
#[derive(Debug)]
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A uniform number between −1 and 1.
    pub(super) fn both_ways(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A random boolean; both values are equally likely.
    pub(super) fn coin(&mut self) -> bool {
        self.bits() >> 63 == 1
    }
}
