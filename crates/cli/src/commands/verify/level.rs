//! One level against the light: orientation, kernel, scale, and how far off.

use super::fit::{self, Family, Fit, Fitter, Kernel};
use super::orient::{self, Found, Turn};
use super::rings::Rings;
use super::samples::Samples;
use super::zonal;
use crate::commands::prefilter::{filament_numbers, irradiance};
use crate::context::Context;
use crate::failure::Failure;
use glam::DVec3;
use std::sync::Arc;
use steradian_light::{Environment, Lights};
use steradian_prefilter::{Beam, Lobe, Sampled, Source, Tree, filter_image};
use steradian_sphere::{Layout, SphereImage};

/// Relative RMS error of the exact filter.
const EXACT: f64 = 4e-4;

/// The light, prepared.
pub struct Bench {
    /// For the kernels that are expected.
    light: Sampled,
    tree: Tree,
    beams: Vec<Beam>,
    /// Each beam's largest radiance and that of the image without them.
    peaks: Vec<(f64, f64)>,
    floor: f64,
}

/// How far an image is from another.
#[derive(Debug, Clone, Copy, Default)]
pub struct Error {
    /// RMS(error)/RMS(reference), over solid angle and channels.
    pub rms: f64,
    /// ∫ error / ∫ reference.
    pub bias: f64,
    /// Largest |error|/reference of a channel.
    pub worst: f64,
}

impl Error {
    /// Of `got` times `gain` (per channel) against `reference`.
    fn between(got: &SphereImage, reference: &SphereImage, gain: [f64; 3]) -> Self {
        let (mut e2, mut r2, mut e1, mut r1, mut worst) = (0.0, 0.0, 0.0, 0.0, 0.0f64);
        let (w, h) = (got.width, got.height);
        for row in 0..got.layout.faces() * h {
            let omega = got.row_solid_angles(row / h, row % h);
            for c in 0..3 {
                let range = row * w..(row + 1) * w;
                for ((g, r), o) in
                    got.planes[c][range.clone()].iter().zip(&reference.planes[c][range]).zip(&omega)
                {
                    let (r, e) = (f64::from(*r) * gain[c], f64::from(*g) - f64::from(*r) * gain[c]);
                    e2 += o * e * e;
                    r2 += o * r * r;
                    e1 += o * e;
                    r1 += o * r;
                }
            }
        }
        let floor = 1e-3 * (r2 / (12.0 * std::f64::consts::PI)).sqrt();
        for c in 0..3 {
            for (g, r) in got.planes[c].iter().zip(&reference.planes[c]) {
                let r = f64::from(*r) * gain[c];
                worst = worst.max((f64::from(*g) - r).abs() / r.abs().max(floor).max(f64::MIN_POSITIVE));
            }
        }
        let ratio = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
        Self { rms: ratio(e2, r2).sqrt(), bias: ratio(e1, r1), worst }
    }
}

/// What one level holds.
pub struct Checked {
    pub image: SphereImage,
    pub expected: Kernel,
    pub found: Found,
    pub fit: Fit,
    /// How well the expected kernel explains it, scale aside.
    pub expected_fit: Fit,
    /// Against what the profile expects: orientation, kernel and scale 1.
    pub nominal: Error,
    /// Against what it was found to hold.
    pub fitted: Error,
    /// Radiance at which the brightest light seems to be clipped.
    pub clamped_at: Option<f64>,
    /// The format's largest value, and how many texels it stands for larger ones in.
    pub clipped: Option<(f32, usize)>,
}

/// A level on its way: where it lies, what it should hold, and how it is turned.
pub struct Placed {
    pub expected: Kernel,
    /// The light filtered with the expected kernel.
    reference: SphereImage,
    pub found: Found,
}

impl Checked {
    /// Does the expected kernel explain the level as well as any?
    pub fn kernel_is_right(&self) -> bool {
        self.expected_fit.residual <= fit::alike(self.fit.residual) || self.same_kernel()
    }

    fn same_kernel(&self) -> bool {
        let (a, b) = (self.fit.kernel, self.expected);
        match (a.roughness(), b.roughness()) {
            (Some(x), Some(y)) => {
                (a.family == b.family || x.max(y) < 0.06) && (x - y).abs() <= 0.01 + 0.01 * y
            }
            _ => a.family == b.family && (a.width / b.width.max(1e-9)).ln().abs() < 0.05,
        }
    }

    /// Is the brightest light partly missing?
    pub fn is_clamped(&self) -> bool {
        self.fit.held < 1.0
    }
}

impl Bench {
    /// Prepares the light for the kernels that are expected.
    pub fn new(lights: &Lights, expected: &[Kernel], context: &Context) -> Result<Self, Failure> {
        let source = Source::new(lights, 0, &context.task)?;
        let tree = Tree::new(source.base.as_ref(), &[], &context.task)?;
        let lobes: Vec<Lobe> = expected.iter().filter_map(|k| k.lobe()).collect();
        let light = Sampled::new(lights, &zonal(&lobes), EXACT, &context.task)?;
        let largest = |v: [f64; 3]| v.iter().fold(0.0, |m: f64, v| m.max(*v));
        let area = |b: &Beam| 4.0 * std::f64::consts::PI * (0.5 * b.radius).sin().powi(2);
        let peaks =
            source.beams.iter().map(|b| (largest(b.flux) / area(b).max(1e-12), largest(b.flux))).collect();
        let planes = source.base.iter().flat_map(|b| b.planes.iter().flatten());
        let floor = planes.fold(0.0, |m: f64, v| m.max(f64::from(*v)));
        Ok(Self { light, tree, beams: source.beams, peaks, floor })
    }

    /// The expected map of a kernel.
    fn exact(
        light: &Sampled,
        kernel: Kernel,
        shape: (Layout, usize, usize),
        context: &Context,
    ) -> Result<SphereImage, Failure> {
        Ok(match kernel.lobe() {
            Some(lobe) => filter_image(light, &lobe, shape, EXACT, &context.task)?.image,
            None => light.mirror(shape.0, shape.1, shape.2),
        })
    }

    /// How each level is turned. Levels that cannot tell follow the one that tells most.
    pub fn place(
        &self,
        levels: &[SphereImage],
        kernels: &[Kernel],
        context: &Context,
    ) -> Result<Vec<Placed>, Failure> {
        let mut placed = Vec::new();
        for (image, &expected) in levels.iter().zip(kernels) {
            let shape = (image.layout, image.width, image.height);
            let reference = positive(Self::exact(&self.light, expected, shape, context)?, image);
            let found = orient::find(image, &reference);
            placed.push(Placed { expected, reference, found });
        }
        let certain = placed.iter().map(|p| &p.found).filter(|f| f.certain);
        let clearest = certain.min_by(|a, b| a.residual.total_cmp(&b.residual));
        let Some((turn, sure)) = clearest.map(|f| (f.turn.clone(), f.residual < 0.01)) else {
            return Ok(placed);
        };
        for (p, image) in placed.iter_mut().zip(levels) {
            let f = &mut p.found;
            if f.turn != turn && (image.layout == Layout::Cube || !matches!(turn, Turn::Faces(_))) {
                let residual = orient::residual(&turn, image, &p.reference);
                // A level that nothing explains, of another kernel perhaps, says little of its own.
                if !f.certain || residual <= 1.6 * f.residual + 1e-3 || (sure && f.residual > 0.02) {
                    (f.turn, f.residual) = (turn.clone(), residual);
                }
            }
        }
        Ok(placed)
    }

    /// The brightest direction beside the image.
    fn bright(&self) -> Option<DVec3> {
        let total = |b: &Beam| b.flux.iter().sum::<f64>();
        self.beams.iter().max_by(|a, b| total(a).total_cmp(&total(b))).map(|b| b.direction)
    }

    /// Finds what a level holds.
    pub fn check(&self, image: &SphereImage, placed: Placed) -> Checked {
        let Placed { expected, reference, found } = placed;
        let straight = found.turn.undo(image);
        let shape = (image.layout, image.width, image.height);
        let samples = Samples::new(&straight, self.bright());
        let rings = Rings::new(&self.tree, &self.beams, &samples.directions);
        let boxes = positive(self.light.mirror(shape.0, shape.1, shape.2), image);
        let at = |&(f, i, j): &(usize, usize, usize)| boxes.texel(f, i, j).map(f64::from);
        let boxed = samples.texels.iter().map(at).collect();
        let point = |d: DVec3| self.light.image.bilinear(d);
        let points = samples.directions.iter().map(|d| point(*d).map(f64::from)).collect();
        let mut fitter = Fitter { samples: &samples, rings: &rings, boxed, points, clamped: false };
        let mut fit = fitter.best(expected.family);
        if fit.residual > 3e-3 && !self.beams.is_empty() {
            fitter.clamped = true;
            let clamped = fitter.best(expected.family);
            if clamped.residual < 0.5 * fit.residual && clamped.held < 0.97 {
                fit = clamped;
            }
        }
        fitter.clamped = fit.held < 1.0;
        let mut expected_fit = fitter.kernel(expected);
        if expected.lobe().is_none() {
            let boxed = fitter.kernel(Kernel { family: Family::Box, width: 0.0 });
            if boxed.residual < expected_fit.residual {
                expected_fit = Fit { kernel: expected, ..boxed };
            }
        }
        // Of a mirror it does not matter whether texels are means or points.
        let mirror = |k: Kernel| {
            matches!(k.family, Family::Box | Family::None)
                || k.family == Family::Ggx && k.width < 0.7 * std::f64::consts::FRAC_PI_2 / image.width as f64
        };
        if expected == Kernel::NONE && mirror(fit.kernel) {
            fit.kernel = Kernel::NONE;
        }
        if fit.residual > fit::NOISY && fit.held >= 1.0 && samples.clipped.is_none() {
            // Noise and small lights in slightly other places pull a fit texel by texel towards 0, but not the whole.
            fit.scale = whole(&straight, &reference, fit.scale);
        }
        let nominal = Error::between(image, &reference, [1.0; 3]);
        let clamped_at = match fit.kernel.lobe() {
            _ if fit.held >= 1.0 => None,
            Some(_) => self.clamp(fit.held),
            None => Some(fitter.cap(fit.scale)),
        };
        let against = |light: &SphereImage| {
            let capped = clamped_at.map(|c| cap(light, c));
            Error::between(&straight, capped.as_ref().unwrap_or(light), fit.scale)
        };
        let fitted = if fit.kernel.lobe().is_none() {
            // The light itself: the mean over each texel, or the value at its centre.
            let centres = SphereImage::from_fn(shape.0, shape.1, shape.2, point);
            let (means, centres) = (against(&boxes), against(&centres));
            if centres.rms < means.rms { centres } else { means }
        } else {
            // Where another kernel was found `finish` filters again.
            Error::between(&straight, &reference, fit.scale)
        };
        let clipped = samples.clipped;
        Checked { image: straight, expected, found, fit, expected_fit, nominal, fitted, clamped_at, clipped }
    }

    /// The radiance that keeps the part `held` of the beams' light above the image's largest value.
    fn clamp(&self, held: f64) -> Option<f64> {
        let flux: f64 = self.peaks.iter().map(|p| p.1).sum();
        // What is left of a beam of radiance L (above the floor) where all is clipped to c above the floor.
        let left =
            |c: f64| self.peaks.iter().map(|(l, f)| f * (c / l.max(1e-300)).min(1.0)).sum::<f64>() / flux;
        let (mut lo, mut hi) = (0.0, self.peaks.iter().fold(0.0, |m: f64, p| m.max(p.0)));
        for _ in 0..60 {
            let c = 0.5 * (lo + hi);
            if left(c) < held { lo = c } else { hi = c }
        }
        (flux > 0.0).then_some(self.floor + hi)
    }

    /// Measures levels that hold something else than expected against just that.
    pub fn finish(&self, lights: &Lights, levels: &mut [Checked], context: &Context) -> Result<(), Failure> {
        let lobe = |l: &Checked| l.fit.kernel.lobe();
        let clamped = |l: &Checked| l.clamped_at.filter(|_| lobe(l).is_some());
        let mut at: Vec<f64> = levels.iter().filter_map(clamped).collect();
        at.sort_by(f64::total_cmp);
        // What holds the expected kernel to within what a fit can tell was measured against it.
        let known = |l: &Checked| l.fit.kernel == l.expected || (l.same_kernel() && l.fitted.rms < 5e-3);
        let whole: Vec<usize> =
            (0..levels.len()).filter(|&i| !known(&levels[i]) && clamped(&levels[i]).is_none()).collect();
        let part: Vec<usize> = (0..levels.len()).filter(|&i| clamped(&levels[i]).is_some()).collect();
        self.again(lights, levels, &whole, context)?;
        match at.get(at.len() / 2) {
            Some(&c) => self.again(&dimmed(lights, c), levels, &part, context),
            None => Ok(()),
        }
    }

    /// Measures some levels against what they hold of these lights.
    fn again(
        &self,
        lights: &Lights,
        levels: &mut [Checked],
        chosen: &[usize],
        context: &Context,
    ) -> Result<(), Failure> {
        let lobes: Vec<Lobe> = chosen.iter().filter_map(|&i| levels[i].fit.kernel.lobe()).collect();
        if lobes.is_empty() {
            return Ok(());
        }
        let light = Sampled::new(lights, &zonal(&lobes), EXACT, &context.task)?;
        for &i in chosen {
            let l = &mut levels[i];
            if l.fit.kernel.lobe().is_some() {
                let shape = (l.image.layout, l.image.width, l.image.height);
                let reference = Self::exact(&light, l.fit.kernel, shape, context)?;
                l.fitted = Error::between(&l.image, &reference, l.fit.scale);
            }
        }
        Ok(())
    }
}

/// The factor on each channel of what `got` and `reference` hold in sum over the sphere; `otherwise` of a channel
/// that holds nothing.
fn whole(got: &SphereImage, reference: &SphereImage, otherwise: [f64; 3]) -> [f64; 3] {
    let (mut sums, w) = ([[0.0; 2]; 3], got.width);
    for row in 0..got.layout.faces() * got.height {
        let omega = got.row_solid_angles(row / got.height, row % got.height);
        for c in 0..3 {
            for i in 0..w {
                sums[c][0] += omega[i] * f64::from(got.planes[c][row * w + i]);
                sums[c][1] += omega[i] * f64::from(reference.planes[c][row * w + i]);
            }
        }
    }
    std::array::from_fn(|c| if sums[c][1] > 0.0 { sums[c][0] / sums[c][1] } else { otherwise[c] })
}

/// The reference without the negative values that sharp interpolation leaves beside suns, where `image` has none either.
fn positive(mut reference: SphereImage, image: &SphereImage) -> SphereImage {
    if image.planes.iter().flatten().all(|v| *v >= 0.0) {
        reference.planes.iter_mut().flatten().for_each(|v| *v = v.max(0.0));
    }
    reference
}

/// An image whose values end at `c`.
fn cap(image: &SphereImage, c: f64) -> SphereImage {
    let mut out = image.clone();
    out.planes.iter_mut().flatten().for_each(|v| *v = v.min(c as f32));
    out
}

/// Lights whose radiance ends at `c`.
fn dimmed(lights: &Lights, c: f64) -> Lights {
    let environment = lights.environment.as_ref().map(|e| Arc::new(Environment { image: cap(&e.image, c) }));
    let mut out = Lights { environment, ..lights.clone() };
    for d in &mut out.disks {
        d.radiance = d.radiance.map(|l| l.min(c));
    }
    out
}

/// Nine irradiance coefficients against the light's.
pub struct Coefficients {
    /// The factor that fits best.
    pub scale: f64,
    /// Relative RMS error as they are, and with the factor.
    pub rms: f64,
    pub fitted_rms: f64,
}

impl Coefficients {
    /// Compares the numbers of a file with those that the profile expects.
    pub fn compare(sh: &[[f64; 3]], profile: &str, bench: &Bench) -> Self {
        let light = bench.light.coefficients(2);
        let want = if profile == "gltf" { irradiance(&light) } else { filament_numbers(&light) };
        let (mut gw, mut ww) = (0.0, 0.0);
        for (g, w) in sh.iter().flatten().zip(want.iter().flatten()) {
            gw += g * w;
            ww += w * w;
        }
        let scale = if ww > 0.0 { gw / ww } else { 1.0 };
        let error = |s: f64| {
            let pairs = sh.iter().flatten().zip(want.iter().flatten());
            let sum: f64 = pairs.map(|(g, w)| (g - s * w).powi(2)).sum();
            if ww > 0.0 { (sum / ww).sqrt() } else { 0.0 }
        };
        Self { scale, rms: error(1.0), fitted_rms: error(scale) / scale.abs().max(f64::MIN_POSITIVE) }
    }
}
