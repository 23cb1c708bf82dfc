//! Point sets in the unit square, and a small random number generator.

use glam::DVec2;

/// Roberts' R2 sequence (2018): the multiples of (1/g, 1/g²) modulo 1, with g³ = g + 1; any prefix is spread
/// evenly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct R2 {
    /// Shift of the whole sequence, for randomisation; (½, ½) where nothing else is wanted.
    pub shift: DVec2,
}

impl Default for R2 {
    fn default() -> Self {
        Self { shift: DVec2::splat(0.5) }
    }
}

impl R2 {
    /// The point of index `k`.
    pub fn point(&self, k: u32) -> DVec2 {
        // Root of g³ = g + 1 (Roberts 2018).
        const G: f64 = 1.324_717_957_244_746;
        let k = f64::from(k);
        DVec2::new((self.shift.x + k / G).fract(), (self.shift.y + k / (G * G)).fract())
    }
}

/// Point k of the n-point Hammersley set: (k/n, the bits of k mirrored about the binary point).
pub fn hammersley(k: u32, n: u32) -> DVec2 {
    DVec2::new(f64::from(k) / f64::from(n.max(1)), f64::from(k.reverse_bits()) / 4294967296.0)
}

/// O'Neill's PCG-XSH-RR 64/32 (2014): small, fast, the same numbers on every machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pcg32 {
    state: u64,
    increment: u64,
}

impl Pcg32 {
    /// The generator of a seed and a stream; different streams are independent.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut out = Self { state: 0, increment: (stream << 1) | 1 };
        out.next_u32();
        out.state = out.state.wrapping_add(seed);
        out.next_u32();
        out
    }

    /// The next 32 bits.
    pub fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6364136223846793005).wrapping_add(self.increment);
        ((((old >> 18) ^ old) >> 27) as u32).rotate_right((old >> 59) as u32)
    }

    /// Uniform in [0, 1), in steps of 2⁻⁵³.
    pub fn next_f64(&mut self) -> f64 {
        let bits = (u64::from(self.next_u32()) << 21) ^ (u64::from(self.next_u32()) >> 11);
        bits as f64 / (1u64 << 53) as f64
    }
}
