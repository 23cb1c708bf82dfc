//! Choice of the method of filtering: the cheapest within the tolerance, and the most exact where none meets
//! it.

use super::bands::{self, cost, with_bright_texels};
use super::texel_sums::TexelSums;
use crate::Zonal;
use crate::kernel::split::Split;
use crate::light::sampled::{MAX_ORDER, Sampled, TAIL};

/// Part of the tolerance allowed to an error bound.
const SHARE: f64 = 0.25;

/// The chosen method with its settings.
pub(crate) enum Plan<'a> {
    Frequency(Frequency),
    Near(Near<'a>),
    /// The sum over all texels as it is.
    All,
}

/// An error bound above this part of the tolerance is not relied upon where the sum over all texels is
/// affordable …
const DOUBTFUL: f64 = 0.5;
/// … that is, takes no more kernel evaluations than this.
const AT_HAND: f64 = 2e9;

/// Filtering by the series alone.
pub(crate) struct Frequency {
    pub order: usize,
    /// Do the brightest texels go through the series?
    pub merged: bool,
    pub tail: f64,
}

/// Near texels directly.
pub(crate) struct Near<'a> {
    pub split: Split<'a>,
    /// Coefficients of the far part of the kernel.
    pub far: Vec<f64>,
    pub order: usize,
    pub merged: bool,
    pub predicted: f64,
}

/// Coefficients of a kernel, some bands beyond the analysis' among them.
pub(crate) fn coefficients(kernel: &dyn Zonal) -> Vec<f64> {
    kernel.coefficients(BANDS)
}

/// Highest band of coefficients.
const BANDS: usize = MAX_ORDER + 64;

/// The cheapest way within the tolerance; where none is, the sum over all texels if it is not too long, else
/// the most exact one.
pub(crate) fn plan<'a>(
    light: &Sampled,
    kernel: &'a dyn Zonal,
    k: &[f64],
    texels: usize,
    tolerance: f64,
) -> Plan<'a> {
    let (f, tail) = bands::order(light, k, k, TAIL * tolerance);
    let (order, merged) = with_bright_texels(light, k, k, f, texels, tolerance);
    let bright_texels = |merged: bool| if merged { 0 } else { light.bright_texels().len() };
    let of_bright_texels = |merged: bool| {
        if merged && !light.bright_texels().is_empty() { bands::BRIGHT_TEXELS * tolerance } else { 0.0 }
    };
    let tail = tail + of_bright_texels(merged);
    let limit = SHARE * tolerance;
    let enough = tail <= limit;
    let price = cost::series(order, texels) + cost::values(bright_texels(merged), texels);
    let mut best: Option<Near<'a>> = None;
    for (expected, split) in splits(light, kernel, texels) {
        if enough && expected >= price {
            break;
        }
        let far = split.far(BANDS);
        let (order, rest) = bands::order(light, &far, k, TAIL * tolerance);
        let (order, merged) = with_bright_texels(light, &far, k, order, texels, tolerance);
        let predicted = rest + of_bright_texels(merged);
        let within = predicted <= limit;
        if within || best.as_ref().is_none_or(|b| predicted < b.predicted) {
            best = Some(Near { split, far, order, merged, predicted });
        }
        if within {
            break;
        }
    }
    let least = best.as_ref().map_or(tail, |b| b.predicted.min(tail));
    if least > DOUBTFUL * tolerance && (texels * light.image.planes[0].len()) as f64 <= AT_HAND {
        return Plan::All;
    }
    match best {
        // A kernel that is not smooth elsewhere gains nothing by being split.
        Some(near) if if enough { near.predicted <= limit } else { near.predicted < tail } => {
            Plan::Near(near)
        }
        _ => Plan::Frequency(Frequency { order, merged, tail }),
    }
}

/// Reaches of the near part and their costs, the cheapest first.
fn splits<'a>(light: &Sampled, kernel: &'a dyn Zonal, texels: usize) -> Vec<(f64, Split<'a>)> {
    let top = light.order();
    let (mut all, sums) = (Vec::new(), TexelSums::new(&light.image));
    for order in (0..5).map(|k| top >> k).filter(|&o| o >= 32) {
        for turns in [10.0, 14.0, 20.0, 30.0, 40.0] {
            let split = Split::new(kernel, order, turns);
            // χ has to change over more than a texel, or many nodes of each are needed.
            if split.reach() >= 2.0 * sums.size() {
                let near = cost::near(&light.image, &split, sums.size() / kernel.width(), texels);
                let direct = cost::far_values(light.bright_texels(), &split, texels);
                all.push((near + direct + cost::series(order, texels), split));
            }
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::ImageMethod;
    use crate::{Lobe, deviation, filter_image};
    use glam::DVec3;
    use std::f64::consts::PI;
    use steradian_base::Task;
    use steradian_light::{Environment, Lights};
    use steradian_sphere::{Layout, SphereImage};

    /// Sheen ends in a rim at the horizon that is far narrower than the kernel's distance from its axis.
    #[test]
    fn a_rim_at_the_horizon_is_met() {
        let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |d| {
            [1.0 + (7.0 * d.x).sin() as f32, if d.y > 0.3 { 4.0 } else { 0.2 }, 0.5 - 0.4 * d.z as f32]
        });
        let lights = Lights::from(Environment { image });
        let kernel = Lobe::charlie(0.02);
        let light = Sampled::new(&lights, &[&kernel], 2e-3, &Task::quiet()).unwrap();
        let got = filter_image(&light, &kernel, (Layout::Cube, 6, 6), 2e-3, &Task::quiet()).unwrap();
        let e = deviation(&light, &kernel, &got.image, 60);
        assert!(e.rms < 1e-3, "{:?} {e:?}", got.way);
    }

    /// Kernels far narrower than a texel read few texels around the direction, and still give the sum over
    /// all texels.
    #[test]
    fn sharp_kernels_reach_few_texels() {
        let rows = 256;
        let lamp = DVec3::new(0.3, 0.4, -0.8).normalize();
        let image = SphereImage::from_fn(Layout::LatLong, 2 * rows, rows, |d| {
            let bright = if d.dot(lamp) > 0.9995 { 3000.0 } else { 0.0 };
            [1.0 + 0.5 * (9.0 * d.x).sin() as f32 + bright, 0.4 + 0.3 * d.y as f32, 0.2 + bright]
        });
        let lights = Lights::from(Environment { image });
        for alpha in [4e-4, 1e-3, 4e-3] {
            let kernel = Lobe::ggx(alpha);
            let light = Sampled::new(&lights, &[&kernel], 2e-3, &Task::quiet()).unwrap();
            let got = filter_image(&light, &kernel, (Layout::Cube, 24, 24), 2e-3, &Task::quiet()).unwrap();
            let ImageMethod::Near { reach, .. } = got.way else { panic!("{alpha}: {:?}", got.way) };
            assert!(reach < 14.0 * PI / rows as f64, "{alpha}: reach {reach}");
            let e = deviation(&light, &kernel, &got.image, 200);
            assert!(got.predicted < 5e-4 && e.rms < got.predicted && e.worst < 1e-2, "{alpha}: {e:?}");
        }
    }
}
