//! Probes at which a technique's error is measured: normals, views and tangents of all kinds, and those that
//! see suns.
//!
//! Uniform probes hardly ever meet a sun, whose reflection holds most of the mean square of all radiance. So
//! where the light has small bright parts, as many probes again have their lobe point at one of them or near
//! it. Both kinds together are a sample of the mixture of their densities (Veach & Guibas 1995, *Optimally
//! Combining Sampling Techniques*, the balance heuristic): a probe's weight is the inverse of n_u + n_s p/u,
//! where u is the uniform density and p that of the other kind. With the local view given a frame is uniform
//! exactly if the direction in which one fixed local axis points is, and the turn about it; so p/u = 4π
//! p_s(axis in the world), in the mean over the axes that the lobe is said to have.

use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::{PI, TAU};
use steradian_brdf::Lobe;
use steradian_prefilter::{Tree, probe};
use steradian_sphere::Frame;

/// Views take every STRIDE-th belt of elevation. Prime to the number of probes, which is a power of two, so
/// that each belt is taken once; and far from the golden section of that number, by which the normals'
/// azimuths advance.
const STRIDE: usize = 193;

/// Angular radii, radians, of the caps about a bright part of the light towards which probes point their
/// lobes. Each radius is drawn as often: lobes may be of any width, and one of the radii is close to it.
const CAPS: [f64; 4] = [0.01, 0.03, 0.1, 0.3];
/// Definition of a bright part of the light: at least the second number, a part of the flux, within about the
/// first, an angle in radians.
const PEAK: (f64, f64) = (0.02, 2e-3);
/// Most bright parts.
const MOST: usize = 32;
/// Largest n·wo of the extra probes with grazing views: 85° from the normal and beyond. There are more of
/// them than their solid angle calls for.
const GRAZING: f64 = 0.0872;
/// Least n·wo of the extra grazing probes that are spread evenly in ln(n·wo): 89.94°. A reflectance that is
/// unbounded at grazing angles, such as f ∝ (n·wi n·wo)^(−1/2) of Ward 1992, has as much of its mean square
/// in each octave of n·wo as in any other.
const HORIZON: f64 = 1e-3;
/// Each of the two kinds of extra grazing probes has one probe per so many ordinary ones.
const ONE_IN: usize = 8;
/// Number of directions that sample a lobe whose ridge is a circle.
const ROUND: usize = 8;

/// A probe.
#[derive(Debug, Clone, Copy)]
pub struct Probe {
    /// Local frame of the probe, in world axes.
    pub frame: Frame,
    /// Direction to the viewer in that frame.
    pub wo: DVec3,
    /// Weight in sums over probes: inverse of the density that the probe was drawn with, relative to uniform.
    pub weight: f64,
}

/// Distribution of n·wo over the probes of a set.
#[derive(Debug, Clone, Copy)]
enum Views {
    /// Uniform over 0 … the value.
    To(f64),
    /// Uniform in ln(n·wo) over [`HORIZON`] … [`GRAZING`].
    Logarithmic,
}

impl Views {
    /// Maps a uniform number in 0 … 1 to n·wo.
    fn cosine(self, u: f64) -> f64 {
        match self {
            Self::To(most) => most * u,
            Self::Logarithmic => GRAZING * (HORIZON / GRAZING).powf(1.0 - u),
        }
    }

    /// Density at n·wo = `cosine`, of integral 1.
    fn density(self, cosine: f64) -> f64 {
        match self {
            Self::To(most) if cosine < most => 1.0 / most,
            Self::Logarithmic if (HORIZON..GRAZING).contains(&cosine) => {
                1.0 / (cosine * (GRAZING / HORIZON).ln())
            }
            _ => 0.0,
        }
    }
}

/// `count` uniform probes, a power of two, and two eighths of `count` more with grazing views; where the
/// light has bright parts, as many again whose lobes point at those. Another `shift` in 0 … 1 gives other
/// probes; certificates use 0.
pub fn all(count: usize, shift: f64, light: &Tree, lobes: &dyn Fn(DVec3) -> Vec<Lobe>) -> Vec<Probe> {
    let grazing = count.div_ceil(ONE_IN);
    let sets = [(count, Views::To(1.0)), (grazing, Views::To(GRAZING)), (grazing, Views::Logarithmic)];
    let uniform = sets.into_iter().flat_map(|(n, v)| (0..n).map(move |k| moved(point(k, n, v), shift)));
    // The density of all views over that of uniform ones.
    let times = |wo: DVec3| sets.iter().map(|(n, v)| *n as f64 / count as f64 * v.density(wo.z)).sum::<f64>();
    let peaks = light.peaks(PEAK.0, PEAK.1, MOST);
    if peaks.is_empty() {
        return uniform.map(|(frame, wo)| Probe { frame, wo, weight: 1.0 / times(wo) }).collect();
    }
    let suns = Suns::new(peaks);
    let directed = |k: usize, count: usize, views: Views| {
        let wo = moved(point(k, count, views), shift).1;
        let axes = axes(lobes(wo), wo);
        let u = |by: f64| (k as f64 * by + shift).fract();
        let axis = axes[((u(0.324_717_957) * axes.len() as f64) as usize).min(axes.len() - 1)];
        let towards = suns.draw(
            ((k as f64 + 0.5) / count as f64 + shift).fract(),
            [u(0.618_033_989), u(0.754_877_666), u(0.569_840_291)],
        );
        let turn = DQuat::from_axis_angle(towards, TAU * u(0.819_172_513));
        let r = DMat3::from_quat(turn * DQuat::from_rotation_arc(axis, towards));
        (Frame { t: r.x_axis, b: r.y_axis, n: r.z_axis }, wo)
    };
    let directed: Vec<_> = sets
        .into_iter()
        .flat_map(|(n, views)| (0..n).map(move |k| (k, n, views)))
        .map(|(k, n, views)| directed(k, n, views))
        .collect();
    let weighed = |(frame, wo): (Frame, DVec3)| {
        let axes = axes(lobes(wo), wo);
        let p = axes.iter().map(|a| suns.density(frame.to_world(*a))).sum::<f64>() / axes.len() as f64;
        Probe { frame, wo, weight: 1.0 / ((1.0 + 4.0 * PI * p) * times(wo)) }
    };
    uniform.chain(directed).map(weighed).collect()
}

/// Frame and local view direction of probe `k` of `probes`, a power of two: normals spread over the sphere,
/// views over the part of the hemisphere about each that `views` says, tangents over the circle.
fn point(k: usize, probes: usize, views: Views) -> (Frame, DVec3) {
    let n = probe::direction(k, probes);
    // One view in each of as many belts of equal probability as there are probes, in an order that has
    // nothing to do with that of the normals.
    let belt = (k * STRIDE) % probes;
    let cosine = views.cosine((belt as f64 + 0.5) / probes as f64);
    let phi = TAU * (k as f64 * 0.569_840_291).fract();
    let s = (1.0 - cosine * cosine).sqrt();
    let level = Frame::from_normal(n);
    let wo = level.to_world(DVec3::new(s * phi.cos(), s * phi.sin(), cosine));
    // The conventional tangent is always level: fibres and anisotropic lobes must be seen in every direction.
    let turn = TAU * (k as f64 * 0.754_877_666 + 0.5).fract();
    let frame = Frame::from_normal_tangent(n, level.t * turn.cos() + level.b * turn.sin());
    (frame, frame.to_local(wo))
}

/// A uniform probe turned in the world, with its view turned about its normal.
fn moved((frame, wo): (Frame, DVec3), shift: f64) -> (Frame, DVec3) {
    let r = DMat3::from_rotation_x(2.0 * shift) * DMat3::from_rotation_y(5.0 * shift);
    let (s, c) = (TAU * shift).sin_cos();
    let wo = DVec3::new(wo.x * c - wo.y * s, wo.x * s + wo.y * c, wo.z);
    (Frame { t: r * frame.t, b: r * frame.b, n: r * frame.n }, wo)
}

/// Directions in which the lobes of a view point; the mirror direction where nothing is said.
fn axes(lobes: Vec<Lobe>, wo: DVec3) -> Vec<DVec3> {
    let circle = |axis: DVec3, cosine: f64| {
        let (a, b) = axis.any_orthonormal_pair();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let one = move |k: usize| {
            let (s, c) = (TAU * k as f64 / ROUND as f64).sin_cos();
            axis * cosine + (a * c + b * s) * sine
        };
        (0..ROUND).map(one).collect::<Vec<_>>()
    };
    let mut out: Vec<DVec3> = Vec::new();
    for lobe in lobes {
        match lobe {
            Lobe::Axis { axis, .. } => out.push(axis),
            Lobe::Cone { axis, cosine, .. } => out.extend(circle(axis, cosine)),
            Lobe::Arc { normal, .. } => out.extend(circle(normal, 0.0)),
        }
    }
    out.retain(|d| (d.length_squared() - 1.0).abs() < 1e-6);
    if out.is_empty() {
        out.push(DVec3::new(-wo.x, -wo.y, wo.z));
    }
    out
}

/// Directions of the bright parts of the light, each with its share of the flux of all of them.
struct Suns(Vec<(DVec3, f64)>);

impl Suns {
    fn new(mut peaks: Vec<(DVec3, f64)>) -> Self {
        let all: f64 = peaks.iter().map(|p| p.1).sum();
        peaks.iter_mut().for_each(|p| p.1 /= all);
        Self(peaks)
    }

    /// A direction by four uniform numbers: which part, which cap, where in it.
    fn draw(&self, mut which: f64, [cap, height, turn]: [f64; 3]) -> DVec3 {
        let mut centre = self.0[self.0.len() - 1].0;
        for (d, share) in &self.0 {
            if which < *share {
                centre = *d;
                break;
            }
            which -= share;
        }
        let radius = CAPS[((cap * CAPS.len() as f64) as usize).min(CAPS.len() - 1)];
        let versine = height * (1.0 - radius.cos());
        let (a, b) = centre.any_orthonormal_pair();
        let (s, c) = (TAU * turn).sin_cos();
        (centre * (1.0 - versine) + (a * c + b * s) * (versine * (2.0 - versine)).sqrt()).normalize()
    }

    /// Probability density of [`Suns::draw`] per steradian.
    fn density(&self, d: DVec3) -> f64 {
        let one = |(centre, share): &(DVec3, f64)| {
            let angle = centre.angle_between(d);
            let caps = CAPS.iter().filter(|r| angle <= **r);
            share * caps.map(|r| 1.0 / (TAU * (1.0 - r.cos()))).sum::<f64>() / CAPS.len() as f64
        };
        self.0.iter().map(one).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_base::Task;
    use steradian_prefilter::SmallLight;

    /// Tangents go everywhere, and do not move the views of isotropic reflectance.
    #[test]
    fn tangents_cover_the_sphere() {
        let mut moment = DMat3::ZERO;
        for k in 0..256 {
            let t = point(k, 256, Views::To(1.0)).0.t;
            moment += DMat3::from_cols(t * t.x, t * t.y, t * t.z) * (3.0 / 256.0);
        }
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
            let want = if i == j { 1.0 } else { 0.0 };
            assert!((moment.col(i)[j] - want).abs() < 0.06, "{moment}");
        }
    }

    /// Weighed, both kinds together are uniform: means of functions of the normal, of the mirror direction
    /// near the sun and of a fibre's cone come out.
    #[test]
    fn both_kinds_together_are_uniform() {
        let sun = DVec3::new(0.2, 0.9, -0.4).normalize();
        let small_light = SmallLight { direction: sun, radius: 0.005, flux: [1.0; 3], cell: None };
        let tree = Tree::new(None, &[small_light], &Task::quiet()).expect("nobody cancels");
        let mirror = |wo: DVec3| vec![Lobe::Axis { axis: DVec3::new(-wo.x, -wo.y, wo.z), width: 0.1 }];
        let cone = |wo: DVec3| vec![Lobe::Cone { axis: DVec3::X, cosine: -wo.x, width: 0.1 }];
        let near = |d: DVec3, radius: f64| f64::from(u8::from(d.angle_between(sun) < radius));
        let share = |radius: f64| 0.5 * (1.0 - radius.cos());
        for lobes in [&mirror as &dyn Fn(DVec3) -> Vec<Lobe>, &cone] {
            let probes = all(1 << 14, 0.0, &tree, lobes);
            assert_eq!(probes.len(), (1 << 15) + (1 << 13));
            let whole: f64 = probes.iter().map(|p| p.weight).sum();
            let mean =
                |f: &dyn Fn(&Probe) -> f64| probes.iter().map(|p| p.weight * f(p)).sum::<f64>() / whole;
            let towards = |p: &Probe| p.frame.to_world(DVec3::new(-p.wo.x, -p.wo.y, p.wo.z));
            assert!((whole / 16384.0 - 1.0).abs() < 0.02, "{whole}");
            assert!(mean(&|p| p.frame.n.dot(sun)).abs() < 0.02);
            for c in [0.003, 0.03, GRAZING, 0.5] {
                assert!((mean(&|p| f64::from(u8::from(p.wo.z < c))) / c - 1.0).abs() < 0.03, "{c}");
            }
            assert!((mean(&|p| p.frame.t.dot(sun).powi(2)) - 1.0 / 3.0).abs() < 0.02);
            for radius in [0.02, 0.1, 0.25] {
                let seen = mean(&|p| near(towards(p), radius)) / share(radius);
                // The probes in the cap have unequal weights: σ is that of a weighted sum.
                let met = probes.iter().filter(|p| near(towards(p), radius) > 0.0).map(|p| p.weight);
                let [sum, squares] = met.fold([0.0; 2], |s, w| [s[0] + w, s[1] + w * w]);
                let sigma = squares.sqrt() / sum;
                assert!((seen - 1.0).abs() < (5.0 * sigma).max(0.05), "{radius}: {seen} ± {sigma}");
            }
        }
    }
}
