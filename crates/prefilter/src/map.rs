//! Filtered images: light convolved with a kernel, evaluated at the texel centres of any layout.
//!
//! Nothing is resampled from another filtered map. In frequency space (Ramamoorthi & Hanrahan 2002, 5.4) where the
//! analysis has all bands that the kernel passes; for sharper kernels, and where it costs less, only what lies far from
//! each direction, and the texels near it are summed ([`Way::Near`]). The brightest texels are summed exactly where
//! the series would ring.

use crate::bands::{self, cost, with_sparks};
use crate::measure::finish;
use crate::rows::for_rows;
use crate::sampled::{MAX_ORDER, Sampled, TAIL, beams_at};
use crate::split::Split;
use crate::synthesis::synthesize;
use crate::texels::{Scratch, Texels};
use crate::weights::Weights;
use crate::{Beam, Zonal};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_sphere::{Layout, SphereImage};

/// How an image was filtered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// Resampled by areas: a mirror.
    Area,
    /// By spherical harmonics.
    Frequency {
        /// Highest band.
        order: usize,
        /// Bright texels and suns that were summed directly.
        beams: usize,
    },
    /// Near texels directly, the rest by spherical harmonics.
    Near {
        /// Highest band of the rest.
        order: usize,
        /// Reach of the direct sum, radians.
        reach: f64,
    },
}

impl Way {
    /// One word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Area => "area",
            Self::Frequency { .. } => "frequency",
            Self::Near { .. } => "near",
        }
    }

    /// Highest band; 0 for a mirror.
    pub fn order(self) -> usize {
        match self {
            Self::Area => 0,
            Self::Frequency { order, .. } | Self::Near { order, .. } => order,
        }
    }
}

/// A filtered image and what is known of it.
#[derive(Debug, Clone)]
pub struct FilteredImage {
    /// ∫ L K at texel centres.
    pub image: SphereImage,
    /// How.
    pub way: Way,
    /// Bound of the relative RMS error by the bands left out.
    pub predicted: f64,
    /// Flux added by raising negative values to zero, relative to all.
    pub clipped: f64,
    /// ∫ L dω · ∫ K dω: what should be in the image.
    pub energy_in: [f64; 3],
    /// ∫ of the image, texel values times solid angles.
    pub energy_out: [f64; 3],
}

/// Part of the tolerance that a bound may take.
const SHARE: f64 = 0.25;
/// What interpolation and single precision add to any bound.
const ROUNDING: f64 = 2e-6;

/// Layout, width and height of an image.
type Shape = (Layout, usize, usize);

/// Convolves `light` with `kernel` to relative RMS error `tolerance`, at the texel centres of an image.
pub fn filter_image(
    light: &Sampled,
    kernel: &dyn Zonal,
    shape: Shape,
    tolerance: f64,
    task: &Task,
) -> Result<FilteredImage, Cancelled> {
    task.check()?;
    let (layout, width, height) = shape;
    let k = kernel.coefficients(MAX_ORDER + 64);
    let plan = plan(light, kernel, &k, layout.faces() * width * height, tolerance);
    task.check()?;
    let (mut image, way, predicted) = match plan {
        Plan::Frequency(p) => by_frequency(light, kernel, &k, p, shape, tolerance),
        Plan::Near(p) => by_parts(light, kernel, &k, &p, shape, tolerance, task)?,
    };
    task.check()?;
    let (energy_out, clipped) = finish(&mut image, !light.has_negative());
    let energy_in = light.flux().map(|f| f * k[0]);
    Ok(FilteredImage { image, way, predicted: predicted + ROUNDING, clipped, energy_in, energy_out })
}

/// What is to be done.
enum Plan<'a> {
    Frequency(Frequency),
    Near(Near<'a>),
}

/// By the series alone.
struct Frequency {
    order: usize,
    /// Do the brightest texels go through the series?
    merged: bool,
    tail: f64,
}

/// Near texels directly.
struct Near<'a> {
    split: Split<'a>,
    /// Coefficients of what is far.
    far: Vec<f64>,
    order: usize,
    merged: bool,
    predicted: f64,
}

/// The cheapest way within the tolerance; the most exact where none is.
fn plan<'a>(light: &Sampled, kernel: &'a dyn Zonal, k: &[f64], texels: usize, tolerance: f64) -> Plan<'a> {
    let rows = light.image.height;
    let (f, tail) = bands::order(light, k, k, TAIL * tolerance);
    let (order, merged) = with_sparks(light, k, k, f, texels, tolerance);
    let sparks = if merged { 0 } else { light.sparks().len() };
    let of_sparks =
        |merged: bool| if merged && !light.sparks().is_empty() { bands::SPARKS * tolerance } else { 0.0 };
    let tail = tail + bands::unevenness(k, rows) + of_sparks(merged);
    let frequency = Frequency { order, merged, tail };
    let limit = SHARE * tolerance;
    let enough = frequency.tail <= limit;
    let price = cost::series(order, texels) + cost::values(sparks, texels);
    // Between texels that are wide apart beside the kernel all weights are small.
    let apart = PI / rows as f64 / kernel.width();
    let mut best: Option<(f64, Near<'a>)> = None;
    for split_at in [light.order(), light.order() / 2, light.order() / 4].into_iter().filter(|&o| o >= 32) {
        if enough && (cost::series(split_at, texels) > price || split_at > order) {
            continue;
        }
        for turns in [22.0, 30.0, 40.0] {
            let split = Split::new(kernel, split_at, turns);
            let near = cost::near(&light.image, &split, texels);
            if best.as_ref().is_some_and(|(b, n)| n.predicted <= limit && *b < near)
                || (enough && near > price)
            {
                continue;
            }
            let far = split.far(MAX_ORDER + 64);
            let (order, rest) = bands::order(light, &far, k, TAIL * tolerance);
            let (order, merged) = with_sparks(light, &far, k, order, texels, tolerance);
            let predicted = (rest + of_sparks(merged)) * (1.0 + apart * apart);
            let sparks = if merged { 0 } else { light.sparks().len() };
            let all = near + cost::series(order, texels) + cost::values(sparks, texels);
            let better = match &best {
                None => true,
                Some((b, n)) if n.predicted <= limit => predicted <= limit && all < *b,
                Some((_, n)) => predicted < n.predicted,
            };
            if better {
                best = Some((all, Near { split, far, order, merged, predicted }));
            }
        }
    }
    match best {
        // A kernel that is not smooth elsewhere gains nothing by being split.
        Some((all, near))
            if if enough {
                near.predicted <= limit && all < price
            } else {
                near.predicted < frequency.tail
            } =>
        {
            Plan::Near(near)
        }
        _ => Plan::Frequency(frequency),
    }
}

fn by_frequency(
    light: &Sampled,
    kernel: &dyn Zonal,
    k: &[f64],
    plan: Frequency,
    shape: Shape,
    tolerance: f64,
) -> (SphereImage, Way, f64) {
    let Frequency { order, merged, tail } = plan;
    let k_used = &k[..=order.min(k.len() - 1)];
    let weights = Weights::new(light.image.height, k_used);
    let mut image = synthesize(&light.spectrum(order, merged), k_used, shape, tolerance);
    let direct: &[Beam] = if merged { &[] } else { light.sparks() };
    let (suns, even) = (light.suns(), weights.are_one());
    if !(direct.is_empty() && suns.is_empty() && even) {
        for_rows(&mut image, |row, texels| {
            let width = texels[0].len();
            row.sums(direct, kernel);
            for i in 0..width {
                let Some(d) = row.direction(i) else { continue };
                let scale = if even { 1.0 } else { weights.at(d.y.clamp(-1.0, 1.0).acos()) };
                let suns = beams_at(suns, kernel, d);
                for c in 0..3 {
                    let sum = f64::from(texels[c][i]) + row.sum(c, i);
                    texels[c][i] = (sum * scale + suns[c]) as f32;
                }
            }
        });
    }
    (image, Way::Frequency { order, beams: direct.len() + suns.len() }, tail)
}

fn by_parts(
    light: &Sampled,
    kernel: &dyn Zonal,
    k: &[f64],
    plan: &Near<'_>,
    shape: Shape,
    tolerance: f64,
    task: &Task,
) -> Result<(SphereImage, Way, f64), Cancelled> {
    let far = &plan.far[..=plan.order.min(plan.far.len() - 1)];
    // Σ of the far part over all texels, which the image is divided by, from the same bands as the image.
    let rest = Weights::sums(light.image.height, far);
    let mut image = synthesize(&light.spectrum(plan.order, plan.merged), far, shape, tolerance);
    task.check()?;
    let near = Texels::new(&light.image);
    let direct: &[Beam] = if plan.merged { &[] } else { light.sparks() };
    for_texels(&mut image, |scratch, d, texel| {
        let (mut sum, weight) = near.near(&plan.split, kernel, d, scratch);
        for b in direct {
            let w = plan.split.far_value(d.dot(b.direction));
            (0..3).for_each(|c| sum[c] += w * b.flux[c]);
        }
        let (weight, suns) =
            (weight + rest.at(d.y.clamp(-1.0, 1.0).acos()), beams_at(light.suns(), kernel, d));
        // Far narrower than a texel no weight is left: what it would see is the nearest one.
        let nearest = light.image.nearest(d);
        for (c, t) in texel.into_iter().enumerate() {
            let mean = if weight > 1e-30 { (f64::from(*t) + sum[c]) / weight } else { nearest[c].into() };
            *t = (mean * k[0] + suns[c]) as f32;
        }
    });
    Ok((image, Way::Near { order: plan.order, reach: plan.split.reach() }, plan.predicted))
}

/// The light itself as a [`FilteredImage`].
pub fn mirror_image(light: &Sampled, (layout, width, height): Shape) -> FilteredImage {
    let mut image = light.mirror(layout, width, height);
    let (energy_out, _) = finish(&mut image, false);
    let energy_in = light.flux();
    FilteredImage { image, way: Way::Area, predicted: 0.0, clipped: 0.0, energy_in, energy_out }
}

/// Calls `f(scratch, d, texel)` for every texel in use, rows in parallel.
fn for_texels(image: &mut SphereImage, f: impl Fn(&mut Scratch, DVec3, [&mut f32; 3]) + Sync) {
    let (layout, width, height) = (image.layout, image.width, image.height);
    let [r, g, b] = image.planes.each_mut().map(|p| p.par_chunks_mut(width.max(1)));
    r.zip(g).zip(b).enumerate().for_each_init(Scratch::default, |scratch, (row, ((r, g), b))| {
        for (i, ((r, g), b)) in r.iter_mut().zip(g).zip(b).enumerate() {
            if let Some(d) = layout.texel_direction(width, height, row / height, i, row % height) {
                f(scratch, d, [r, g, b]);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;
    use crate::deviation;
    use steradian_light::{DiskLight, Environment, Lights};

    /// Smooth light, a window and a spark.
    fn lights() -> Lights {
        let mut image = SphereImage::from_fn(Layout::LatLong, 128, 64, |d| {
            let window = if d.z > 0.8 && d.y.abs() < 0.3 { 6.0 } else { 0.0 };
            [1.0 + 0.8 * d.x as f32, 0.3 + window, 0.1 + (d.y as f32).max(0.0)]
        });
        let k = image.index(0, 90, 20);
        (0..3).for_each(|c| image.planes[c][k] = 20_000.0);
        Lights::from(Environment { image })
    }

    #[test]
    fn every_kernel_and_width_is_the_sum_over_texels() {
        let lights = lights();
        for w in [0.01_f64, 0.02, 0.05, 0.15, 0.5, 1.0] {
            // Compact kernels narrower than half a texel see one texel or none.
            let compact = w.max(0.03);
            let n = 2.0 / (compact * compact);
            for kernel in [
                Lobe::ggx(w),
                Lobe::beckmann(compact),
                Lobe::charlie(w.max(0.15)),
                Lobe::blinn_phong(n),
                Lobe::phong(n),
                Lobe::gaussian(compact),
            ] {
                let light = Sampled::new(&lights, &[&kernel], 2e-3, &Task::quiet()).unwrap();
                for (layout, a, b) in [(Layout::Cube, 12, 12), (Layout::LatLong, 30, 15)] {
                    let got = filter_image(&light, &kernel, (layout, a, b), 2e-3, &Task::quiet()).unwrap();
                    assert!(got.image.planes.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
                    let e = deviation(&light, &kernel, &got.image, 40);
                    assert!(e.rms < 1e-3 && e.bias.abs() < 1e-3, "{kernel:?}: {e:?} {:?}", got.way);
                    assert!(e.worst < 1e-2, "{kernel:?}: {e:?} {:?}", got.way);
                }
            }
        }
    }

    #[test]
    fn a_constant_stays_and_a_sun_is_its_lobe() {
        let constant = SphereImage::from_fn(Layout::LatLong, 32, 16, |_| [2.0, 1.0, 0.0]);
        let mut lights = Lights::from(Environment { image: constant });
        let kernel = Lobe::ggx(0.2);
        let run = |lights: &Lights| {
            let light = Sampled::new(lights, &[&kernel], 1e-3, &Task::quiet()).unwrap();
            filter_image(&light, &kernel, (Layout::Cube, 8, 8), 1e-3, &Task::quiet()).unwrap()
        };
        let got = run(&lights);
        assert!(got.image.planes[0].iter().all(|v| (v - 2.0).abs() < 1e-4));
        assert!((got.energy_out[0] / got.energy_in[0] - 1.0).abs() < 1e-4);
        lights.disks.push(DiskLight { direction: DVec3::Y, angular_radius: 0.005, radiance: [1e4; 3] });
        let with = run(&lights);
        let flux = lights.disks[0].solid_angle() * 1e4;
        for (face, i, j) in [(2, 4, 4), (0, 3, 0)] {
            let d = Layout::Cube.texel_direction(8, 8, face, i, j).unwrap();
            let more = f64::from(with.image.texel(face, i, j)[0] - got.image.texel(face, i, j)[0]);
            let expected = flux * kernel.value(d.y);
            assert!((more - expected).abs() < 1e-3 * expected, "{more} {expected}");
        }
    }

    #[test]
    fn mirrors_keep_the_flux() {
        let mut lights = lights();
        lights.disks.push(DiskLight { direction: DVec3::X, angular_radius: 0.05, radiance: [100.0; 3] });
        let light = Sampled::new(&lights, &[], 1e-3, &Task::quiet()).unwrap();
        let m = mirror_image(&light, (Layout::Cube, 16, 16));
        for c in 0..3 {
            let ratio = m.energy_out[c] / m.energy_in[c];
            assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
        }
    }

    #[test]
    fn enlarged_mirrors_are_not_negative_and_keep_the_flux() {
        let light = Sampled::new(&lights(), &[], 1e-3, &Task::quiet()).unwrap();
        for (layout, w, h) in [(Layout::Cube, 96, 96), (Layout::Cube, 200, 200), (Layout::LatLong, 400, 200)]
        {
            let m = mirror_image(&light, (layout, w, h));
            assert!(m.image.planes.iter().flatten().all(|v| *v >= 0.0));
            for c in 0..3 {
                let ratio = m.energy_out[c] / m.energy_in[c];
                assert!((ratio - 1.0).abs() < 2e-3, "{layout:?} {w}: {ratio}");
            }
        }
    }

    /// The sum over texels divides by itself, whichever way it is taken.
    #[test]
    fn coarse_constants_stay() {
        let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |_| [2.0, 1.0, 0.5]);
        let lights = Lights::from(Environment { image });
        for kernel in [
            Lobe::lambert(),
            Lobe::ggx(0.03),
            Lobe::ggx(0.05),
            Lobe::ggx(0.3),
            Lobe::charlie(0.5),
            Lobe::phong(40.0),
            Lobe::gaussian(0.1),
        ] {
            for tolerance in [2e-3, 1e-4, 1e-5] {
                let light = Sampled::new(&lights, &[&kernel], tolerance, &Task::quiet()).unwrap();
                for (layout, w, h) in
                    [(Layout::Cube, 24, 24), (Layout::LatLong, 64, 32), (Layout::Octahedral, 32, 32)]
                {
                    let got =
                        filter_image(&light, &kernel, (layout, w, h), tolerance, &Task::quiet()).unwrap();
                    for (plane, l) in got.image.planes.iter().zip([2.0_f32, 1.0, 0.5]) {
                        let worst = plane.iter().map(|v| (v / l - 1.0).abs()).fold(0.0, f32::max);
                        assert!(worst < 1e-5, "{kernel:?} {tolerance} {layout:?}: {worst:e} {:?}", got.way);
                    }
                }
            }
        }
    }

    #[test]
    fn turning_the_light_turns_the_map() {
        let kernel = Lobe::ggx(0.1);
        let run = |image: SphereImage| {
            let lights = Lights::from(Environment { image });
            let light = Sampled::new(&lights, &[&kernel], 1e-3, &Task::quiet()).unwrap();
            filter_image(&light, &kernel, (Layout::LatLong, 32, 16), 1e-3, &Task::quiet()).unwrap().image
        };
        let image = lights().environment.unwrap().image.clone();
        let mut turned = image.clone();
        // 32 columns of 128 are 8 of 32.
        turned.planes.iter_mut().for_each(|p| p.chunks_exact_mut(128).for_each(|r| r.rotate_left(32)));
        let (mut a, b) = (run(image), run(turned));
        a.planes.iter_mut().for_each(|p| p.chunks_exact_mut(32).for_each(|r| r.rotate_left(8)));
        for (x, y) in a.planes.iter().flatten().zip(b.planes.iter().flatten()) {
            assert!((x - y).abs() < 1e-4 * x.max(1.0), "{x} {y}");
        }
    }
}
