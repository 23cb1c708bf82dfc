//! Which kernel a level holds: the one whose filtering of the light fits best, with its width and scale.

use super::rings::{Filtered, Rings};
use super::samples::Samples;
use steradian_prefilter::Lobe;

/// A family of kernels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    Ggx,
    Beckmann,
    Charlie,
    Phong,
    Gaussian,
    Lambert,
    /// Means over the texels: box mips.
    Box,
    /// The light at the texels' centres, not filtered.
    None,
}

impl Family {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ggx => "ggx",
            Self::Beckmann => "beckmann",
            Self::Charlie => "charlie",
            Self::Phong => "phong",
            Self::Gaussian => "gaussian",
            Self::Lambert => "lambert",
            Self::Box => "box",
            Self::None => "none",
        }
    }

    /// The family of a kernel's name, as files and commands have it.
    pub fn from_name(name: &str) -> Option<Self> {
        let all = [Self::Ggx, Self::Beckmann, Self::Charlie, Self::Phong, Self::Gaussian, Self::Lambert];
        all.into_iter().find(|f| f.name() == name.trim().to_ascii_lowercase())
    }

    /// The range of widths that are tried.
    fn range(self) -> Option<(f64, f64)> {
        match self {
            Self::Ggx | Self::Beckmann => Some((2e-3, 1.0)),
            Self::Charlie => Some((SHEEN, 1.0)),
            Self::Phong => Some((0.7, 2e5)),
            Self::Gaussian => Some((2e-3, 2.0)),
            Self::Lambert | Self::Box | Self::None => None,
        }
    }
}

/// The least alpha of Charlie's lobe: narrower ones are this one.
const SHEEN: f64 = 0.02;

/// A kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    pub family: Family,
    /// alpha of ggx, beckmann and charlie, exponent of phong, standard deviation of gaussian; 0 where there is none.
    pub width: f64,
}

impl Kernel {
    /// The mirror.
    pub const NONE: Self = Self { family: Family::None, width: 0.0 };

    /// A kernel of a family at a perceptual roughness; ggx and beckmann at 0 are a mirror.
    pub fn at(family: Family, r: f64) -> Self {
        match family {
            Family::Ggx | Family::Beckmann if r == 0.0 => Self::NONE,
            Family::Charlie => Self { family, width: (r * r).max(SHEEN) },
            _ => Self { family, width: r * r },
        }
    }

    /// What filters; `None` for box and none.
    pub fn lobe(self) -> Option<Lobe> {
        match self.family {
            Family::Ggx => Some(Lobe::ggx(self.width)),
            Family::Beckmann => Some(Lobe::beckmann(self.width)),
            Family::Charlie => Some(Lobe::charlie(self.width)),
            Family::Phong => Some(Lobe::phong(self.width)),
            Family::Gaussian => Some(Lobe::gaussian(self.width)),
            Family::Lambert => Some(Lobe::lambert()),
            Family::Box | Family::None => None,
        }
    }

    /// Perceptual roughness, where the family has one; 0 for a mirror.
    pub fn roughness(self) -> Option<f64> {
        match self.family {
            Family::Ggx | Family::Beckmann | Family::Charlie => Some(self.width.sqrt()),
            Family::None => Some(0.0),
            _ => None,
        }
    }
}

/// How well a kernel explains the samples.
#[derive(Debug, Clone, Copy)]
pub struct Fit {
    pub kernel: Kernel,
    /// The factor on each channel.
    pub scale: [f64; 3],
    /// The part of the brightest light (suns, brightest texels) that is there.
    pub held: f64,
    /// RMS of relative errors over the samples.
    pub residual: f64,
}

impl Fit {
    /// The factor on all channels together: weighted as the samples are.
    pub fn gain(&self) -> f64 {
        self.scale.iter().sum::<f64>() / 3.0
    }
}

/// Everything that fits are made from.
pub struct Fitter<'a> {
    pub samples: &'a Samples,
    pub rings: &'a Rings,
    /// The light averaged over the texels, and at their centres.
    pub boxed: Vec<[f64; 3]>,
    pub points: Vec<[f64; 3]>,
    /// May the brightest light be partly missing?
    pub clamped: bool,
}

impl Fitter<'_> {
    /// The fit of one kernel: scale, and the part of the brightest light where that is open.
    pub fn kernel(&self, kernel: Kernel) -> Fit {
        let plain = |v: &[[f64; 3]]| -> Filtered { v.iter().map(|v| (*v, [0.0; 3])).collect() };
        if kernel.lobe().is_none() {
            let columns = plain(if kernel.family == Family::Box { &self.boxed } else { &self.points });
            return self.mirror(kernel, columns);
        }
        let columns: Filtered = match kernel.lobe() {
            Some(lobe) => self.rings.filtered(&lobe),
            None => plain(&self.points),
        };
        let held = if self.clamped && kernel.lobe().is_some() { self.held(&columns) } else { 1.0 };
        let (scale, residual) = self.solve(&columns, held);
        Fit { kernel, scale, held, residual }
    }

    /// The fit of the light itself. Where it may be clamped it is so at the level's largest value: the scale is then a
    /// median, which the few bright texels do not move.
    fn mirror(&self, kernel: Kernel, mut columns: Filtered) -> Fit {
        let (mut light, mut held) = (0.0, 0.0);
        if self.clamped {
            for c in 0..3 {
                let pairs = self.samples.values.iter().zip(&columns).filter(|(_, (x, _))| x[c] > 0.0);
                let mut ratios: Vec<f64> = pairs.map(|(v, (x, _))| v[c] / x[c]).collect();
                ratios.sort_by(f64::total_cmp);
                let scale = ratios.get(ratios.len() / 2).copied().unwrap_or(1.0);
                let cap = self.samples.largest[c] / scale.max(f64::MIN_POSITIVE);
                for (x, _) in &mut columns {
                    if x[c] > cap {
                        light += x[c];
                        held += cap;
                        x[c] = cap;
                    }
                }
            }
        }
        let (scale, residual) = self.solve(&columns, 1.0);
        Fit { kernel, scale, held: if light > 0.0 { held / light } else { 1.0 }, residual }
    }

    /// The value of the light at which a mirror is clamped.
    pub fn cap(&self, scale: [f64; 3]) -> f64 {
        (0..3).map(|c| self.samples.largest[c] / scale[c].max(f64::MIN_POSITIVE)).fold(0.0, f64::max)
    }

    /// Scale of each channel and the residual, with a part of the beams.
    fn solve(&self, columns: &Filtered, held: f64) -> ([f64; 3], f64) {
        let s = self.samples;
        let mut scale = [1.0; 3];
        let (mut left, mut all) = (0.0, 0.0);
        for c in 0..3 {
            let (mut vx, mut xx) = (0.0, 0.0);
            for ((v, w), (base, beams)) in s.values.iter().zip(&s.weights).zip(columns) {
                let x = base[c] + held * beams[c];
                vx += w * v[c] * x;
                xx += w * x * x;
            }
            if xx > 0.0 {
                scale[c] = vx / xx;
            }
            for ((v, w), (base, beams)) in s.values.iter().zip(&s.weights).zip(columns) {
                let x = base[c] + held * beams[c];
                left += w * (v[c] - scale[c] * x).powi(2);
                all += w * v[c] * v[c];
            }
        }
        (scale, if all > 0.0 { (left / all).sqrt() } else { 0.0 })
    }

    /// Least squares with the beams' part free in each channel; one part for all.
    fn held(&self, columns: &Filtered) -> f64 {
        let s = self.samples;
        let (mut base_sum, mut beam_sum) = (0.0, 0.0);
        for c in 0..3 {
            let [mut bb, mut bs, mut ss, mut vb, mut vs] = [0.0; 5];
            for ((v, w), (base, beams)) in s.values.iter().zip(&s.weights).zip(columns) {
                bb += w * base[c] * base[c];
                bs += w * base[c] * beams[c];
                ss += w * beams[c] * beams[c];
                vb += w * v[c] * base[c];
                vs += w * v[c] * beams[c];
            }
            let det = bb * ss - bs * bs;
            if det > 1e-9 * bb * ss {
                base_sum += (vb * ss - vs * bs) / det;
                beam_sum += (vs * bb - vb * bs) / det;
            }
        }
        if base_sum > 0.0 { (beam_sum / base_sum).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// A family's best kernel on a grid of widths.
    fn coarse(&self, family: Family) -> Fit {
        let Some((low, high)) = family.range() else { return self.kernel(Kernel { family, width: 0.0 }) };
        let at = |k: usize| low * (high / low).powf(k as f64 / COARSE as f64);
        let fits = (0..=COARSE).map(|k| self.kernel(Kernel { family, width: at(k) }));
        fits.reduce(better).unwrap_or_else(|| self.kernel(Kernel { family, width: low }))
    }

    /// The best kernel near that of a grid: golden sections in the logarithm of the width.
    fn fine(&self, start: Fit) -> Fit {
        let family = start.kernel.family;
        let Some((low, high)) = family.range() else { return start };
        let at = |t: f64| self.kernel(Kernel { family, width: t.exp().clamp(low, high) });
        let step = (high / low).ln() / COARSE as f64;
        let ratio = 0.5 * (5f64.sqrt() - 1.0);
        let t = start.kernel.width.ln();
        let (mut lo, mut hi) = ((t - step).max(low.ln()), (t + step).min(high.ln()));
        let (mut p, mut q) = (hi - ratio * (hi - lo), lo + ratio * (hi - lo));
        let (mut fp, mut fq) = (at(p), at(q));
        while hi - lo > 2e-3 {
            if fp.residual < fq.residual {
                (hi, q, fq) = (q, p, fp);
                p = hi - ratio * (hi - lo);
                fp = at(p);
            } else {
                (lo, p, fp) = (p, q, fq);
                q = lo + ratio * (hi - lo);
                fq = at(q);
            }
        }
        better(better(start, fp), fq)
    }

    /// The best kernel of all; where it hardly matters, one of the family that is expected.
    pub fn best(&self, expected: Family) -> Fit {
        const FAMILIES: [Family; 8] = [
            Family::None,
            Family::Box,
            Family::Lambert,
            Family::Ggx,
            Family::Phong,
            Family::Charlie,
            Family::Beckmann,
            Family::Gaussian,
        ];
        let lowest = |fits: &[Fit]| fits.iter().fold(f64::INFINITY, |m, f| m.min(f.residual));
        let mut fits: Vec<Fit> = FAMILIES.into_iter().map(|f| self.coarse(f)).collect();
        // Between two widths of the grid a family can gain much: half of them are worth a closer look.
        let mut order: Vec<f64> = fits.iter().map(|f| f.residual).collect();
        order.sort_by(f64::total_cmp);
        let limit = order[order.len() / 2];
        for f in &mut fits {
            if f.residual <= limit || f.kernel.family == expected {
                *f = self.fine(*f);
            }
        }
        let lowest = lowest(&fits);
        let enough = |f: &&Fit| f.residual <= alike(lowest);
        let wanted = fits.iter().filter(|f| f.kernel.family == expected).find(enough);
        // The first of the list that is good enough: the simpler one.
        let found = wanted.or_else(|| fits.iter().find(|f| f.residual <= 1.1 * lowest + 0.2 * ENOUGH));
        found.copied().unwrap_or(fits[0])
    }
}

/// Widths of a family that are tried first.
const COARSE: usize = 14;

fn better(a: Fit, b: Fit) -> Fit {
    if b.residual < a.residual { b } else { a }
}

/// Residuals that differ by less are the same.
const ENOUGH: f64 = 1.5e-3;
/// Beyond this residual a level is noisy: what the noise does to one kernel's residual says little of another's.
pub const NOISY: f64 = 0.02;
/// Beyond this one no kernel explains a level.
pub const UNEXPLAINED: f64 = 0.2;

/// The residual up to which a kernel explains as well as one of residual `lowest`.
pub fn alike(lowest: f64) -> f64 {
    (if lowest > NOISY { 1.5 } else { 1.2 }) * lowest + ENOUGH
}
