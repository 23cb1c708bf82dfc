//! Σ_i L_i t_i at every site, by registers: the frame of a light that turns.

use super::normals::HARMONICS;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Vector, run};

/// Coefficients of a vector at most (6 bands).
const MOST: usize = 36;
/// The same in registers of up to [`WIDEST`] lanes, of which the last may overlap the one before.
const LAID: usize = 48;
/// Lanes of the widest register.
const WIDEST: usize = 16;
/// Sites that are one task of a thread.
const BLOCK: usize = 1024;

/// What the vectors of a site are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Form {
    /// Coefficients of a vector.
    pub(super) n: usize,
    /// Vectors of reflected light: none, one, or one for each channel.
    pub(super) reflected: usize,
    /// Are there vectors of other normals behind them?
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

/// What is summed: of which vectors of a site, with which light.
#[derive(Clone, Copy)]
pub struct Sums<'a> {
    /// What the vectors are.
    pub form: Form,
    /// Light that arrives straight, and such as is reflected.
    pub light: &'a [Vec<[f32; 3]>; 2],
    /// The vectors of all sites.
    pub data: &'a [f32],
    /// Numbers of a site.
    pub stride: usize,
    /// Its first that counts.
    pub first: usize,
}

impl Sums<'_> {
    /// Writes the sums of the sites, one in `step` numbers of `out` from the one at `at`.
    pub fn write(self, out: &mut [[f32; 3]], step: usize, at: usize) {
        let sites = self.data.par_chunks(BLOCK * self.stride);
        let tasks = out.par_chunks_mut(BLOCK * step).zip(sites);
        tasks.for_each(|(out, data)| run(Block { sums: Sums { data, ..self }, out, step, at }));
    }
}

struct Block<'a> {
    sums: Sums<'a>,
    out: &'a mut [[f32; 3]],
    step: usize,
    at: usize,
}

/// A light by channel, such that register k holds the coefficients from [`Steps::starts`] on that no earlier one holds.
type Laid = [[f32; LAID]; 3];

/// Where registers of a vector begin.
struct Steps {
    starts: [usize; MOST],
    count: usize,
}

impl Steps {
    #[inline(always)]
    fn new(n: usize, lanes: usize) -> Self {
        let mut starts = [0; MOST];
        let mut count = 0;
        while count * lanes < n {
            // The last one ends with the vector, whose other side is the next one's.
            starts[count] = (count * lanes).min(n.saturating_sub(lanes));
            count += 1;
        }
        Self { starts, count }
    }

    #[inline(always)]
    fn lay(&self, light: &[[f32; 3]], lanes: usize) -> Laid {
        let mut laid = [[0.0; LAID]; 3];
        for k in 0..self.count {
            for lane in 0..lanes {
                let i = self.starts[k] + lane;
                if i >= k * lanes && i < light.len() {
                    for c in 0..3 {
                        laid[c][k * lanes + lane] = light[i][c];
                    }
                }
            }
        }
        laid
    }
}

impl Kernel for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Sums { form, light, data, stride, first } = self.sums;
        let (n, lanes) = (form.n, A::F32::LANES);
        let steps = Steps::new(n, lanes);
        let (direct, reflected) = (steps.lay(&light[0], lanes), steps.lay(&light[1], lanes));
        let sites = data.len() / stride.max(1);
        let mut from = 0;
        while from < sites {
            let count = lanes.min(sites - from);
            let mut sums = [[A::F32::splat(0.0); WIDEST]; 3];
            for s in 0..count {
                let t = &data[(from + s) * stride + first..(from + s + 1) * stride];
                let mut l = [A::F32::splat(0.0); 3];
                add::<A>(&steps, n, t, &direct, &mut l);
                if form.reflected == 1 {
                    add::<A>(&steps, n, &t[n..], &reflected, &mut l);
                } else if form.reflected > 1 {
                    for c in 0..3 {
                        l[c] = add_one::<A>(&steps, n, &t[(1 + c) * n..], &reflected[c], l[c]);
                    }
                }
                for c in 0..3 {
                    sums[c][s] = l[c];
                }
            }
            let mut rows = [[0.0f32; WIDEST]; 3];
            for c in 0..3 {
                A::F32::lane_sums(&mut sums[c][..lanes]).store(&mut rows[c]);
            }
            for s in 0..count {
                self.out[(from + s) * self.step + self.at] = [rows[0][s], rows[1][s], rows[2][s]];
            }
            from += count;
        }
    }
}

/// Adds a vector times the light of three channels.
#[inline(always)]
fn add<A: Arch>(steps: &Steps, n: usize, t: &[f32], light: &Laid, l: &mut [A::F32; 3]) {
    let lanes = A::F32::LANES;
    if n < lanes {
        let t = A::F32::load(&padded(&t[..n]));
        for c in 0..3 {
            l[c] = t.fma(A::F32::load(&light[c]), l[c]);
        }
        return;
    }
    for k in 0..steps.count {
        let t = A::F32::load(&t[steps.starts[k]..]);
        for c in 0..3 {
            l[c] = t.fma(A::F32::load(&light[c][k * lanes..]), l[c]);
        }
    }
}

/// The same of one channel.
#[inline(always)]
fn add_one<A: Arch>(steps: &Steps, n: usize, t: &[f32], light: &[f32; LAID], mut l: A::F32) -> A::F32 {
    let lanes = A::F32::LANES;
    if n < lanes {
        return A::F32::load(&padded(&t[..n])).fma(A::F32::load(light), l);
    }
    for k in 0..steps.count {
        l = A::F32::load(&t[steps.starts[k]..]).fma(A::F32::load(&light[k * lanes..]), l);
    }
    l
}

/// A vector that is shorter than a register.
#[inline(always)]
fn padded(t: &[f32]) -> [f32; WIDEST] {
    let mut all = [0.0; WIDEST];
    for (to, from) in all.iter_mut().zip(t) {
        *to = *from;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::on_every_isa;

    /// Sums by registers are those in f64, of all bands, of vectors with and without reflected light and others behind them, and of
    /// numbers of sites that fill no register.
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
                for sites in [1, 7, 16, 2 * BLOCK + 5] {
                    let data: Vec<f32> = (0..sites * stride).map(|k| number(7 * k)).collect();
                    let mut out = vec![[f32::NAN; 3]; 2 * sites];
                    Sums { form, light: &light, data: &data, stride, first }.write(&mut out, 2, 1);
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
                            let got = f64::from(out[2 * s + 1][c]);
                            assert!(
                                (got - exact).abs() < 1e-5,
                                "{bands} {reflected} {sites} {s}: {got} {exact}"
                            );
                            assert!(out[2 * s][c].is_nan());
                        }
                    }
                }
            }
        });
    }
}
