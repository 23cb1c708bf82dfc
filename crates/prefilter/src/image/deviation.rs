//! Measured error of a filtered image against the integral over all texels of the light.

use super::texel_sums::{Scratch, TexelSums};
use crate::Zonal;
use crate::light::sampled::{Sampled, small_lights_at};
use glam::DVec3;
use steradian_parallel::prelude::*;
use steradian_sphere::SphereImage;

/// Error of an image against the sum over all texels, measured at some of its texels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// RMS of the error at the texels compared, over the RMS of the whole image: in an image of a few lamps
    /// most texels are dark, and an absolute error there counts no more than elsewhere. Where the light's
    /// image was too large and was reduced, an estimate of the effect is included.
    pub rms: f64,
    /// Mean error at the texels compared, over the mean of the whole image.
    pub bias: f64,
    /// Largest |error|/reference of a channel.
    pub worst: f64,
    /// Texels that were compared.
    pub texels: usize,
}

/// A texel that is compared: its direction, its value, and its weight, the number of the image's texels that
/// it represents over their total.
struct Pick {
    direction: DVec3,
    value: [f64; 3],
    share: f64,
}

/// Compares `n` texels with the integral over all texels of the light. A third of them is spread evenly, a
/// third is drawn by the texels' values and a third by their squares: errors are largest where the map is
/// bright, around a sun, and few texels are there.
pub fn deviation(light: &Sampled, kernel: &dyn Zonal, image: &SphereImage, n: usize) -> Deviation {
    let sums = TexelSums::new(&light.image);
    let compare = |scratch: &mut Scratch, p: &Pick| {
        let (sum, suns) =
            (sums.all(kernel, p.direction, scratch), small_lights_at(light.suns(), kernel, p.direction));
        std::array::from_fn(|c| sum[c] + suns[c])
    };
    let picks = picks(image, n);
    let exact: Vec<[f64; 3]> = picks.par_iter().map_init(Scratch::default, compare).collect();
    let found = summary(&picks, &exact, &image.planes);
    Deviation { rms: found.rms.hypot(light.error_of_reduction(kernel)), ..found }
}

fn picks(image: &SphereImage, n: usize) -> Vec<Pick> {
    let all = image.planes[0].len();
    let square = |k: usize| image.planes.iter().map(|p| f64::from(p[k]).powi(2)).sum::<f64>();
    let (mut first, mut second) = (0.0, 0.0);
    for k in 0..all {
        (first, second) = (first + square(k).sqrt(), second + square(k));
    }
    let part = |x: f64, of: f64| if of > 0.0 { x / of } else { 1.0 / all as f64 };
    let odds = |k: usize| (1.0 / all as f64 + part(square(k).sqrt(), first) + part(square(k), second)) / 3.0;
    let (mut out, mut sum) = (Vec::new(), 0.0);
    for k in 0..all {
        let odds = if n >= all { 1.0 / all as f64 } else { odds(k) };
        sum += odds;
        // Equal steps of the sum of odds, half a step from its ends.
        let due = if n >= all { k + 1 } else { (sum * n as f64 + 0.5).floor() as usize };
        let times = due.saturating_sub(out.len()).min(n - out.len().min(n));
        let (i, row) = (k % image.width, k / image.width);
        let (face, j) = (row / image.height, row % image.height);
        let Some(direction) = image.layout.texel_direction(image.width, image.height, face, i, j) else {
            continue;
        };
        let value = image.texel(face, i, j).map(f64::from);
        let share = 1.0 / (odds * all as f64);
        out.extend((0..times).map(|_| Pick { direction, value, share }));
    }
    out
}

fn summary(picks: &[Pick], exact: &[[f64; 3]], planes: &[Vec<f32>; 3]) -> Deviation {
    let mean = |f: fn(f64) -> f64| {
        let sum: f64 = planes.iter().flatten().map(|v| f(f64::from(*v))).sum();
        sum / (3 * planes[0].len()).max(1) as f64
    };
    let (root, level) = (mean(|v| v * v).sqrt(), mean(|v| v));
    let (mut error2, mut error, mut worst) = (0.0, 0.0, 0.0_f64);
    let floor = (1e-6 * root).max(f64::MIN_POSITIVE);
    for (p, exact) in picks.iter().zip(exact) {
        for (got, exact) in p.value.iter().zip(exact) {
            error2 += p.share * (got - exact).powi(2);
            error += p.share * (got - exact);
            worst = worst.max((got - exact).abs() / exact.abs().max(floor));
        }
    }
    let n = (3 * picks.len()).max(1) as f64;
    let ratio = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
    Deviation {
        rms: ratio((error2 / n).sqrt(), root),
        bias: ratio(error / n, level),
        worst,
        texels: picks.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;
    use steradian_light::{Environment, Lights};
    use steradian_sphere::Layout;

    /// The fast sums agree with those in double precision over every cell.
    #[test]
    fn sums_in_single_precision_are_those_in_double() {
        for (rows, bright) in [(48, 300.0), (8, 20.0)] {
            let image = SphereImage::from_fn(Layout::LatLong, 2 * rows, rows, |d| {
                [1.0 + d.x as f32, if d.z > 0.9 { bright } else { 0.1 }, (d.y as f32).max(0.0)]
            });
            let lights = Lights::from(Environment { image });
            let task = steradian_base::Task::quiet();
            for kernel in [
                Lobe::ggx(0.003),
                Lobe::ggx(0.03),
                Lobe::ggx(1.0),
                Lobe::phong(200.0),
                Lobe::charlie(0.5),
                Lobe::gaussian(0.5),
                Lobe::gaussian(1e-4),
            ] {
                let light = Sampled::new(&lights, &[], 1e-3, &task).unwrap();
                let sums = TexelSums::new(&light.image);
                for d in [DVec3::Y, DVec3::new(0.3, -0.5, 0.7), DVec3::new(-1.0, 0.02, 0.0)] {
                    let d = d.normalize();
                    let got = sums.all(&kernel, d, &mut Scratch::default());
                    let exact = light.brute_force(&kernel, d);
                    for c in 0..3 {
                        let close = 5e-5 * exact[c] + 1e-6 * f64::from(bright);
                        assert!((got[c] - exact[c]).abs() < close, "{kernel:?} {d}: {got:?} {exact:?}");
                    }
                }
            }
        }
    }

    /// The error stated from some texels is that of all, where the light is a small sun, stripes or night:
    /// never much less.
    #[test]
    fn what_is_stated_is_the_error_of_all_texels() {
        let sun = DVec3::new(0.3, 0.6, -0.5).normalize();
        let lights: [&(dyn Fn(DVec3) -> f32 + Sync); 3] = [
            &|d| if d.dot(sun) > 0.9995 { 20_000.0 } else { 0.3 },
            &|d| if (9.0 * d.y).sin() > 0.0 { 3.0 } else { 0.01 },
            &|d| if d.dot(sun) > 0.999 { 5.0 } else { 1e-4 },
        ];
        let task = steradian_base::Task::quiet();
        for light in lights {
            let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |d| [light(d); 3]);
            let lights = Lights::from(Environment { image });
            for kernel in [Lobe::ggx(0.02), Lobe::ggx(0.15), Lobe::phong(60.0)] {
                let light = Sampled::new(&lights, &[&kernel], 1e-2, &task).unwrap();
                for tolerance in [0.2, 1e-2] {
                    let shape = (Layout::Cube, 16, 16);
                    let mut map =
                        crate::filter_image(&light, &kernel, shape, tolerance, &task).unwrap().image;
                    let peak = map.planes[0].iter().fold(0.0_f32, |m, v| m.max(*v));
                    for p in &mut map.planes {
                        p.iter_mut().filter(|v| **v > 0.2 * peak).for_each(|v| *v *= 1.0 + tolerance as f32);
                    }
                    let stated = deviation(&light, &kernel, &map, 64).rms;
                    let exact = deviation(&light, &kernel, &map, usize::MAX).rms;
                    assert!(stated > exact / 1.25, "{kernel:?} {tolerance}: {stated:e} of {exact:e}");
                }
            }
        }
    }
}
