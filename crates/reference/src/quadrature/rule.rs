//! One rectangle's integral with its error: product integration, or Gauss–Legendre clipped at the horizon.

use super::cells::{Corners, Moments, bilinear};
use super::fit::{Fit, Samples, fit, largest_difference};
use super::geometry::{Axis, Chart, Nodes, Patch, Rect, SAMPLES, beside, spherical};
use super::horizon::Horizon;
use super::legendre::{CHECKS, N, RULE};
use glam::DVec3;
use steradian_brdf::Brdf;

/// f_cos(·, wo), counted and watched.
pub(super) struct Integrand<'a> {
    brdf: &'a dyn Brdf,
    wo: DVec3,
    /// Calls so far.
    pub evaluations: u64,
    /// Was a value infinite or not a number?
    pub broken: bool,
}

impl<'a> Integrand<'a> {
    /// For a local view direction.
    pub fn new(brdf: &'a dyn Brdf, wo: DVec3) -> Self {
        Self { brdf, wo, evaluations: 0, broken: false }
    }

    /// `scale` · f_cos(wi, wo); values that are not finite count as zero and are remembered.
    pub fn at(&mut self, wi: DVec3, scale: f64) -> [f64; 3] {
        self.evaluations += 1;
        let f = self.brdf.f_cos(wi, self.wo);
        if f.iter().all(|x| x.is_finite()) {
            f.map(|x| x * scale)
        } else {
            self.broken = true;
            [0.0; 3]
        }
    }

    /// Evaluates the integrand at many directions.
    fn all(&mut self, wi: &[DVec3; SAMPLES], scale: &[f64; SAMPLES]) -> [[f64; 3]; SAMPLES] {
        self.evaluations += SAMPLES as u64;
        let mut f = [[0.0; 3]; SAMPLES];
        self.brdf.f_cos_batch(wi, self.wo, &mut f);
        for (f, scale) in f.iter_mut().zip(scale) {
            if f.iter().all(|x| x.is_finite()) {
                *f = f.map(|x| x * scale);
            } else {
                self.broken = true;
                *f = [0.0; 3];
            }
        }
        f
    }
}

/// Result of a rule.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    /// The integral.
    pub value: [f64; 3],
    /// Estimate of the largest absolute error of a channel.
    pub error: f64,
    /// Where a cut would help most.
    pub axis: Axis,
}

/// ∫ L g dφ dθ with g = f_cos sin θ, by product integration: g's interpolant against the moments of L.
///
/// With L = L̄ + (L − L̄), the error is at most L̄ times that of Gauss–Legendre for g, plus ∫|L − L̄| times
/// the largest error of the interpolant. Where the `horizon` crosses, g is not smooth, and only ∫|L| times
/// that error is to be trusted.
pub(super) fn product(
    g: &mut Integrand<'_>,
    chart: &Chart,
    horizon: Option<&Horizon>,
    (patch, nodes): (&Patch, &Nodes),
    l: &Moments,
) -> Found {
    let rect = &patch.rect;
    let mut samples = sample(g, chart, nodes);
    if l.peak[0] > 0.0 {
        let [_, phi, theta] = l.peak;
        samples.peak = Some((scaled(rect, phi, theta), g.at(chart.direction(phi, theta), theta.sin())));
    }
    let fits = fit(&samples);
    let missed = horizon.map(|h| missed_at_horizon(g, chart, h, patch, &fits));
    let mut value = [0.0; 3];
    let mut error: f64 = 0.0;
    for c in 0..3 {
        let f = &fits[c];
        let mut row = [0.0; N];
        for i in 0..N {
            for j in 0..N {
                row[j] += f.c[i][j] * l.m[c][i][j];
            }
        }
        value[c] = row.iter().sum();
        let e = match missed {
            Some(m) => l.abs[c] * f.loose.max(m[c]),
            None => smooth_error(l, c, f),
        };
        error = error.max(e);
    }
    Found { value, error, axis: axis(&fits, patch) }
}

/// Largest |g − interpolant| at the corners and on both sides of the horizon, where a jump of g shows that
/// the Gauss grid may have missed.
fn missed_at_horizon(
    g: &mut Integrand<'_>,
    chart: &Chart,
    horizon: &Horizon,
    patch: &Patch,
    fits: &[Fit; 3],
) -> [f64; 3] {
    let rect = &patch.rect;
    let [azimuths, polars] = patch.ends;
    let mut points = Vec::with_capacity(32);
    for (x, azimuth) in [-1.0, 1.0].into_iter().zip(azimuths) {
        for (y, polar) in [-1.0, 1.0].into_iter().zip(polars) {
            let wi = chart.at(spherical(azimuth, polar));
            points.push(([x, y], if wi.z > 0.0 { g.at(wi, polar.0) } else { [0.0; 3] }));
        }
    }
    for w in horizon.breaks(patch).windows(2) {
        for u in [0.1, 0.5, 0.9] {
            let phi = w[0] + u * (w[1] - w[0]);
            let azimuth = phi.sin_cos();
            let [lo, hi] = horizon.clip(azimuth, rect.theta);
            let inside = JUST * (hi - lo);
            for (edge, of, above) in [(lo, rect.theta[0], lo + inside), (hi, rect.theta[1], hi - inside)] {
                if edge != of {
                    let polar = above.sin_cos();
                    points.push((scaled(rect, phi, edge), [0.0; 3]));
                    let value = g.at(chart.at(spherical(azimuth, polar)), polar.0);
                    points.push((scaled(rect, phi, above), value));
                }
            }
        }
    }
    largest_difference(fits, &points)
}

/// Coordinates in a rectangle, scaled to [−1, 1].
fn scaled(rect: &Rect, phi: f64, theta: f64) -> [f64; 2] {
    let [[cp, ct], [dp, dt]] = [rect.centre(), rect.size()];
    [2.0 * (phi - cp) / dp, 2.0 * (theta - ct) / dt]
}

/// Distance from the horizon, relative to the interval above it, at which the integrand is sampled closest to
/// it.
const JUST: f64 = 1e-6;

fn smooth_error(l: &Moments, c: usize, f: &Fit) -> f64 {
    // Without spread the rectangle is one cell, where Gauss–Legendre is all there is.
    let flat = if l.spread[c] == 0.0 { l.abs[c] } else { l.m[c][0][0].abs() };
    l.spread[c] * f.loose + flat * f.tight
}

/// The axis with the larger share in the error; the longer one where neither stands out.
fn axis(fits: &[Fit; 3], patch: &Patch) -> Axis {
    let [a, b] = fits.iter().fold([0.0_f64; 2], |m, f| [m[0].max(f.share[0]), m[1].max(f.share[1])]);
    if a > 3.0 * b {
        Axis::Phi
    } else if b > 3.0 * a {
        Axis::Theta
    } else {
        patch.long_axis()
    }
}

fn sample(g: &mut Integrand<'_>, chart: &Chart, nodes: &Nodes) -> Samples {
    let (wi, sines) = nodes.directions(chart);
    samples(&g.all(&wi, &sines))
}

/// Values at the Gauss nodes, x first, and at the check points.
fn samples(f: &[[f64; 3]; SAMPLES]) -> Samples {
    let mut out = Samples::ZERO;
    for a in 0..N {
        for b in 0..N {
            for c in 0..3 {
                out.grid[c][a][b] = f[a * N + b][c];
            }
        }
    }
    out.checks.copy_from_slice(&f[N * N..]);
    out
}

/// The integral over the part of a rectangle above the horizon, for bilinear L.
///
/// Azimuth is split where the horizon enters or leaves through the rectangle's upper or lower edge; on each
/// piece the polar angle runs up to the horizon, and the integrand mapped to the square is smooth.
pub(super) fn clipped(
    g: &mut Integrand<'_>,
    chart: &Chart,
    horizon: &Horizon,
    patch: &Patch,
    l: &Corners,
) -> Found {
    let mut out = Found { value: [0.0; 3], error: 0.0, axis: patch.long_axis() };
    for w in horizon.breaks(patch).windows(2) {
        let fits = fit(&sample_piece(g, chart, horizon, &patch.rect, [w[0], w[1]], l));
        let mut error: f64 = 0.0;
        for c in 0..3 {
            out.value[c] += 4.0 * fits[c].c[0][0];
            error = error.max(4.0 * fits[c].tight_at_border);
        }
        out.error += error;
    }
    out
}

/// The polar angles above the horizon at one azimuth: sine and cosine of the azimuth φ, the middle of the
/// angles with its own, and half their range.
#[derive(Clone, Copy)]
struct Column {
    phi: f64,
    azimuth: (f64, f64),
    centre: f64,
    polar: (f64, f64),
    half: f64,
}

fn sample_piece(
    g: &mut Integrand<'_>,
    chart: &Chart,
    horizon: &Horizon,
    rect: &Rect,
    [p0, p1]: [f64; 2],
    l: &Corners,
) -> Samples {
    let (pm, ph) = (0.5 * (p0 + p1), 0.5 * (p1 - p0));
    let middle = pm.sin_cos();
    let [t0, t1] = horizon.clip(middle, rect.theta);
    if t0 >= t1 {
        return Samples::ZERO;
    }
    let column = |x: f64| {
        let azimuth = beside(middle, pm, ph * x);
        let [t0, t1] = horizon.clip(azimuth, rect.theta);
        let centre = 0.5 * (t0 + t1);
        Column { phi: pm + ph * x, azimuth, centre, polar: centre.sin_cos(), half: 0.5 * (t1 - t0) }
    };
    let (mut wi, mut scale, mut light) = ([DVec3::ZERO; SAMPLES], [0.0; SAMPLES], [[0.0; 3]; SAMPLES]);
    let mut place = |k: usize, at: Column, y: f64| {
        let (theta, polar) = (at.centre + at.half * y, beside(at.polar, at.centre, at.half * y));
        wi[k] = chart.at(spherical(at.azimuth, polar));
        scale[k] = polar.0 * at.half * ph;
        let (u, w) = ((at.phi - rect.phi[0]) / rect.size()[0], (theta - rect.theta[0]) / rect.size()[1]);
        light[k] = std::array::from_fn(|c| bilinear(&l[c], u, w));
    };
    for a in 0..N {
        let at = column(RULE.x[a]);
        (0..N).for_each(|b| place(a * N + b, at, RULE.x[b]));
    }
    for (k, [x, y]) in CHECKS.into_iter().enumerate() {
        place(N * N + k, column(x), y);
    }
    let mut f = g.all(&wi, &scale);
    f.iter_mut().zip(light).for_each(|(f, l)| (0..3).for_each(|c| f[c] *= l[c]));
    samples(&f)
}
