//! The window read at points: four points, three channels together.

use super::bell::WIDEST;
use super::{Fine, Place};
use crate::sh::transform::{Real, Sample};
use steradian_simd::{Arch, Kernel, Vector};

/// Points that are read together: their channels fill the vectors that are summed at once.
const POINTS: usize = 4;

/// Points whose weights are found together.
const GROUP: usize = 16;

/// Registers of the widest window, at most.
const WIDE: usize = WIDEST / 4;

/// Values at points given as (θ, φ).
pub(super) struct Read<'a, T, S, const W: usize> {
    pub(super) fine: &'a Fine<T, W>,
    pub(super) angles: &'a [[f64; 2]],
    pub(super) out: [&'a mut [S]; 3],
}

impl<T: Real, S: Sample, const W: usize> Kernel for Read<'_, T, S, W> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let n = self.angles.len();
        let [red, green, blue] = self.out;
        let (red, green, blue) = (&mut red[..n], &mut green[..n], &mut blue[..n]);
        let zero = [[T::default(); WIDEST]; GROUP];
        let (mut starts, mut across, mut down) = ([0; GROUP], zero, zero);
        let mut first = 0;
        while first < n {
            // Weights of a group before its sums: chains of dependent steps side by side.
            for p in 0..GROUP {
                let at = if first + p < n { first + p } else { n - 1 };
                let place = self.fine.place(self.angles[at]);
                starts[p] = place.start;
                let weights = &self.fine.weights;
                weigh::<T::Short<A>, T, W>(weights, place, &mut across[p], &mut down[p]);
            }
            let mut q = 0;
            while q < GROUP && first + q < n {
                let i = first + q;
                let mut values = [T::Short::<A>::splat(T::default()); 3 * POINTS];
                for p in 0..POINTS {
                    let (start, across, down) = (starts[q + p], &across[q + p], &down[q + p]);
                    let rgb = point::<T::Short<A>, T, W>(self.fine, start, across, down);
                    for k in 0..3 {
                        values[3 * p + k] = rgb[k];
                    }
                }
                let mut sums = [0.0; 16];
                T::Short::<A>::add_sums(&values, &mut sums);
                for p in 0..if i + POINTS <= n { POINTS } else { n - i } {
                    red[i + p] = S::from_f64(sums[3 * p]);
                    green[i + p] = S::from_f64(sums[3 * p + 1]);
                    blue[i + p] = S::from_f64(sums[3 * p + 2]);
                }
                q += POINTS;
            }
            first += GROUP;
        }
    }
}

/// Three channels at a point, still to be summed over the lanes.
#[inline(always)]
fn point<V: Vector<T = T>, T: Real, const W: usize>(
    fine: &Fine<T, W>,
    start: usize,
    across: &[T; WIDEST],
    down: &[T; WIDEST],
) -> [V; 3] {
    let n = W.div_ceil(V::LANES);
    let mut sums = [[V::splat(T::default()); WIDE]; 3];
    let planes = &fine.grid.planes;
    let mut at = start;
    for k in 0..W {
        let w = V::splat(down[k]);
        for c in 0..3 {
            let row = &planes[c][at..at + n * V::LANES];
            for v in 0..n {
                sums[c][v] = w.fma(V::load(&row[v * V::LANES..]), sums[c][v]);
            }
        }
        at += fine.grid.stride;
    }
    let mut rgb = [V::splat(T::default()); 3];
    for v in 0..n {
        let w = V::load(&across[v * V::LANES..]);
        for c in 0..3 {
            rgb[c] = w.fma(sums[c][v], rgb[c]);
        }
    }
    rgb
}

/// The weights of columns and of rows; 0 beyond the window.
#[inline(always)]
fn weigh<V: Vector<T = T>, T: Real, const W: usize>(
    polynomials: &[[T; WIDEST]],
    place: Place<T>,
    across: &mut [T; WIDEST],
    down: &mut [T; WIDEST],
) {
    let n = W.div_ceil(V::LANES);
    let (x, y) = (V::splat(place.x), V::splat(place.y));
    let zero = V::splat(T::default());
    let (mut wx, mut wy) = ([zero; WIDE], [zero; WIDE]);
    for k in 0..polynomials.len() {
        for v in 0..n {
            let p = V::load(&polynomials[k][v * V::LANES..]);
            wx[v] = wx[v].fma(x, p);
            wy[v] = wy[v].fma(y, p);
        }
    }
    for v in 0..n {
        wx[v].store(&mut across[v * V::LANES..]);
        wy[v].store(&mut down[v * V::LANES..]);
    }
}
