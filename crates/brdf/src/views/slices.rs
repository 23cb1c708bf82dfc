//! An isotropic reflectance seen along one view.
//!
//! About the direction to the viewer as polar axis, an isotropic f_cos of the normal at (θ_v, β) is that of
//! the normal at (θ_v, 0) turned by β, and even in the azimuth. [`Slices`] are its real coefficients
//!
//! > g_lm(θ_v) = ∫ f_cos(wi, wo; n(θ_v, 0)) Y_lm(wi) dwi, m ≥ 0.

use super::quadrature;
use crate::{Brdf, Domain, Lobe};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;

/// Fewest elevations, less one: steps of 2.8°. The lowest order alone would ask for 5.6°; towards grazing
/// views reflectance changes faster than its bands tell.
const MIN_INTERVALS: usize = 32;

/// Error under white light that an order below [`RINGING_ORDER`] may leave, in tolerances. A sun's spectrum
/// does not fall: what an order cuts off there shows as rings about it, which the mean square under natural
/// light hardly counts.
const WHITE_ERROR: f64 = 0.5;
/// Order from which on rings under white light are not looked at: lobes that the horizon cuts have no highest
/// band, and would be sent to the highest order that is allowed, however smooth they are else.
const RINGING_ORDER: usize = 48;

/// Candidate orders, lowest first. Coefficients grow as the square, times elevations that grow with the
/// order: each of these has 2.3 to 3.4 times the numbers of the one before.
const ORDERS: [usize; 6] = [8, 16, 24, 32, 48, 64];

/// g_lm(θ_v) at elevations equally spaced over [0, π/2].
#[derive(Debug, Clone, PartialEq)]
pub struct Slices {
    order: usize,
    /// Elevations less one.
    intervals: usize,
    /// Per elevation and coefficient (m = 0…F, then l = m…F) r, g, b.
    g: Vec<[f32; 3]>,
    /// f_cos has this Lambertian part, which is left out of g: f of it, sr⁻¹.
    pub diffuse: [f64; 3],
    /// Estimate of the squared relative error that the order leaves under natural light, whose coefficients
    /// fall like 1/(l + 1): Σ over the bands left out of f_cos's energy/(l + 1)², over that of all bands.
    pub missing: f64,
    /// Standard deviation, radians, of the Gaussian e^(−l(l+1)σ²/2) that suppresses ringing of the truncated
    /// series; 0 where the last band is small enough not to ring.
    pub blur: f64,
}

/// Number of (l, m) with m ≥ 0 up to `order`.
pub const fn half_count(order: usize) -> usize {
    (order + 1) * (order + 2) / 2
}

impl Slices {
    /// Projects a reflectance onto harmonics up to the lowest order, at most `most`, whose
    /// [`Slices::missing`] is at most tolerance² and that hardly rings; `diffuse` (f, sr⁻¹) is the Lambertian
    /// part to leave out of g.
    pub fn bake(
        brdf: &dyn Brdf,
        diffuse: [f64; 3],
        tolerance: f64,
        most: usize,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        // No lobe of this width fits in fewer bands.
        let least = (1.0 / narrowest(brdf)) as usize;
        let fit = |o: &usize| *o < most && *o >= least;
        for order in ORDERS.into_iter().filter(fit) {
            let (slices, white) = Self::made(brdf, diffuse, order, task)?;
            // A sun's spectrum does not fall: cut off, the lobe would ring about it.
            let rings = white > (WHITE_ERROR * tolerance).powi(2) && order < RINGING_ORDER;
            if slices.missing <= tolerance * tolerance && !rings {
                return Ok(slices);
            }
        }
        Self::of_order(brdf, diffuse, most, task)
    }

    /// Up to band `order`, whatever that leaves out.
    pub fn of_order(
        brdf: &dyn Brdf,
        diffuse: [f64; 3],
        order: usize,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        Ok(Self::made(brdf, diffuse, order, task)?.0)
    }

    /// The slices, and the share of energy that they miss under white light.
    fn made(brdf: &dyn Brdf, diffuse: [f64; 3], order: usize, task: &Task) -> Result<(Self, f64), Cancelled> {
        // Four intervals in 2θ_v per wavelength of the highest band; bands that high hold little energy.
        let intervals = (2 * order).max(MIN_INTERVALS);
        let rule = quadrature::Rule::new(order);
        let slice = |j: usize| {
            task.check()?;
            let theta_v = (FRAC_PI_2 * j as f64 / intervals as f64).min(FRAC_PI_2 - GRAZING);
            Ok(rule.slice(brdf, diffuse, theta_v))
        };
        let slices: Vec<_> = (0..=intervals).into_par_iter().map(slice).collect::<Result<_, _>>()?;
        let natural = missing(&slices, order, |l| 1.0 / ((l + 1) * (l + 1)) as f64);
        let white = missing(&slices, order, |_| 1.0);
        let blur = blur(&slices, order);
        let window = |l: usize| (-0.5 * blur * (l * (l + 1)) as f64).exp();
        let windows: Vec<f64> = (0..=order).flat_map(|m| m..=order).map(window).collect();
        let smooth = |(g, w): (&[f64; 3], &f64)| g.map(|x| (w * x) as f32);
        let g = slices.iter().flat_map(|s| s.g.iter().zip(&windows).map(smooth)).collect();
        Ok((Self { order, intervals, g, diffuse, missing: natural, blur: blur.sqrt() }, white))
    }

    /// Highest band F.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Elevations, from θ_v = 0 to π/2.
    pub fn elevations(&self) -> usize {
        self.intervals + 1
    }

    /// Is all reflectance in the Lambertian part?
    pub fn is_zero(&self) -> bool {
        self.g.iter().flatten().all(|x| *x == 0.0)
    }

    /// g of elevation `j`, m by m: m = 0 … F, then l = m … F.
    pub fn at(&self, j: usize) -> &[[f32; 3]] {
        let n = half_count(self.order);
        &self.g[j * n..(j + 1) * n]
    }

    /// g of all elevations, one after the other.
    pub fn coefficients(&self) -> &[[f32; 3]] {
        &self.g
    }

    /// Slices of [`Slices::coefficients`] at so many elevations, without an account of what is missing;
    /// `None` where these are not theirs.
    pub fn from_coefficients(order: usize, elevations: usize, g: Vec<[f32; 3]>) -> Option<Self> {
        let whole = elevations >= 5 && g.len() == elevations * half_count(order);
        let intervals = elevations.saturating_sub(1);
        let made = Self { order, intervals, g, diffuse: [0.0; 3], missing: 0.0, blur: 0.0 };
        whole.then_some(made)
    }
}

/// The error of [`Slices::missing`], for light whose bands have the power `light`; views uniform in solid
/// angle. All energy beyond the order counts as if in the next band.
fn missing(slices: &[quadrature::Slice], order: usize, light: impl Fn(usize) -> f64) -> f64 {
    let (mut seen, mut kept, mut all) = (0.0, 0.0, 0.0);
    for (j, s) in slices.iter().enumerate() {
        let w = (FRAC_PI_2 * j as f64 / (slices.len() - 1) as f64).sin();
        all += w * s.energy;
        let bands = (0..=order).flat_map(|m| m..=order);
        for (l, g) in bands.zip(&s.g) {
            let e = w * g.iter().map(|x| x * x).sum::<f64>();
            kept += e;
            seen += e * light(l);
        }
    }
    let lost = (all - kept).max(0.0) * light(order + 1);
    if seen + lost > 0.0 { lost / (seen + lost) } else { 0.0 }
}

/// Largest coefficients of the last band, relative to the first: with larger ones the truncated lobe would
/// ring and become negative.
const LAST_BAND: f64 = 0.01;

/// The variance of the Gaussian that makes the last band that small.
fn blur(slices: &[quadrature::Slice], order: usize) -> f64 {
    let mut energy = vec![0.0; order + 1];
    for (j, s) in slices.iter().enumerate() {
        let w = (FRAC_PI_2 * j as f64 / (slices.len() - 1) as f64).sin();
        for (l, g) in (0..=order).flat_map(|m| m..=order).zip(&s.g) {
            energy[l] += w * g.iter().map(|x| x * x).sum::<f64>() / (2 * l + 1) as f64;
        }
    }
    // Odd or even bands alone may vanish.
    let last = energy[order.saturating_sub(2)..].iter().fold(0.0_f64, |a, e| a.max(*e));
    if last <= LAST_BAND * LAST_BAND * energy[0] || energy[0] <= 0.0 {
        return 0.0;
    }
    let share = (last / energy[0]).sqrt().min(1.0);
    2.0 * (share / LAST_BAND).ln() / (order * (order + 1)) as f64
}

/// Grazing views are moved to this angle, radians, above the surface, where reflectance is still defined.
const GRAZING: f64 = 1e-4;

/// Width of the narrowest lobe at normal view, radians.
fn narrowest(brdf: &dyn Brdf) -> f64 {
    let width = |l: &Lobe| match *l {
        Lobe::Axis { width, .. } | Lobe::Cone { width, .. } | Lobe::Arc { width, .. } => width,
    };
    brdf.lobes(DVec3::Z).iter().map(width).fold(1.0, f64::min).max(1e-6)
}

/// The largest Lambertian part (f, sr⁻¹) by which f can be reduced and stay non-negative, where both
/// directions are within 75° of the normal.
pub fn lambertian_part(brdf: &dyn Brdf) -> [f64; 3] {
    if brdf.domain() == Domain::Sphere {
        return [0.0; 3];
    }
    let at = |theta: f64, phi: f64| DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
    let mut least = [f64::INFINITY; 3];
    let theta = |k: usize| 75.0_f64.to_radians() * k as f64 / 15.0;
    for (i, o) in (0..256).map(|k| (theta(k / 16), theta(k % 16))) {
        for q in 0..=8 {
            let f = brdf.eval(at(i, PI * f64::from(q) / 8.0), at(o, 0.0));
            (0..3).for_each(|c| least[c] = least[c].min(f[c]));
        }
    }
    least.map(|f| if f.is_finite() { f.max(0.0) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brdf(spec: &str) -> crate::SharedBrdf {
        crate::parse(spec).expect(spec)
    }

    /// Under constant light nothing but g_00 counts: the albedo.
    #[test]
    fn the_first_coefficient_is_the_albedo() {
        let slices = Slices::of_order(&*brdf("lambert:albedo=0.5"), [0.0; 3], 16, &Task::quiet()).unwrap();
        for j in [0, 7, 20, 32] {
            let albedo = f64::from(slices.at(j)[0][0]) * (4.0 * PI).sqrt();
            assert!((albedo - 0.5).abs() < 5e-6, "{j}: {albedo}");
        }
    }

    #[test]
    fn the_order_follows_from_the_tolerance_and_lambert_splits_off_whole() {
        let task = Task::quiet();
        let of = |spec| {
            let b = brdf(spec);
            Slices::bake(&*b, lambertian_part(&*b), 0.01, 96, &task).unwrap()
        };
        let (sharp, smooth) = (of("phong-map:n=100"), of("phong-map:n=5"));
        assert!(smooth.order < sharp.order && sharp.missing < 1e-4, "{} {}", smooth.order, sharp.order);
        let lambert = of("lambert:albedo=0.8/0.5/0.2");
        assert!(lambert.g.iter().flatten().all(|g| g.abs() < 1e-7));
        assert!((lambert.diffuse[1] - 0.5 / PI).abs() < 1e-12);
    }
}
