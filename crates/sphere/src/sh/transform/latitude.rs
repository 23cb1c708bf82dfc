//! From rows of texels that are constant over their height to samples whose quadrature gives the same
//! integrals.
//!
//! P̄_lm(cos θ) sin θ is a trigonometric polynomial of degree l + 1 in θ, odd about the pole for even m, even
//! for odd m. Extend the row values f of one m, constant in θ over each of the H rows, with the same parity:
//! then ∫ f P̄ sin θ dθ is half of the integral over the whole circle, to which only the Fourier coefficients
//! of f up to degree order + 1 contribute. Those of a step function are exactly
//!
//! β_k = (2/H) sinc(kπ/2H) Σ_j f_j sin kθ_j    (cos for odd m, half of it at k = 0),    θ_j = (j+½)π/H.
//!
//! The sum of these terms alone, at M ≥ order + 2 rings θ_i = (i+½)π/M with weights sin θ_i π/M, has the same
//! integrals against every P̄_lm, since the products' degree is below 2M.
//!
//! Both sine and cosine sums are complex FFTs of the length H, or M, itself (Makhoul 1980, *A fast cosine
//! transform in one and two dimensions*): in the order v_i = f_{2i}, then the odd ones backwards (negated for
//! sines), they are ½ (ω_k V_{−k} + ω̄_k V_k) and (ω_k V_{−k} − ω̄_k V_k)/2i, with ω_k = exp(ikπ/2H). Every
//! lane of a register has its own m.

use super::batch::Batch;
use super::fold::register;
use super::fourier::Lanes;
use super::kernel::{CELL, Real, aligned};
use super::rings::{BLOCK, Rings};
use std::f64::consts::PI;
use steradian_simd::{Arch, Kernel, Vector};

/// Rings to which texels are brought for an order: enough, even, and a length of which FFTs are quick.
pub(super) fn rings(order: usize) -> usize {
    let quick = |n: &usize| [2, 3, 5, 7].iter().fold(*n, |n, p| strip(n, *p)) == 1;
    let least = (order + 2).next_multiple_of(2).max(4);
    (least..).step_by(2).find(quick).unwrap_or(least)
}

/// n without its factors p.
fn strip(mut n: usize, p: usize) -> usize {
    while n.is_multiple_of(p) {
        n /= p;
    }
    n
}

/// A plan for one height and order.
pub(super) struct Latitude<T: Real> {
    order: usize,
    height: usize,
    rings: usize,
    lanes: usize,
    texels: Batch<T>,
    samples: Batch<T>,
    /// For k up to order + 1: ω_k (2/H) sinc(kπ/2H)/4.
    before: Vec<[T; 2]>,
    /// For the same k: exp(ikπ/2M).
    after: Vec<[T; 2]>,
}

/// One worker's sequences.
#[derive(Default)]
pub(super) struct Sequences<T> {
    texels: Vec<T>,
    terms: Vec<T>,
    samples: Vec<T>,
}

impl<T: Real> Latitude<T> {
    pub(super) fn new(order: usize, height: usize) -> Self {
        let rings = rings(order);
        let lanes = steradian_simd::run(Lanes::<T>(std::marker::PhantomData));
        let turn = |k: usize, n: usize, scale: f64| {
            // Reduced exactly first: the period is 4n.
            let (sin, cos) = (0.5 * PI * (k % (4 * n)) as f64 / n as f64).sin_cos();
            [T::of(scale * cos), T::of(scale * sin)]
        };
        let sinc = |k: usize| {
            let x = 0.5 * PI * k as f64 / height as f64;
            if k == 0 { 1.0 } else { x.sin() / x }
        };
        Self {
            order,
            height,
            rings,
            lanes,
            texels: Batch::new(height),
            samples: Batch::new(rings),
            before: (0..order + 2).map(|k| turn(k, height, 0.5 * sinc(k) / height as f64)).collect(),
            after: (0..order + 2).map(|k| turn(k, rings, 1.0)).collect(),
        }
    }

    /// Rings.
    pub(super) fn rings(&self) -> usize {
        self.rings
    }

    /// Groups of orders m of one parity that are transformed together.
    fn groups(&self) -> usize {
        (self.order / 2 + 1).div_ceil(self.lanes)
    }

    /// Numbers that the rings' cells of one m take.
    fn stride(&self) -> usize {
        (self.rings / 2).div_ceil(BLOCK) * CELL
    }

    /// Where the cells of m begin in the output.
    pub(super) fn place(&self, m: usize) -> usize {
        (m % 2 * self.groups() * self.lanes + m / 2) * self.stride()
    }

    /// The output's groups.
    pub(super) fn split<'a>(&self, out: &'a mut Vec<T>) -> Vec<&'a mut [T]> {
        let group = self.lanes * self.stride();
        aligned(out, 2 * self.groups() * group).chunks_exact_mut(group).collect()
    }

    /// The output as one.
    pub(super) fn cells<'a>(&self, out: &'a mut Vec<T>) -> &'a [T] {
        aligned(out, 2 * self.groups() * self.lanes * self.stride())
    }

    /// The rings' cells of a group from cells [block of rows][m] of sums and differences of rows and their
    /// mirrors.
    pub(super) fn resample(
        &self,
        group: usize,
        rings: &Rings,
        cells: &[T],
        out: &mut [T],
        buffers: &mut Sequences<T>,
    ) {
        let (groups, lanes) = (self.groups(), self.lanes);
        let (parity, first) = (group / groups, 2 * lanes * (group % groups) + group / groups);
        let Sequences { texels, terms, samples } = buffers;
        let texels = aligned(texels, 2 * lanes * self.height);
        let terms = aligned(terms, 2 * lanes * (self.order + 2));
        let samples = aligned(samples, 2 * lanes * self.rings);
        for channel in 0..3 {
            steradian_simd::run(Gather { plan: self, parity, first, channel, cells, x: &mut *texels });
            self.texels.forward(texels);
            steradian_simd::run(Terms { plan: self, parity, texels, terms, samples });
            self.samples.backward(samples);
            steradian_simd::run(Scatter { plan: self, parity, channel, rings, x: &mut *samples, out });
        }
    }
}

/// Where row `j` of `n` stands in a sequence, and whether it is one of those that sines negate.
#[inline(always)]
fn place(j: usize, n: usize) -> (usize, bool) {
    if j.is_multiple_of(2) { (j / 2, false) } else { ((2 * n - 1 - j) / 2, true) }
}

/// Rows of texels of one channel as sequences, a lane for each m.
struct Gather<'a, T: Real> {
    plan: &'a Latitude<T>,
    parity: usize,
    /// The first lane's m.
    first: usize,
    channel: usize,
    cells: &'a [T],
    x: &'a mut [T],
}

impl<T: Real> Kernel for Gather<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        match T::Vector::<A>::LANES {
            2 => self.tiles::<A, 2>(),
            4 => self.tiles::<A, 4>(),
            8 => self.tiles::<A, 8>(),
            _ => self.tiles::<A, BLOCK>(),
        }
    }
}

impl<T: Real> Gather<'_, T> {
    #[inline(always)]
    fn tiles<A: Arch, const N: usize>(self) {
        let Latitude { order, height, .. } = *self.plan;
        let x = T::Vector::<A>::view(self.x).as_chunks_mut::<2>().0;
        let zero = T::Vector::<A>::splat(T::default());
        let sign = if self.parity == 0 { -1.0 } else { 1.0 };
        let half = T::Vector::<A>::splat(T::of(0.5));
        let odd = T::Vector::<A>::splat(T::of(sign));
        for ring in (0..height.div_ceil(2)).step_by(N) {
            let from = ring / BLOCK * (order + 1) * CELL + ring % BLOCK;
            // Cosine and sine sums, of the sum and of the difference of a row and its mirror.
            let mut parts = [[zero; N]; 4];
            for (part, x) in parts.iter_mut().enumerate() {
                for lane in 0..N {
                    let m = self.first + 2 * lane;
                    if m <= order {
                        let at = from + m * CELL + (3 * part + self.channel) * BLOCK;
                        x[lane] = T::Vector::<A>::load(&self.cells[at..]);
                    }
                }
                T::Vector::<A>::transpose(x);
            }
            let [sum, difference] = [[parts[0], parts[1]], [parts[2], parts[3]]];
            for k in 0..N.min(height.div_ceil(2) - ring) {
                let (north, south) = (ring + k, height - 1 - ring - k);
                let (to, negated) = place(north, height);
                for c in 0..2 {
                    let v = sum[c][k].add(difference[c][k]).mul(half);
                    x[to][c] = if negated { v.mul(odd) } else { v };
                }
                // The equator's row has no mirror: its difference is its sum.
                if south > north {
                    let (to, negated) = place(south, height);
                    for c in 0..2 {
                        let v = sum[c][k].sub(difference[c][k]).mul(half);
                        x[to][c] = if negated { v.mul(odd) } else { v };
                    }
                }
            }
        }
    }
}

/// Spectra of texels to spectra of samples.
struct Terms<'a, T: Real> {
    plan: &'a Latitude<T>,
    parity: usize,
    texels: &'a mut [T],
    terms: &'a mut [T],
    samples: &'a mut [T],
}

impl<T: Real> Kernel for Terms<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let (plan, last) = (self.plan, self.plan.order + 1);
        let v = &*T::Vector::<A>::view(self.texels).as_chunks_mut::<2>().0;
        let terms = T::Vector::<A>::view(self.terms).as_chunks_mut::<2>().0;
        let u = T::Vector::<A>::view(self.samples).as_chunks_mut::<2>().0;
        let (height, places) = (plan.height, plan.texels.places());
        let zero = T::Vector::<A>::splat(T::default());
        let sign = T::Vector::<A>::splat(T::of(if self.parity == 0 { -1.0 } else { 1.0 }));
        for k in 0..=last {
            let [c, s] = plan.before[k].map(T::Vector::<A>::splat);
            let plus = v[places[k % height] as usize];
            let minus = v[places[(height - k % height) % height] as usize];
            // ω V_{−k} ± ω̄ V_k.
            let (sum, difference) = (
                [sign.fma(plus[0], minus[0]), sign.fma(plus[1], minus[1])],
                [minus[0].sub(sign.mul(plus[0])), minus[1].sub(sign.mul(plus[1]))],
            );
            terms[k] = [c.mul(sum[0]).sub(s.mul(difference[1])), c.mul(sum[1]).add(s.mul(difference[0]))];
        }
        let (rings, places) = (plan.rings, plan.samples.places());
        for k in 0..rings {
            let mut out = [zero; 2];
            if k <= last {
                // ± w̄ β_k
                let ([c, s], t) = (plan.after[k].map(T::Vector::<A>::splat), terms[k]);
                let w = [c.mul(t[0]).add(s.mul(t[1])), c.mul(t[1]).sub(s.mul(t[0]))];
                out = w.map(|w| w.mul(sign));
            }
            let mirror = rings - k;
            if mirror <= last {
                let ([c, s], t) = (plan.after[mirror].map(T::Vector::<A>::splat), terms[mirror]);
                out[0] = out[0].add(c.mul(t[0]).sub(s.mul(t[1])));
                out[1] = out[1].add(c.mul(t[1]).add(s.mul(t[0])));
            }
            u[places[k] as usize] = out.map(|x| x.mul(sign));
        }
    }
}

/// Sequences of samples of one channel to the rings' cells, weighted.
struct Scatter<'a, T: Real> {
    plan: &'a Latitude<T>,
    parity: usize,
    channel: usize,
    rings: &'a Rings,
    x: &'a mut [T],
    out: &'a mut [T],
}

impl<T: Real> Kernel for Scatter<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        match T::Vector::<A>::LANES {
            2 => self.tiles::<A, 2>(),
            4 => self.tiles::<A, 4>(),
            8 => self.tiles::<A, 8>(),
            _ => self.tiles::<A, BLOCK>(),
        }
    }
}

impl<T: Real> Scatter<'_, T> {
    #[inline(always)]
    fn tiles<A: Arch, const N: usize>(self) {
        let (rings, stride) = (self.plan.rings, self.plan.stride());
        let x = &*T::Vector::<A>::view(self.x).as_chunks_mut::<2>().0;
        let zero = T::Vector::<A>::splat(T::default());
        let odd = T::Vector::<A>::splat(T::of(if self.parity == 0 { -1.0 } else { 1.0 }));
        let read = |j: usize, c: usize| {
            let (at, negated) = place(j, rings);
            if negated { x[at][c].mul(odd) } else { x[at][c] }
        };
        for ring in (0..stride / CELL * BLOCK).step_by(N) {
            let mut parts = [[zero; N]; 4];
            for k in 0..N.min((rings / 2).saturating_sub(ring)) {
                for c in 0..2 {
                    let (north, south) = (read(ring + k, c), read(rings - 1 - ring - k, c));
                    parts[c][k] = north.add(south);
                    parts[2 + c][k] = north.sub(south);
                }
            }
            let mut factors = self.rings.halves(ring);
            factors.iter_mut().flatten().for_each(|f| *f *= 2.0);
            for (part, x) in parts.iter_mut().enumerate() {
                T::Vector::<A>::transpose(x);
                let factor = register::<A, T>(&factors[part / 2]);
                for lane in 0..N {
                    let at = lane * stride + ring / BLOCK * CELL;
                    let at = at + (3 * part + self.channel) * BLOCK + ring % BLOCK;
                    x[lane].mul(factor).store(&mut self.out[at..]);
                }
            }
        }
    }
}
