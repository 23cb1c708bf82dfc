//! How far a filtered image is from the sum over all texels of the light.

use crate::Zonal;
use crate::sampled::{Sampled, beams_at};
use crate::texels::{NOTHING, Texels};
use glam::DVec3;
use steradian_sphere::SphereImage;

/// How far an image is from the sum over all texels, at some of its texels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// RMS of the error at the texels compared, over the RMS of the whole image: in an image of a few lamps most texels
    /// are dark, and an error there counts for what it is.
    pub rms: f64,
    /// Mean error at the texels compared, over the mean of the whole image.
    pub bias: f64,
    /// Largest |error|/reference of a channel.
    pub worst: f64,
    /// Texels that were compared.
    pub texels: usize,
}

/// Compares `n` texels, spread over the image, with the sum over all texels of the light.
pub fn deviation(light: &Sampled, kernel: &dyn Zonal, image: &SphereImage, n: usize) -> Deviation {
    let k0 = kernel.coefficients(0)[0];
    let all = image.planes[0].len();
    let n = n.min(all);
    let sums = Texels::new(&light.image);
    // Steps of the golden ratio meet faces, rows and columns evenly.
    let texel = |i: usize| ((i as f64 * 0.618_033_988_749_894_9).fract() * all as f64) as usize;
    let place = |k: usize| {
        let (i, row) = (k % image.width, k / image.width);
        let (face, j) = (row / image.height, row % image.height);
        let d = image.layout.texel_direction(image.width, image.height, face, i, j)?;
        Some((d, image.texel(face, i, j).map(f64::from)))
    };
    let (directions, got): (Vec<DVec3>, Vec<[f64; 3]>) = (0..n).map(texel).filter_map(place).unzip();
    let exact = |(d, (sum, weight)): (&DVec3, ([f64; 3], f64))| {
        let suns = beams_at(light.suns(), kernel, *d);
        // A needle between texels sees none: what it would see is the nearest one.
        let nearest = light.image.nearest(*d);
        let mean = |c: usize| if weight > NOTHING { sum[c] / weight } else { nearest[c].into() };
        std::array::from_fn(|c| k0 * mean(c) + suns[c])
    };
    let pairs: Vec<_> =
        got.into_iter().zip(directions.iter().zip(sums.all(kernel, &directions)).map(exact)).collect();
    summary(&pairs, &image.planes)
}

fn summary(pairs: &[([f64; 3], [f64; 3])], planes: &[Vec<f32>; 3]) -> Deviation {
    let mean = |f: fn(f64) -> f64| {
        let sum: f64 = planes.iter().flatten().map(|v| f(f64::from(*v))).sum();
        sum / (3 * planes[0].len()).max(1) as f64
    };
    let (root, level) = (mean(|v| v * v).sqrt(), mean(|v| v));
    let (mut error2, mut error, mut worst) = (0.0, 0.0, 0.0_f64);
    let floor = (1e-6 * root).max(f64::MIN_POSITIVE);
    for (got, exact) in pairs.iter().flat_map(|(g, e)| g.iter().zip(e)) {
        error2 += (got - exact).powi(2);
        error += got - exact;
        worst = worst.max((got - exact).abs() / exact.abs().max(floor));
    }
    let n = (3 * pairs.len()).max(1) as f64;
    let ratio = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
    Deviation {
        rms: ratio((error2 / n).sqrt(), root),
        bias: ratio(error / n, level),
        worst,
        texels: pairs.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;
    use steradian_light::{Environment, Lights};
    use steradian_sphere::Layout;

    /// The sum that is quick is the plain one.
    #[test]
    fn sums_in_single_precision_are_those_in_double() {
        let image = SphereImage::from_fn(Layout::LatLong, 96, 48, |d| {
            [1.0 + d.x as f32, if d.z > 0.9 { 300.0 } else { 0.1 }, (d.y as f32).max(0.0)]
        });
        let lights = Lights::from(Environment { image });
        let task = steradian_base::Task::quiet();
        for kernel in
            [Lobe::ggx(0.03), Lobe::ggx(1.0), Lobe::phong(200.0), Lobe::charlie(0.5), Lobe::gaussian(0.5)]
        {
            let light = Sampled::new(&lights, &[&kernel], 1e-3, &task).unwrap();
            let sums = Texels::new(&light.image);
            let directions =
                [DVec3::Y, DVec3::new(0.3, -0.5, 0.7).normalize(), DVec3::new(-1.0, 0.02, 0.0).normalize()];
            for (d, (sum, weight)) in directions.iter().zip(sums.all(&kernel, &directions)) {
                let d = *d;
                let exact = light.brute_force(&kernel, 1.0, d);
                for c in 0..3 {
                    let got = sum[c] / weight;
                    assert!(
                        (got - exact[c]).abs() < 2e-6 * exact[c] + 1e-9,
                        "{kernel:?} {d}: {got} {}",
                        exact[c]
                    );
                }
            }
        }
    }
}
