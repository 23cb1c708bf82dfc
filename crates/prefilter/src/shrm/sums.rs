//! The sum over bands: cells S_m(α) of every map, for one m and a block of rings.
//!
//! With coefficients k_l c_lm of the product, (5.24) of Ramamoorthi & Hanrahan 2002 reads, in real form,
//! B_q(α, β) = Σ_m S^c_m cos mβ + S^s_m sin mβ with
//!
//! ```text
//! +q:  S^c_m = Σ_l u⁺ k_l c_lm,     S^s_m = Σ_l u⁺ k_l c_l,−m
//! −q:  S^c_m = −Σ_l u⁻ k_l c_l,−m,  S^s_m = Σ_l u⁻ k_l c_lm
//! ```
//!
//! Bands of even and odd l + m are summed apart: the southern ring at π − α is ±(−1)^q times their
//! difference.

use super::recursion::{Column, RINGS};
use steradian_simd::{Arch, Kernel, Vector};

/// Numbers of a cell of one map: cosine and sine, three channels, north and south.
pub(super) const CELL: usize = 12;

/// Cells of one term from one column: of q alone where q = 0, of +q, then −q otherwise.
pub(super) struct Accumulate<'a> {
    pub(super) m: usize,
    pub(super) q: usize,
    pub(super) column: &'a Column,
    /// Products k_l c_lm and k_l c_l,−m, three channels each, by l from max(m, q).
    pub(super) products: &'a [[f64; 6]],
    /// The maps' cells, [map][number][ring]; numbers of a map are `stride` apart.
    pub(super) cells: &'a mut [f64],
    pub(super) stride: usize,
}

/// Sums of the bands of each parity, that of the first band first.
type Both<V> = [[V; 6]; 2];

impl Kernel for Accumulate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(mut self) {
        let start = self.column.first - self.m.max(self.q);
        let products = self.products.get(start..).unwrap_or(&[]);
        let parts = if self.q > 0 { 2 } else { 1 };
        // Six sums of two parities: two registers of rings at a time where there are registers enough.
        let lanes = A::F64::LANES;
        let wide = A::F64::REGISTERS >= 32 && 2 * lanes <= RINGS;
        for part in 0..parts {
            let mut ring = 0;
            while ring < RINGS {
                let rows = self.column.rows.get(part * RINGS + ring..).unwrap_or(&[]);
                if wide {
                    let [a, b] = over_bands::<A::F64, 2>(rows, parts * RINGS, products);
                    self.store(part, ring, a);
                    self.store(part, ring + lanes, b);
                    ring += 2 * lanes;
                } else {
                    let [a] = over_bands::<A::F64, 1>(rows, parts * RINGS, products);
                    self.store(part, ring, a);
                    ring += lanes;
                }
            }
        }
    }
}

impl Accumulate<'_> {
    #[inline(always)]
    fn store<V: Vector<T = f64>>(&mut self, part: usize, ring: usize, sums: Both<V>) {
        let odd_first = (self.column.first + self.m) % 2 == 1;
        let [even, odd] = if odd_first { [sums[1], sums[0]] } else { sums };
        let mirrored = (self.q % 2 == 1) != (part == 1);
        let (minus, south) = (V::splat(-1.0), V::splat(if mirrored { -1.0 } else { 1.0 }));
        for c in 0..6 {
            // −q takes the sine's sums for its cosine, negative, and the cosine's for its sine.
            let (number, sign) = match (part, c < 3) {
                (0, _) => (c, 1.0),
                (_, true) => (CELL / 2 + c + 3, 1.0),
                (_, false) => (CELL / 2 + c - 3, -1.0),
            };
            let sign = V::splat(sign);
            let north = even[c].add(odd[c]).mul(sign);
            let south = odd[c].fma(minus, even[c]).mul(south).mul(sign);
            let at = 2 * number * self.stride + ring;
            north.store(&mut self.cells[at..]);
            south.store(&mut self.cells[at + self.stride..]);
        }
    }
}

/// Σ over rows of u · products, in N registers of rings.
#[inline(always)]
fn over_bands<V: Vector<T = f64>, const N: usize>(
    rows: &[f64],
    stride: usize,
    products: &[[f64; 6]],
) -> [Both<V>; N] {
    let mut sums = [[[V::splat(0.0); 6]; 2]; N];
    let mut k = 0;
    while k + 1 < products.len() {
        for parity in 0..2 {
            let p = &products[k + parity];
            for v in 0..N {
                let u = V::load(&rows[(k + parity) * stride + v * V::LANES..]);
                for c in 0..6 {
                    sums[v][parity][c] = u.fma(V::splat(p[c]), sums[v][parity][c]);
                }
            }
        }
        k += 2;
    }
    if k < products.len() {
        for v in 0..N {
            let u = V::load(&rows[k * stride + v * V::LANES..]);
            for c in 0..6 {
                sums[v][0][c] = u.fma(V::splat(products[k][c]), sums[v][0][c]);
            }
        }
    }
    sums
}
