//! The numbers of a texel as integers.
//!
//! With t from 0 to 1, an integer of one to three bytes over its largest value, and the least and the largest
//! number over all texels and levels:
//!
//! > ρ = low + span t²,  C = low + span t,  n = low exp(span t)
//!
//! so that half a step of a byte is 0.2 % of the largest factor (and less of dark ones), 0.2 % of the range
//! of a component of C, and 0.2 % of the logarithm of the range of n. C and n are stored once for red, green
//! and blue where they have the same.

use super::averages::{Averages, lobe_of, mean};
use super::{LAYERS, Lobe, MOST, Texel};
use crate::local::{Pair, Place, error_of, texel};
use glam::DVec2;
use std::f32::consts::FRAC_1_PI;
use std::f64::consts::TAU;
use steradian_brdf::Brdf;
use steradian_brdf::model::lafortune::{Cosine, Lafortune};
use steradian_scene::surface::{Patch, Planes};
use steradian_sphere::sampling::{Pcg32, R2, hemisphere};

/// Pairs of directions at which the error of the integers is measured.
const PAIRS: u32 = 1 << 12;

/// Bytes of a factor, of a component of C, and of an exponent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Widths {
    /// Of ρ_d and of each ρ_k.
    pub rho: usize,
    /// Of each component of each C_k.
    pub c: usize,
    /// Of each n_k.
    pub n: usize,
}

impl Widths {
    /// So many bytes for each number.
    pub fn all(bytes: usize) -> Self {
        let bytes = bytes.clamp(1, 3);
        Self { rho: bytes, c: bytes, n: bytes }
    }

    /// The widths that are tried, the smallest first.
    const LADDER: [Self; 4] = [
        Self { rho: 1, c: 1, n: 1 },
        Self { rho: 1, c: 2, n: 1 },
        Self { rho: 2, c: 2, n: 2 },
        Self { rho: 3, c: 3, n: 3 },
    ];
}

/// How many bytes a number takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Storage {
    /// These.
    Of(Widths),
    /// As few as keep the relative RMS error of f ⟨n·wi⟩ at the texels to this.
    Within(f64),
}

/// What an integer stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Code {
    /// Factors.
    Square,
    /// Components of C.
    Linear,
    /// Exponents.
    Exponential,
}

/// A number of a texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Field {
    pub code: Code,
    /// Bytes, the most significant first.
    pub bytes: usize,
    /// Its first byte in a texel.
    pub at: usize,
    pub low: f32,
    pub span: f32,
}

impl Field {
    fn most(&self) -> f32 {
        ((1u32 << (8 * self.bytes)) - 1) as f32
    }

    /// Sets the range to numbers from `least` to `most`.
    fn reach(&mut self, [least, most]: [f32; 2]) {
        // No texel has this number.
        let [least, most] = if least <= most { [least, most] } else { [1.0; 2] };
        self.low = least;
        self.span = match self.code {
            Code::Exponential => (most / least).ln(),
            _ => most - least,
        };
    }

    fn encode(&self, value: f32, to: &mut [u8]) {
        let t = match self.code {
            _ if self.span <= 0.0 => 0.0,
            Code::Square => ((value - self.low) / self.span).max(0.0).sqrt(),
            Code::Linear => (value - self.low) / self.span,
            Code::Exponential => (value / self.low).ln() / self.span,
        };
        let code = (f64::from(t.clamp(0.0, 1.0)) * f64::from(self.most())).round() as u32;
        to[self.at..][..self.bytes].copy_from_slice(&code.to_be_bytes()[4 - self.bytes..]);
    }

    #[inline(always)]
    fn decode(&self, from: &[u8]) -> f32 {
        let code = from[self.at..][..self.bytes].iter().fold(0u32, |code, b| code << 8 | u32::from(*b));
        let t = code as f32 / self.most();
        match self.code {
            Code::Square => self.low + self.span * t * t,
            Code::Linear => self.low + self.span * t,
            Code::Exponential => self.low * steradian_simd::functions::exp(self.span * t),
        }
    }
}

/// Lobes by texel.
#[derive(Debug, Clone)]
pub struct CosineLobes {
    /// Lobes.
    pub count: usize,
    /// Bytes of the numbers.
    pub widths: Widths,
    /// The texels of all levels.
    pub patch: Patch,
    /// Of each lobe: have red, green and blue a C and an n of their own?
    pub(super) own: [bool; MOST],
    /// The numbers of a texel: ρ_d; then of each lobe ρ, and of all channels or of each C and n.
    pub(super) fields: Vec<Field>,
    /// Bytes of a texel, a multiple of four.
    pub(super) stride: usize,
    pub(super) codes: Vec<u8>,
}

/// C and n of a lobe, for all channels or for each, from the sums of its layers.
fn shapes(layers: &[[f32; 3]; LAYERS], own: bool) -> Vec<([f32; 3], f32, bool)> {
    let shape = |sums: [f32; LAYERS]| {
        let (_, c, n) = mean(sums);
        (c, n, sums[0] > 0.0)
    };
    match own {
        true => (0..3).map(|c| shape(layers.map(|l| l[c]))).collect(),
        false => vec![shape(layers.map(|l| l[0] + l[1] + l[2]))],
    }
}

/// The numbers of a texel in the order of the fields; `None` where it has no such lobe.
fn numbers(
    rho_d: [f32; 3],
    lobes: &[[[f32; 3]; LAYERS]],
    own: &[bool; MOST],
    mut each: impl FnMut(Option<f32>),
) {
    rho_d.iter().for_each(|x| each(Some(*x)));
    for (layers, own) in lobes.iter().zip(own) {
        lobe_of(layers).rho.iter().for_each(|x| each(Some(*x)));
        for (c, n, there) in shapes(layers, *own) {
            c.iter().chain([&n]).for_each(|x| each(there.then_some(*x)));
        }
    }
}

/// Which lobes have channels of different C or n at some texel.
fn differ(averages: &Averages) -> [bool; MOST] {
    let finest = averages.size().0 * averages.size().1;
    let mut out = [false; MOST];
    averages.each(|i, _, lobes| {
        for (layers, out) in lobes.iter().zip(&mut out).filter(|(_, out)| i < finest && !**out) {
            let there: Vec<_> = shapes(layers, true).into_iter().filter(|s| s.2).collect();
            let near = |a: f32, b: f32, size: f32| (a - b).abs() <= 1e-5 * size;
            *out = there.windows(2).any(|w| {
                let size = w[0].0.iter().map(|x| x.abs()).sum();
                !near(w[0].1, w[1].1, w[0].1) || (0..3).any(|k| !near(w[0].0[k], w[1].0[k], size))
            });
        }
    });
    out
}

/// The fields of so many lobes, without their ranges; and bytes of a texel.
pub(super) fn layout(count: usize, own: &[bool; MOST], widths: Widths) -> (Vec<Field>, usize) {
    let mut kinds = vec![(Code::Square, widths.rho); 3];
    for own in &own[..count] {
        kinds.extend([(Code::Square, widths.rho); 3]);
        for _ in 0..if *own { 3 } else { 1 } {
            kinds.extend([(Code::Linear, widths.c); 3]);
            kinds.push((Code::Exponential, widths.n));
        }
    }
    let mut at = 0;
    let field = |(code, bytes): (Code, usize)| {
        let field = Field { code, bytes, at, low: 0.0, span: 0.0 };
        at += bytes;
        field
    };
    let fields = kinds.into_iter().map(field).collect();
    (fields, at.next_multiple_of(4))
}

impl CosineLobes {
    /// Lobes from the images among `textures` ([`super::PLANES`]), as [`Averages::new`] reads them.
    pub fn new(kd: [f64; 3], own: &[[Cosine; 3]], textures: &Planes, storage: Storage) -> Self {
        Self::of(&Averages::new(kd, own, textures), storage)
    }

    /// The same numbers as integers.
    pub fn of(averages: &Averages, storage: Storage) -> Self {
        let own = differ(averages);
        match storage {
            Storage::Of(widths) => Self::packed(averages, own, widths),
            Storage::Within(tolerance) => {
                let [small @ .., largest] = Widths::LADDER;
                let mut tried = small.into_iter().map(|widths| Self::packed(averages, own, widths));
                tried
                    .find(|made| made.error(averages) <= tolerance)
                    .unwrap_or_else(|| Self::packed(averages, own, largest))
            }
        }
    }

    fn packed(averages: &Averages, own: [bool; MOST], widths: Widths) -> Self {
        let count = averages.count.min(MOST);
        let (mut fields, stride) = layout(count, &own, widths);
        let mut ranges = vec![[f32::INFINITY, f32::NEG_INFINITY]; fields.len()];
        let mut texels = 0;
        averages.each(|_, rho_d, lobes| {
            let mut of = ranges.iter_mut();
            texels += 1;
            numbers(rho_d, &lobes[..count], &own, |x| {
                if let (Some([least, most]), Some(x)) = (of.next(), x) {
                    (*least, *most) = (least.min(x), most.max(x));
                }
            });
        });
        fields.iter_mut().zip(ranges).for_each(|(f, range)| f.reach(range));
        let mut codes = vec![0; stride * texels];
        averages.each(|i, rho_d, lobes| {
            let mut of = fields.iter();
            let texel = &mut codes[stride * i..][..stride];
            numbers(rho_d, &lobes[..count], &own, |x| {
                if let (Some(field), Some(x)) = (of.next(), x) {
                    field.encode(x, texel);
                }
            });
        });
        Self { count, widths, patch: averages.texels.patch(), own, fields, stride, codes }
    }

    /// Bytes that shading reads: the texels of all levels, and the ranges of their numbers.
    pub fn bytes(&self) -> usize {
        self.codes.len() + 8 * self.fields.len()
    }

    /// Bytes of a texel.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// ρ_d and lobes of a texel.
    #[inline(always)]
    fn decode(&self, texel: usize) -> ([f32; 3], [Lobe; MOST]) {
        let from = &self.codes[self.stride * texel..][..self.stride];
        let mut values = self.fields.iter().map(|f| f.decode(from));
        let mut next = || values.next().unwrap_or(0.0);
        let rho_d = [next(), next(), next()];
        let mut lobes = [Lobe::default(); MOST];
        for (lobe, own) in lobes.iter_mut().zip(self.own).take(self.count) {
            lobe.rho = [next(), next(), next()];
            let shape = [next(), next(), next(), next()];
            for c in 0..3 {
                let [x, y, z, n] = if own && c > 0 { [next(), next(), next(), next()] } else { shape };
                (lobe.c[0][c], lobe.c[1][c], lobe.c[2][c], lobe.n[c]) = (x, y, z, n);
            }
        }
        (rho_d, lobes)
    }

    /// The lobes at `uv`, averaged over a square of side `footprint`.
    #[inline(always)]
    pub fn at(&self, uv: [f32; 2], footprint: f32) -> Texel {
        let mut out = Texel::default();
        let mut sums = [[[0.0f32; 3]; LAYERS]; MOST];
        for (texel, weight) in self.patch.taps(uv, footprint) {
            if weight <= 0.0 {
                continue;
            }
            let (rho_d, lobes) = self.decode(texel);
            (0..3).for_each(|c| out.rho_d[c] += weight * FRAC_1_PI * rho_d[c]);
            for (lobe, sums) in lobes.iter().zip(&mut sums).take(self.count) {
                for c in 0..3 {
                    let (rho, [x, y, z]) = (weight * lobe.rho[c], lobe.c.map(|v| v[c]));
                    let all = [1.0, x, y, z, lobe.n[c].recip(), x * x + y * y + z * z];
                    sums.iter_mut().zip(all).for_each(|(to, x)| to[c] += rho * x);
                }
            }
        }
        for (lobe, sums) in out.lobes.iter_mut().zip(&sums).take(self.count) {
            *lobe = lobe_of(sums);
        }
        out
    }

    /// Relative RMS error of f ⟨n·wi⟩ at texels of the finest level against `exact`, over views uniform in
    /// solid angle and directions of light of which half are drawn by the texel's own reflectance.
    pub fn error(&self, exact: &Averages) -> f64 {
        let size = self.patch.size();
        let place = |k: u32| texel(k, size).0;
        let (lattice, mut random) = (R2::default(), Pcg32::new(7, 11));
        let pairs = (0..PAIRS).filter_map(|k| {
            let wo = hemisphere::sample(lattice.point(k));
            let u = DVec2::new(random.next_f64(), random.next_f64());
            let f = exact.reflectance(place(k).uv);
            let drawn = if k % 2 == 0 { Some(hemisphere::sample(u)) } else { f.sample(wo, u).map(|s| s.wi) };
            let wi = drawn.filter(|wi| wi.z > 0.0 && wo.z > 0.0)?;
            Some((k, Pair { wi, wo, weight: 1.0 / (0.5 / TAU + 0.5 * f.pdf(wi, wo)) }))
        });
        error_of(
            pairs,
            place,
            |at: Place, wi, wo| exact.reflectance(at.uv).f_cos(wi, wo),
            |at: Place, wi, wo| self.at(at.uv, at.footprint).f_cos(self.count, wi, wo),
        )
    }

    /// The stored reflectance at `uv`, of no footprint.
    pub fn reflectance(&self, uv: [f32; 2]) -> Lafortune {
        let texel = self.at(uv, 0.0);
        let lobe = |l: &Lobe| {
            std::array::from_fn(|c| Cosine {
                c: glam::DVec3::from_array(l.c.map(|v| f64::from(v[c]))),
                n: l.n[c].into(),
                ks: l.rho[c].into(),
            })
        };
        let kd = texel.rho_d.map(|x| f64::from(x) * std::f64::consts::PI);
        let lobes = texel.lobes.iter().take(self.count).map(lobe).collect();
        Lafortune { spec: String::from("lafortune"), kd, lobes }
    }
}
