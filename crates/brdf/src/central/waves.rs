//! The first pass of 5.22 over one panel: Σ f_cos cos qφ over its nodes, in registers of nodes.

use super::rule::POINTS;
use steradian_simd::{Arch, Kernel, Vector};

/// Nodes with room for whole registers.
pub(super) const ROOM: usize = POINTS + 1;
/// Orders q whose sums fill the twelve registers that are summed at a time.
const SIDE: usize = 4;
/// Registers of nodes at most.
const MOST: usize = ROOM / 2;

/// Room for the sums of orders up to `q`.
pub(super) fn room(q: usize) -> usize {
    3 * (q + 1).next_multiple_of(SIDE) + 4
}

/// f_cos at the nodes of a panel by channel, times the weights of a rule.
pub(super) type Values = [[f64; ROOM]; 3];

/// Adds Σ values cos qφ to `out[3q + c]` for q ≤ Q; `out` has [`room`] for them.
pub(super) struct Waves<'a> {
    pub cosines: &'a [f64; ROOM],
    pub values: &'a Values,
    pub q: usize,
    pub out: &'a mut [f64],
}

impl Kernel for Waves<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let (lanes, zero) = (A::F64::LANES, A::F64::splat(0.0));
        let (mut before, mut wave) = ([zero; MOST], [A::F64::splat(1.0); MOST]);
        for (k, cosines) in self.cosines.chunks_exact(lanes).enumerate() {
            before[k] = A::F64::load(cosines);
        }
        for first in (0..=self.q).step_by(SIDE) {
            let mut sums = [zero; 12];
            for k in 0..ROOM / lanes {
                let cosine = A::F64::load(&self.cosines[k * lanes..]);
                let twice = cosine.add(cosine);
                let mut values = [zero; 3];
                for c in 0..3 {
                    values[c] = A::F64::load(&self.values[c][k * lanes..]);
                }
                for q in 0..SIDE {
                    for c in 0..3 {
                        sums[3 * q + c] = values[c].fma(wave[k], sums[3 * q + c]);
                    }
                    (before[k], wave[k]) = (wave[k], twice.mul(wave[k]).sub(before[k]));
                }
            }
            if let Some(out) = self.out[3 * first..].first_chunk_mut::<16>() {
                A::F64::add_sums(&sums, out);
            }
        }
    }
}
