//! c_i(wo) = ∫ y_i(wi) f_cos(wi, wo) dwi by a product rule in polar coordinates, graded around the lobes.
//!
//! Kautz, Sloan & Snyder (2002) take 1000 samples a view; a product of Gauss rules takes about as many nodes,
//! and errs by rounding where reflectance is smooth. Its pole is the normal, or, where the highlight is a
//! ridge about an axis in the surface (brushed metal), that axis: in both frames the hemisphere is a
//! rectangle of the two angles, and narrow features lie along a coordinate line.

use super::panels::{composite, panels};
use crate::central::Polar;
use crate::{Brdf, Domain, Lobe};
use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_simd::{Arch, Kernel, MAX_F64_LANES, Vector, run};
use steradian_sphere::quadrature::gauss_legendre;
use steradian_sphere::sh::{Rotation, count};

/// Longest panel, radians.
const MAX_LENGTH: f64 = 0.8;
/// Phase (length × order) of the longest panel: the largest rule integrates a wave of 12 radians to 1.4e-14.
const MAX_PHASE: f64 = 12.0;
/// Nodes of a panel over which the harmonics hardly vary, by default.
const FLAT: f64 = 5.0;
/// Nodes of the largest rule.
const MAX_NODES: usize = 15;
/// Widths of lobes, radians, are clamped to this range when panels are placed.
const WIDTHS: [f64; 2] = [1e-4, 0.6];
/// Scale of the integrand at the horizon, radians: that of the view's elevation, clamped to this range.
const HORIZON: [f64; 2] = [0.02, 0.3];

/// Rules for bands up to an order.
pub struct Rule {
    order: usize,
    flat: f64,
    polar: Polar,
    gauss: Vec<(Vec<f64>, Vec<f64>)>,
    /// Rotations from the frames whose pole is x and y to the local one.
    turns: [(DMat3, Rotation); 2],
}

/// Coefficients of one view.
#[derive(Debug, Clone)]
pub struct Projection {
    /// Coefficients by channel, at index l² + l + m.
    pub c: [Vec<f64>; 3],
    /// ∫ f_cos² dwi by channel.
    pub energy: [f64; 3],
}

/// Interval of one angle in which f_cos is narrow: centre and width.
type Place = (f64, f64);

/// The rectangle of a view's polar angles.
struct Plan<'a> {
    /// Columns x', y' and the pole z'.
    frame: DMat3,
    back: Option<&'a Rotation>,
    theta: [f64; 2],
    phi: [f64; 2],
    thetas: Vec<Place>,
    phis: Vec<Place>,
}

impl Rule {
    /// A rule for bands 0 … `order`.
    pub fn new(order: usize) -> Self {
        Self::with_nodes(order, FLAT)
    }

    /// A rule with `flat` nodes a panel where the harmonics hardly vary: with more than [`Rule::new`] has, it
    /// measures the error of that.
    pub fn with_nodes(order: usize, flat: f64) -> Self {
        let turn = |z: DVec3| {
            let frame = DMat3::from_cols(DVec3::Z, z.cross(DVec3::Z), z);
            (frame, Rotation::new(order, frame))
        };
        Self {
            order,
            flat,
            polar: Polar::new(order, order),
            gauss: (0..=MAX_NODES).map(gauss_legendre).collect(),
            turns: [turn(DVec3::X), turn(DVec3::Y)],
        }
    }

    /// The coefficients of f_cos(·, wo), wo.z > 0.
    pub fn project(&self, brdf: &dyn Brdf, wo: DVec3) -> Projection {
        let plan = self.plan(brdf, wo);
        let (thetas, phis) = (self.nodes(plan.theta, &plan.thetas), self.nodes(plan.phi, &plan.phis));
        // 1, then √2 cos mφ and √2 sin mφ, of every φ, times its weight; rows are filled up to whole
        // registers.
        let terms = (2 * self.order + 1).next_multiple_of(MAX_F64_LANES);
        let mut waves = vec![0.0; phis.len() * terms];
        for ([phi, w], wave) in phis.iter().zip(waves.chunks_exact_mut(terms)) {
            wave[0] = *w;
            for m in 1..=self.order {
                let (s, c) = (m as f64 * phi).sin_cos();
                wave[2 * m - 1] = std::f64::consts::SQRT_2 * w * c;
                wave[2 * m] = std::f64::consts::SQRT_2 * w * s;
            }
        }
        let across: Vec<(DVec3, f64)> = phis
            .iter()
            .map(|[phi, w]| (plan.frame.x_axis * phi.cos() + plan.frame.y_axis * phi.sin(), *w))
            .collect();
        let mut out =
            Projection { c: std::array::from_fn(|_| vec![0.0; count(self.order)]), energy: [0.0; 3] };
        let mut ring: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; terms]);
        let (mut wi, mut values) = (vec![DVec3::ZERO; across.len()], vec![[0.0; 3]; across.len()]);
        let mut weighted: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; across.len()]);
        let mut row = Vec::new();
        for [theta, w] in thetas {
            let (st, ct) = theta.sin_cos();
            for (wi, (d, _)) in wi.iter_mut().zip(&across) {
                *wi = plan.frame.z_axis * ct + *d * st;
            }
            brdf.f_cos_batch(&wi, wo, &mut values);
            let weight = w * st;
            for (k, (f, (_, wp))) in values.iter().zip(&across).enumerate() {
                for c in 0..3 {
                    weighted[c][k] = weight * f[c];
                    out.energy[c] += weight * wp * f[c] * f[c];
                }
            }
            let [red, green, blue] = &mut ring;
            run(Rings {
                f: [&weighted[0], &weighted[1], &weighted[2]],
                waves: &waves,
                out: [red, green, blue],
            });
            self.polar.for_each(st, ct, &mut row, |m, p| {
                for l in m..=self.order {
                    for c in 0..3 {
                        let at = l * l + l;
                        out.c[c][at + m] += p[l] * ring[c][(2 * m).max(1) - 1];
                        if m > 0 {
                            out.c[c][at - m] += p[l] * ring[c][2 * m];
                        }
                    }
                }
            });
        }
        if let Some(back) = plan.back {
            let mut turned = vec![0.0; count(self.order)];
            for c in &mut out.c {
                back.apply(c, &mut turned);
                c.copy_from_slice(&turned);
            }
        }
        out
    }

    fn plan(&self, brdf: &dyn Brdf, wo: DVec3) -> Plan<'_> {
        let lobes = brdf.lobes(wo);
        let ridge = lobes.iter().find_map(|l| match *l {
            Lobe::Cone { axis, .. } | Lobe::Arc { normal: axis, .. } => Some(axis),
            Lobe::Axis { .. } => None,
        });
        let along = |a: DVec3| ridge.is_some_and(|r| r.dot(a).abs() > 0.999);
        let turned = [DVec3::X, DVec3::Y].into_iter().position(along).map(|k| &self.turns[k]);
        let whole = brdf.domain() == Domain::Sphere;
        let (frame, back) = turned.map_or((DMat3::IDENTITY, None), |(frame, back)| (*frame, Some(back)));
        let mut plan =
            Plan { frame, back, theta: [0.0, PI], phi: [-PI, PI], thetas: Vec::new(), phis: Vec::new() };
        let rim = wo.z.clamp(HORIZON[0], HORIZON[1]);
        match (whole, back.is_some()) {
            (true, _) => {}
            (false, true) => {
                plan.phi = [-FRAC_PI_2, FRAC_PI_2];
                plan.phis.extend(plan.phi.map(|end| (end, rim)));
            }
            (false, false) => {
                plan.theta = [0.0, FRAC_PI_2];
                plan.thetas.push((FRAC_PI_2, rim));
                // Some models change where n·wi is n·wo, such as Ashikhmin and Shirley's, which divides by
                // the larger one.
                plan.thetas.push((wo.z.min(1.0).acos(), WIDTHS[1]));
            }
        }
        lobes.iter().for_each(|l| plan.add(l));
        // A circle begins opposite to its first lobe.
        if let (Some((first, _)), true) = (plan.phis.first().copied(), plan.phi[1] == PI) {
            plan.phi = [first - PI, first + PI];
            plan.phis.iter_mut().for_each(|p| p.0 = first + (p.0 - first + PI).rem_euclid(2.0 * PI) - PI);
        }
        plan
    }

    /// Nodes and weights over an interval, graded around each place.
    fn nodes(&self, [a, b]: [f64; 2], places: &[Place]) -> Vec<[f64; 2]> {
        let short = places.iter().map(|p| p.1).fold(WIDTHS[1], f64::min) * 0.05;
        let mut out = Vec::new();
        for pair in panels([a, b], places, short).windows(2) {
            let length = pair[1] - pair[0];
            let phase = length * self.order as f64;
            let parts = (length / MAX_LENGTH).max(phase / MAX_PHASE).ceil().max(1.0);
            let n = (self.flat + 0.5 * phase / parts) as usize;
            out.extend(composite(pair, parts, &self.gauss[n.min(MAX_NODES)]));
        }
        out
    }
}

/// Sums over φ of f times the waves, of three channels: `out` has the length of the waves of a φ.
struct Rings<'a> {
    f: [&'a [f64]; 3],
    waves: &'a [f64],
    out: [&'a mut [f64]; 3],
}

impl Kernel for Rings<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let lanes = A::F64::LANES;
        let [red, green, blue] = self.f;
        let terms = self.out[0].len();
        let mut at = 0;
        while at < terms {
            let mut sums = [A::F64::splat(0.0); 3];
            for (((r, g), b), wave) in red.iter().zip(green).zip(blue).zip(self.waves.chunks_exact(terms)) {
                let wave = A::F64::load(&wave[at..]);
                sums[0] = wave.fma(A::F64::splat(*r), sums[0]);
                sums[1] = wave.fma(A::F64::splat(*g), sums[1]);
                sums[2] = wave.fma(A::F64::splat(*b), sums[2]);
            }
            for c in 0..3 {
                sums[c].store(&mut self.out[c][at..]);
            }
            at += lanes;
        }
    }
}

impl Plan<'_> {
    fn add(&mut self, lobe: &Lobe) {
        let pole = self.frame.z_axis;
        let clamped = |w: f64| w.clamp(WIDTHS[0], WIDTHS[1]);
        match *lobe {
            Lobe::Axis { axis, width } => {
                let d = self.frame.transpose() * axis;
                let s = d.x.hypot(d.y);
                let width = clamped(width);
                self.thetas.push((s.atan2(d.z), width));
                if s > 0.5 * width {
                    self.phis.push((d.y.atan2(d.x), clamped(width / s)));
                }
            }
            Lobe::Cone { axis, cosine, width } if axis.dot(pole).abs() > 0.999 => {
                let cosine = cosine * axis.dot(pole).signum();
                self.thetas.push((cosine.clamp(-1.0, 1.0).acos(), clamped(width)));
            }
            Lobe::Arc { normal, width } if normal.dot(pole).abs() > 0.999 => {
                self.thetas.push((FRAC_PI_2, clamped(width)));
            }
            Lobe::Cone { .. } | Lobe::Arc { .. } => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse;
    use steradian_sphere::sh;

    fn views() -> Vec<DVec3> {
        let at = |k: usize| {
            let z = 1.0 - 0.9 * ((k as f64 + 0.5) / 24.0);
            let (s, phi) = ((1.0 - z * z).sqrt(), 2.4 * k as f64);
            DVec3::new(s * phi.cos(), s * phi.sin(), z)
        };
        (0..24).map(at).collect()
    }

    fn off(a: &[Vec<f64>; 3], b: &[Vec<f64>; 3]) -> f64 {
        let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
            (0..3).flat_map(|c| a[c].iter().zip(&b[c])).map(|(a, b)| f(*a, *b)).sum()
        };
        (sum(&|a, b| (a - b).powi(2)) / sum(&|_, b| b * b)).sqrt()
    }

    /// Lambert's coefficients are A_l Y_l0(n)/π · albedo, whatever the view.
    #[test]
    fn lambert_s_coefficients_are_those_of_the_cosine() {
        let brdf = parse("lambert:albedo=0.8/0.5/0.2").unwrap();
        let a = sh::zonal::cosine(6);
        for wo in views() {
            let p = Rule::new(6).project(&*brdf, wo);
            for l in 0..=6usize {
                let y = ((2 * l + 1) as f64 / (4.0 * PI)).sqrt();
                for m in -(l as isize)..=l as isize {
                    let want = if m == 0 { 0.8 / PI * a[l] * y } else { 0.0 };
                    assert!((p.c[0][sh::index(l, m)] - want).abs() < 1e-7, "{l} {m}");
                }
            }
            assert!((p.energy[1] - 0.25 / (PI * PI) * 2.0 * PI / 3.0).abs() < 1e-7);
        }
    }

    /// The usual rule against one of twice as many nodes on panels half as long, for smooth, glossy, brushed
    /// and mirror-like reflectance; and against the adaptive integral of the albedo.
    #[test]
    fn the_rule_is_exact() {
        for (spec, most) in [
            ("ggx:alpha=0.3,f0=0.9", 1e-5),
            ("ggx:alpha=0.02,f0=0.9", 2e-4),
            ("ggx:ax=0.1,ay=0.4,f0=0.9", 2e-4),
            ("ashikhmin-shirley:nu=12,nv=4", 3e-4),
            ("ashikhmin-shirley:nu=10,nv=1000", 1e-3),
            ("ward:ax=0.1,ay=0.3,rs=0.5,rd=0.2", 3e-4),
            ("poulin-fournier:n=20,d=3,h=0.3", 3e-3),
            ("kajiya-kay:s=16", 1e-4),
            ("phong-map:n=50", 1e-4),
            ("oren-nayar:sigma=0.5", 1e-3),
        ] {
            let Ok(brdf) = parse(spec) else { panic!("{spec}: {:?}", parse(spec).err()) };
            let (usual, fine) = (Rule::new(4), Rule::with_nodes(4, 13.0));
            let mut worst = [0.0f64; 2];
            for wo in views() {
                let (a, b) = (usual.project(&*brdf, wo), fine.project(&*brdf, wo));
                worst[0] = worst[0].max(off(&a.c, &b.c));
                let albedo = crate::albedo::directional(&*brdf, wo, 1e-6);
                worst[1] = worst[1].max((a.c[1][0] * (4.0 * PI).sqrt() / albedo[1] - 1.0).abs());
            }
            println!("{spec}: {worst:?}");
            assert!(worst[0] < most && worst[1] < 10.0 * most, "{spec}: {worst:?}");
        }
    }
}
