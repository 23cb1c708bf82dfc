//! The coefficients of f_cos at views on the paraboloid (x, y)/(1 + z), in a lattice of texels that reaches
//! one beyond the rim.

use super::Rule;
use crate::Brdf;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::sh::index;

/// Coefficients by channel.
type Rgb = [Vec<f64>; 3];

/// Least n·wo at which reflectance is evaluated: some models grow without bound towards 0.
pub const GRAZING: f64 = 1e-3;
/// Lowest power of n·wo that is factored out: from there on the integral against the cosine, ∫ z⁻² z dz, has
/// no bound.
pub const LEAST_POLE: f64 = -2.0;

/// Reach of the outer samples of `size`² texels, and the distance between two.
#[inline]
pub fn lattice(size: usize) -> [f64; 2] {
    let h = 2.0 / (size - 3) as f64;
    [1.0 + h, h]
}

/// What texels hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    /// Bands of the harmonics.
    pub bands: usize,
    /// Texels along an edge.
    pub size: usize,
    /// Numbers from channel to channel: bands² at least.
    pub stride: usize,
    /// The power of n·wo that is divided out ([`pole`]).
    pub pole: f32,
}

/// All texels row by row, channel by channel.
pub fn fill(brdf: &dyn Brdf, t: Layout, task: &Task) -> Result<Vec<f32>, Cancelled> {
    let [reach, h] = lattice(t.size);
    let source = Source::new(brdf, t, task)?;
    let fold = if brdf.is_isotropic() { [false; 2] } else { mirrors(brdf) };
    task.begin("views", t.size as u64);
    let place = |k: usize| k as f64 * h - reach;
    let row = |j: usize| {
        task.check()?;
        let mut out = vec![0.0f32; t.size * 3 * t.stride];
        for (i, texel) in out.chunks_exact_mut(3 * t.stride).enumerate() {
            let (x, y) = (place(i), place(j));
            // Texels that mirror another are computed once.
            let (fx, fy) = (fold[0] && x < -0.5 * h, fold[1] && y < -0.5 * h);
            if fx || fy {
                continue;
            }
            let Some(c) = source.texel(x, y, h) else { continue };
            for (to, c) in texel.chunks_exact_mut(t.stride).zip(&c) {
                to.iter_mut().zip(c).for_each(|(to, c)| *to = *c as f32);
            }
        }
        task.advance(1);
        Ok(out)
    };
    let rows: Result<Vec<Vec<f32>>, Cancelled> = (0..t.size).into_par_iter().map(row).collect();
    task.end();
    let mut data = rows?.concat();
    unfold(&mut data, t, fold);
    Ok(data)
}

/// Is f unchanged when x (or y) of both directions changes its sign? Tried at some directions.
fn mirrors(brdf: &dyn Brdf) -> [bool; 2] {
    let direction = |k: usize, by: f64| {
        let z = 0.05 + 0.9 * (k as f64 * by).fract();
        let phi = 2.0 * std::f64::consts::PI * (k as f64 * by * 1.7 + 0.1).fract();
        let s = (1.0 - z * z).sqrt();
        DVec3::new(s * phi.cos(), s * phi.sin(), z)
    };
    [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0)].map(|m| {
        (1..64).all(|k| {
            let (i, o) = (direction(k, 0.618_034), direction(k, 0.754_878));
            let (a, b) = (brdf.f_cos(i, o), brdf.f_cos(i * m, o * m));
            (0..3).all(|c| (a[c] - b[c]).abs() <= 1e-9 * a[c].abs().max(b[c].abs()))
        })
    })
}

/// Fills in the texels whose mirror images were computed: x → −x makes cos mφ (−1)^m of itself and sin mφ
/// −(−1)^m, y → −y changes the sign of the sines.
fn unfold(data: &mut [f32], t: Layout, [x, y]: [bool; 2]) {
    let (n, len) = (t.size, 3 * t.stride);
    let mut sign = vec![[1.0f32; 2]; t.bands * t.bands];
    for l in 0..t.bands {
        for m in 0..=l {
            let odd = if m % 2 == 1 { -1.0 } else { 1.0 };
            sign[index(l, m as isize)] = [odd, 1.0];
            if m > 0 {
                sign[index(l, -(m as isize))] = [-odd, -1.0];
            }
        }
    }
    let mut copy = |from: usize, to: usize, k: usize| {
        for c in 0..3 {
            for (i, s) in sign.iter().enumerate() {
                data[to * len + c * t.stride + i] = s[k] * data[from * len + c * t.stride + i];
            }
        }
    };
    let half = n.div_ceil(2);
    if x {
        (0..n * half).for_each(|k| copy(k / half * n + n - 1 - k % half, k / half * n + k % half, 0));
    }
    if y {
        (0..half * n).for_each(|k| copy((n - 1 - k / n) * n + k % n, k, 1));
    }
}

/// The power p < 0 of n·wo with which f cos grows towards grazing views, or 0. It is the slope of the
/// logarithm of its integral over wi from a quarter of [`GRAZING`] to that, if at least half of it is still
/// there up to four times [`GRAZING`]: Ward's model of 1992 has p = −1/2 only where n·wo is far below its
/// widths, and a table without the power is off by 60 % beyond 89.2°.
pub fn pole(brdf: &dyn Brdf) -> f64 {
    let rule = Rule::new(0);
    let all = |z: f64| {
        let views = ring(brdf, z.acos());
        views.iter().flat_map(|wo| rule.project(brdf, *wo).c.map(|c| c[0])).sum::<f64>()
    };
    let slope = |z: f64| (all(4.0 * z) / all(z)).ln() / 4f64.ln();
    let (near, far) = (slope(0.25 * GRAZING), slope(GRAZING));
    if near < -0.1 && far < 0.5 * near { near.max(LEAST_POLE) } else { 0.0 }
}

/// Where texels come from.
struct Source<'a> {
    brdf: &'a dyn Brdf,
    rule: Rule,
    /// The power of n·wo that is divided out.
    pole: f64,
    /// Isotropic reflectance is tabulated along one radius, ρ = 0 … 1 in equal steps.
    radius: Option<Vec<Rgb>>,
}

impl<'a> Source<'a> {
    fn new(brdf: &'a dyn Brdf, t: Layout, task: &Task) -> Result<Self, Cancelled> {
        let mut out = Self { brdf, rule: Rule::new(t.bands - 1), pole: f64::from(t.pole), radius: None };
        if brdf.is_isotropic() {
            let steps = t.size;
            let at = |k: usize| {
                task.check()?;
                Ok(out.view(k as f64 / steps as f64, 0.0))
            };
            out.radius = Some((0..=steps).into_par_iter().map(at).collect::<Result<_, _>>()?);
        }
        Ok(out)
    }

    /// The texel at (x, y), h from its neighbours; `None` where no lookup reads it.
    fn texel(&self, x: f64, y: f64, h: f64) -> Option<Rgb> {
        let rho = x.hypot(y);
        if rho <= 1.0 {
            return Some(self.at(x, y));
        }
        if rho > 1.0 + 1.5 * h {
            return None;
        }
        // Beyond the rim the table continues linearly: twice the value at the rim less the value as far
        // inside.
        let (x, y) = (x / rho, y / rho);
        let (mut rim, inner) = (self.at(x, y), self.at(x * (2.0 - rho), y * (2.0 - rho)));
        for (rim, inner) in rim.iter_mut().zip(&inner) {
            rim.iter_mut().zip(inner).for_each(|(r, i)| *r = 2.0 * *r - i);
        }
        Some(rim)
    }

    fn at(&self, x: f64, y: f64) -> Rgb {
        match &self.radius {
            Some(radius) => turned(along(radius, x.hypot(y)), y.atan2(x)),
            None => self.view(x, y),
        }
    }

    /// The coefficients at a view over the power of n·wo.
    fn view(&self, x: f64, y: f64) -> Rgb {
        let wo = view(x, y);
        let mut c = self.rule.project(self.brdf, wo).c;
        if self.pole != 0.0 {
            let scale = wo.z.powf(-self.pole);
            c.iter_mut().flatten().for_each(|c| *c *= scale);
        }
        c
    }
}

/// The view at a point of the paraboloid, no lower than [`GRAZING`].
pub fn view(x: f64, y: f64) -> DVec3 {
    let r2 = x * x + y * y;
    let z = ((1.0 - r2) / (1.0 + r2)).max(GRAZING);
    if r2 == 0.0 {
        return DVec3::Z;
    }
    let s = ((1.0 - z * z) / r2).sqrt();
    DVec3::new(s * x, s * y, z)
}

/// Cubic between the samples of a radius (Lagrange through four).
fn along(radius: &[Rgb], rho: f64) -> Rgb {
    let last = radius.len() - 1;
    let p = rho.clamp(0.0, 1.0) * last as f64;
    let first = (p as usize).saturating_sub(1).min(last - 3);
    let x = p - first as f64;
    let (a, b, c, d) = (x, x - 1.0, x - 2.0, x - 3.0);
    let w = [-b * c * d / 6.0, 0.5 * a * c * d, -0.5 * a * b * d, a * b * c / 6.0];
    std::array::from_fn(|ch| {
        let mut out = vec![0.0; radius[0][ch].len()];
        for (w, r) in w.iter().zip(&radius[first..]) {
            out.iter_mut().zip(&r[ch]).for_each(|(o, c)| *o += w * c);
        }
        out
    })
}

/// The function turned by `phi` about z.
fn turned(mut c: Rgb, phi: f64) -> Rgb {
    let bands = c[0].len().isqrt();
    for m in 1..bands {
        let (s, cos) = (m as f64 * phi).sin_cos();
        for l in m..bands {
            let (p, n) = (index(l, m as isize), index(l, -(m as isize)));
            for c in &mut c {
                (c[p], c[n]) = (c[p] * cos - c[n] * s, c[p] * s + c[n] * cos);
            }
        }
    }
    c
}

/// Views between texels, at an angle from the normal: at five azimuths, or one for isotropic reflectance.
pub fn ring(brdf: &dyn Brdf, theta: f64) -> Vec<DVec3> {
    let n = if brdf.is_isotropic() { 1 } else { 5 };
    let at = |k: usize| {
        let phi = FRAC_PI_2 * (k as f64 + 0.37) / n as f64 + 0.2;
        DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    };
    (0..n).map(at).collect()
}
