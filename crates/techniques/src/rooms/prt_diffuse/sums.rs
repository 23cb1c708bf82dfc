//! Σ_i L_i t_i at every site: the frame of a light that turns.

use super::normals::HARMONICS;
use crate::shared::geometry::grouped::{GROUP, Grouped, Groups};
use crate::shared::maths::number::Number;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Vector, prefetch, run};

/// Groups of sites in a task of a thread.
const BLOCK: usize = 64;

/// Radiance of the sites of a group, by channel.
pub type GroupRadiance = [[f32; GROUP]; 3];

/// Layout of a site's vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Form {
    /// Coefficients of a vector.
    pub(super) n: usize,
    /// Vectors of reflected light: none, one, or one for each channel.
    pub(super) reflected: usize,
    /// Do vectors for other normals follow?
    pub(super) normals: bool,
}

impl Form {
    pub(super) fn of(bands: usize, stride: usize, normals: bool) -> Self {
        let n = bands * bands;
        let more = if normals { 1 + HARMONICS } else { 1 };
        Self { n, reflected: (stride / n.max(1)).saturating_sub(more), normals }
    }

    /// First number of the vectors of other normals.
    pub(super) fn by_normal(self) -> usize {
        (1 + self.reflected) * self.n
    }
}

/// Operands of the sums: some vectors of a site, and the light.
#[derive(Clone, Copy)]
pub struct Sums<'a> {
    /// Layout of the vectors.
    pub form: Form,
    /// Direct light, and the light that surfaces reflect.
    pub light: &'a [Vec<[f32; 3]>; 2],
    /// The vectors of all sites.
    pub vectors: &'a Grouped,
    /// Offset, within a site's numbers, of the first vector that is summed.
    pub first: usize,
}

impl Sums<'_> {
    /// Writes the sums of each group of sites, one in `step` elements of `out` from the one at `at`.
    pub fn write(self, out: &mut [GroupRadiance], step: usize, at: usize) {
        let block = |(k, out): (usize, &mut [GroupRadiance])| {
            run(Block { sums: self, group: k * BLOCK, out, step, at });
        };
        out.par_chunks_mut(BLOCK * step).enumerate().for_each(block);
    }
}

struct Block<'a> {
    sums: Sums<'a>,
    /// The first group.
    group: usize,
    out: &'a mut [GroupRadiance],
    step: usize,
    at: usize,
}

impl Kernel for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Sums { form, light, vectors, first } = self.sums;
        let light = [&light[0][..form.n], if form.reflected > 0 { &light[1][..form.n] } else { &[] }];
        let first = first * GROUP;
        for (k, out) in self.out.chunks_exact_mut(self.step).enumerate() {
            let out = &mut out[self.at];
            match vectors.groups(self.group + k) {
                Groups::Single(v) => group::<A, f32>(form, &v[first..], vectors.stride(), light, out),
                Groups::Half(v) => group::<A, u16>(form, &v[first..], vectors.stride(), light, out),
            }
        }
    }
}

/// The sums of the first group of sites of `numbers`, which have `stride` each. Two sums of each channel run
/// side by side, of two registers of sites, or where one register holds the group, of even and odd
/// coefficients: one alone would wait for its last product.
#[inline(always)]
fn group<A: Arch, T: Number>(
    form: Form,
    numbers: &[T],
    stride: usize,
    light: [&[[f32; 3]]; 2],
    out: &mut GroupRadiance,
) {
    let (n, lanes, whole) = (form.n, A::F32::LANES, A::F32::LANES == GROUP);
    let all = &numbers[..(1 + form.reflected) * n * GROUP];
    // Vectors are prefetched two groups ahead: of 100,000 sites with reflected light in three channels of 16
    // bits, 20 MB, 139 to 156 million a second are summed so (AVX-512), 78 to 111 without, 117 to 140 one
    // group ahead and 92 to 136 four.
    for at in (0..all.len()).step_by(64 / size_of::<T>()) {
        prefetch(numbers, 2 * stride * GROUP + at);
    }
    let (direct, reflected) = all.split_at(n * GROUP);
    let mut lane = 0;
    while lane < GROUP {
        let mut l = [[A::F32::splat(0.0); 3]; 2];
        if whole {
            add_whole::<A, T>(direct, light[0], &mut l);
        } else {
            add_two::<A, T>(direct, light[0], lane, &mut l);
        }
        match (form.reflected, whole) {
            (0, _) => {}
            (1, true) => add_whole::<A, T>(reflected, light[1], &mut l),
            (1, false) => add_two::<A, T>(reflected, light[1], lane, &mut l),
            _ => add_channels::<A, T>(reflected, light[1], lane, &mut l),
        }
        for c in 0..3 {
            if whole {
                l[0][c].add(l[1][c]).store(&mut out[c]);
            } else {
                l[0][c].store(&mut out[c][lane..]);
                l[1][c].store(&mut out[c][lane + lanes..]);
            }
        }
        lane += if whole { lanes } else { 2 * lanes };
    }
}

/// Adds vectors times the light of three channels, of registers at `lane` and behind it.
#[inline(always)]
fn add_two<A: Arch, T: Number>(t: &[T], light: &[[f32; 3]], lane: usize, l: &mut [[A::F32; 3]; 2]) {
    for (t, light) in t.chunks_exact(GROUP).zip(light) {
        let t = [T::load::<A::F32>(&t[lane..]), T::load::<A::F32>(&t[lane + A::F32::LANES..])];
        for c in 0..3 {
            let light = A::F32::splat(light[c]);
            l[0][c] = t[0].fma(light, l[0][c]);
            l[1][c] = t[1].fma(light, l[1][c]);
        }
    }
}

/// The sums by registers that hold a whole group, of even and of odd coefficients separately.
#[inline(always)]
fn add_whole<A: Arch, T: Number>(t: &[T], light: &[[f32; 3]], l: &mut [[A::F32; 3]; 2]) {
    let mut pairs = t.chunks_exact(2 * GROUP);
    for (t, light) in pairs.by_ref().zip(light.chunks_exact(2)) {
        for k in 0..2 {
            let t = T::load::<A::F32>(&t[k * GROUP..]);
            for c in 0..3 {
                l[k][c] = t.fma(A::F32::splat(light[k][c]), l[k][c]);
            }
        }
    }
    if let Some(light) = light.chunks_exact(2).remainder().first() {
        let t = T::load::<A::F32>(pairs.remainder());
        for c in 0..3 {
            l[0][c] = t.fma(A::F32::splat(light[c]), l[0][c]);
        }
    }
}

/// Adds vectors of each channel times its light, in the order of the two above.
#[inline(always)]
fn add_channels<A: Arch, T: Number>(t: &[T], light: &[[f32; 3]], lane: usize, l: &mut [[A::F32; 3]; 2]) {
    let (lanes, channel) = (A::F32::LANES, light.len() * GROUP);
    let (red, rest) = t.split_at(channel);
    let (green, blue) = rest.split_at(channel);
    let [mut even, mut odd] = *l;
    if lanes == GROUP {
        // Sums stay in registers only where no index chooses between them.
        let mut pairs = light.chunks_exact(2);
        let vectors = red.chunks_exact(2 * GROUP).zip(green.chunks_exact(2 * GROUP));
        for (light, ((r, g), b)) in pairs.by_ref().zip(vectors.zip(blue.chunks_exact(2 * GROUP))) {
            for (c, t) in [r, g, b].into_iter().enumerate() {
                even[c] = T::load::<A::F32>(t).fma(A::F32::splat(light[0][c]), even[c]);
                odd[c] = T::load::<A::F32>(&t[GROUP..]).fma(A::F32::splat(light[1][c]), odd[c]);
            }
        }
        if let Some(light) = pairs.remainder().first() {
            for (c, t) in [red, green, blue].into_iter().enumerate() {
                even[c] = T::load::<A::F32>(&t[channel - GROUP..]).fma(A::F32::splat(light[c]), even[c]);
            }
        }
    } else {
        let vectors = red.chunks_exact(GROUP).zip(green.chunks_exact(GROUP));
        for (light, ((r, g), b)) in light.iter().zip(vectors.zip(blue.chunks_exact(GROUP))) {
            for (c, t) in [r, g, b].into_iter().enumerate() {
                let light = A::F32::splat(light[c]);
                even[c] = T::load::<A::F32>(&t[lane..]).fma(light, even[c]);
                odd[c] = T::load::<A::F32>(&t[lane + lanes..]).fma(light, odd[c]);
            }
        }
    }
    *l = [even, odd];
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::on_every_isa;

    /// Sums by registers are those in f64, of all bands, in both precisions, of vectors with and without
    /// reflected light and others behind them, and of numbers of sites that fill no group.
    #[test]
    fn registers_sum_what_the_formula_says() {
        let number = |k: usize| ((k as f64 * 0.754_877_666).fract() - 0.5) as f32;
        on_every_isa(|| {
            for (bands, reflected) in (1..=6).flat_map(|b| [0, 1, 3].map(|r| (b, r))) {
                let n = bands * bands;
                let (first, stride) = (3, 3 + (1 + reflected) * n + 2);
                let form = Form { n, reflected, normals: false };
                let light = [0, 1].map(|of: usize| {
                    (0..n).map(|i| [0, 1, 2].map(|c| number(1000 * of + 3 * i + c))).collect::<Vec<_>>()
                });
                for (sites, halves) in [(1, true), (7, false), (16, true), (BLOCK * GROUP + 5, false)] {
                    let data: Vec<f32> = (0..sites * stride).map(|k| number(7 * k)).collect();
                    let vectors = Grouped::from_sites(stride, &data, halves);
                    let mut out = vec![[[f32::NAN; GROUP]; 3]; 2 * sites.div_ceil(GROUP)];
                    Sums { form, light: &light, vectors: &vectors, first }.write(&mut out, 2, 1);
                    for (s, t) in data.chunks(stride).enumerate() {
                        for c in 0..3 {
                            let term = |of: usize, at: usize| -> f64 {
                                let pairs = light[of].iter().zip(&t[first + at * n..]);
                                pairs.map(|(l, t)| f64::from(l[c]) * f64::from(*t)).sum()
                            };
                            let exact = term(0, 0)
                                + match reflected {
                                    0 => 0.0,
                                    1 => term(1, 1),
                                    _ => term(1, 1 + c),
                                };
                            let got = f64::from(out[2 * (s / GROUP) + 1][c][s % GROUP]);
                            let within = if halves { 2e-3 } else { 1e-5 };
                            assert!(
                                (got - exact).abs() < within,
                                "{bands} {reflected} {sites} {s}: {got} {exact}"
                            );
                            assert!(out[2 * (s / GROUP)][c][s % GROUP].is_nan());
                        }
                    }
                }
            }
        });
    }
}
