//! A kernel tabulated over the squared chord, with nodes dense where the kernel varies fast.
//!
//! Nodes are evenly spaced within each octave of t = 1 + chord²/width²: their index is the exponent and the
//! leading digits of t as a float, and the digits after them are the weight of the next node. Kernels vary
//! with t over t, so with 256 nodes an octave the error is about 1e-6 of the kernel near its peak, and 1e-4
//! of its value far out.

use crate::Zonal;

/// Mantissa digits that count nodes.
const DIGITS: u32 = 8;
/// Mantissa digits of a float that are the weight of the next node.
const SHIFT: u32 = 23 - DIGITS;
/// Index of t = 1, at the axis: the nodes before it are not stored.
const FIRST: usize = (1.0_f32.to_bits() >> SHIFT) as usize;

/// K over chord² = 2 − 2 cos θ.
pub(super) struct Table {
    values: Vec<f32>,
    scale: f64,
    /// Largest chord² in the table.
    pub reach2: f64,
}

impl Table {
    /// The kernel up to `angle`, radians.
    pub fn new(kernel: &dyn Zonal, angle: f64) -> Self {
        let chord = 2.0 * (0.5 * angle).sin();
        let scale = kernel.width().max(1e-6).powi(-2);
        let last = ((1.0 + chord * chord * scale) as f32).to_bits() >> SHIFT;
        let node = |i: usize| {
            let t = f64::from(f32::from_bits(((FIRST + i) as u32) << SHIFT));
            kernel.value((1.0 - 0.5 * (t - 1.0) / scale).max(-1.0)) as f32
        };
        let count = last as usize - FIRST + 2;
        Self { values: (0..count).map(node).collect(), scale, reach2: chord * chord }
    }

    /// K at chord² 0 … `reach2`.
    #[inline(always)]
    pub fn at(&self, chord2: f64) -> f64 {
        let bits = ((1.0 + chord2.max(0.0) * self.scale) as f32).to_bits();
        let i = ((bits >> SHIFT) as usize - FIRST).min(self.values.len() - 2);
        let between = (bits & ((1 << SHIFT) - 1)) as f32 * (1.0 / (1 << SHIFT) as f32);
        let (a, b) = (self.values[i], self.values[i + 1]);
        f64::from(a + (b - a) * between)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;

    #[test]
    fn the_table_is_the_kernel() {
        for (kernel, angle) in [(Lobe::phong(225.0), 0.3), (Lobe::ggx(0.01), 1.5), (Lobe::lambert(), 1.57)] {
            let (table, peak) = (Table::new(&kernel, angle), kernel.value(1.0));
            for k in 0..=1000 {
                let chord2 = table.reach2 * (f64::from(k) / 1000.0).powi(3);
                let (a, b) = (table.at(chord2), kernel.value(1.0 - 0.5 * chord2));
                assert!((a - b).abs() < 2e-4 * b + 1e-6 * peak, "{kernel:?} {chord2}: {a} {b}");
            }
        }
    }
}
