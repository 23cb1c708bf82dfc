//! The window read at points: four points, three channels together.

use super::bell::WIDEST;
use super::{Fine, Place};
use crate::sh::transform::{Real, Sample};
use steradian_simd::{Arch, Kernel, Vector};

/// Points that are read together: their channels fill the vectors that are summed at once.
const POINTS: usize = 4;

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
        let mut i = 0;
        while i < n {
            let mut values = [T::Short::<A>::splat(T::default()); 3 * POINTS];
            for p in 0..POINTS {
                let at = if i + p < n { i + p } else { n - 1 };
                let rgb = point::<T::Short<A>, T, W>(self.fine, self.fine.place(self.angles[at]));
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
            i += POINTS;
        }
    }
}

/// Three channels at a point, still to be summed over the lanes.
#[inline(always)]
fn point<V: Vector<T = T>, T: Real, const W: usize>(fine: &Fine<T, W>, place: Place<T>) -> [V; 3] {
    let n = W.div_ceil(V::LANES);
    let (wx, wy) = weigh::<V, T, W>(&fine.weights, place);
    let mut down = [T::default(); WIDEST];
    for v in 0..n {
        wy[v].store(&mut down[v * V::LANES..]);
    }
    let mut sums = [[V::splat(T::default()); WIDE]; 3];
    let planes = &fine.grid.planes;
    let mut at = place.start;
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
    for c in 0..3 {
        for v in 0..n {
            rgb[c] = wx[v].fma(sums[c][v], rgb[c]);
        }
    }
    rgb
}

/// The weights of columns and of rows; 0 beyond the window.
#[inline(always)]
fn weigh<V: Vector<T = T>, T: Real, const W: usize>(
    polynomials: &[[T; WIDEST]],
    place: Place<T>,
) -> ([V; WIDE], [V; WIDE]) {
    let n = W.div_ceil(V::LANES);
    let (x, y) = (V::splat(place.x), V::splat(place.y));
    let zero = V::splat(T::default());
    let (mut wx, mut wy) = ([zero; WIDE], [zero; WIDE]);
    for row in polynomials {
        for v in 0..n {
            let p = V::load(&row[v * V::LANES..]);
            wx[v] = wx[v].fma(x, p);
            wy[v] = wy[v].fma(y, p);
        }
    }
    (wx, wy)
}
