//! Random numbers with a separate seed for every sample.

use glam::DVec2;

/// SplitMix64 (Steele, Lea, Flood 2014, Fast Splittable Pseudorandom Number Generators, fig. 17).
#[derive(Debug, Clone)]
pub(super) struct Random(u64);

/// What the state advances by: 2⁶⁴ over the golden ratio, odd.
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Random {
    /// The stream of sample `sample` of pixel `pixel`.
    pub fn new(seed: u64, pixel: u64, sample: u64) -> Self {
        let s = mix(seed.wrapping_add(GAMMA));
        Self(mix(mix(s ^ pixel.wrapping_mul(GAMMA)).wrapping_add(sample.wrapping_mul(GAMMA))))
    }

    /// Uniform in [0, 1).
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(GAMMA);
        (mix(self.0) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Two numbers, uniform in [0, 1).
    pub fn pair(&mut self) -> DVec2 {
        DVec2::new(self.next(), self.next())
    }
}
