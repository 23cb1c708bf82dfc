//! Anisotropic reflectance as round Gaussians about mirror images of the view.
//!
//! Where grooves have a direction, highlights are long and bent, and at grazing views cut by the horizon.
//! They are where a half vector is likely, so that half vectors h_k which are fixed in the tangent frame
//! follow them to every view:
//!
//! **T(wi) ≈ Σ_k w_k G_σk(wi), about 2 (wo·h_k) h_k − wo**
//!
//! Filtered importance sampling (Colbert & Křivánek 2007, *GPU-Based Importance Sampling*, GPU Gems 3,
//! chapter 20) draws such half vectors and looks up filtered light; here they lie in rows along the long axis
//! of the highlight, narrow Gaussians close together and wide ones farther apart, the same for all views, and
//! the weights are fitted to each view: w ≥ 0 by least squares, which leaves most at 0, with the albedo of
//! every channel kept where that is asked for. Since the h_k stay, weights are smooth functions of the view,
//! and linear between views.
//!
//! Squared differences count by 1/(T + 0.03 T_max): plain least squares see so little of the dim directions
//! round the highlight that wide Gaussians put a haze there, which a bright lamp shows on all that mirrors
//! something dark.

use super::azimuths::is_invariant;
use super::chain;
use super::refine::{Kind, Products};
use super::slice::Slice;
use super::{Axes, LAST, Objective, Plan};
use crate::Brdf;
use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_numerics::dense::nonnegative;
use steradian_numerics::eigen;
use steradian_parallel::prelude::*;
use steradian_simd::run;

/// A half vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfVector {
    /// h, along tangent, bitangent and normal.
    pub h: DVec3,
    /// Its Gaussian's width, radians.
    pub sigma: f64,
}

/// The fit of a view.
#[derive(Debug, Clone, PartialEq)]
pub struct HalfView {
    /// Weight of each half vector per channel: reflected radiance under constant light of radiance 1.
    pub weights: Vec<[f64; 3]>,
    /// ∫ (T − fit)²/∫ T², all channels together.
    pub energy: f64,
    /// Share of the weights that lies below the horizon.
    pub leak: f64,
}

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct HalfFit {
    /// ρ_d, the albedo of the diffuse part per channel.
    pub diffuse: [f64; 3],
    /// The half vectors.
    pub half_vectors: Vec<HalfVector>,
    /// M: azimuths of the view, 2π j/M.
    pub azimuths: usize,
    /// By elevation ([`HalfFit::theta`]), and at each by azimuth.
    pub views: Vec<HalfView>,
}

/// A row of half vectors, or two on either side of the long axis.
struct Row {
    /// Width of the Gaussians, relative to that of the middle row.
    sigma: f64,
    /// Distance between half vectors in widths, of which lobes lie twice as far apart.
    apart: f64,
    /// How far the row reaches along the long axis, relative to the highlight's long width (α of GGX along
    /// the grooves).
    reach: f64,
    /// Distance of two rows from the long axis, in widths; 0 for one on it.
    aside: f64,
}

/// The rows. Without the first, GGX .1 × .4 seen at 77° is off by 13 to 34 % (7 to 13 with it), without those
/// aside by 19 to 33 %. A lamp a thousand times as bright as the rest is off by 12 % in the median over its
/// places, seen at 52°, without the wide ones aside, and by 2 % with them.
const ROWS: [Row; 9] = [
    Row { sigma: 0.5, apart: 0.9, reach: 2.0, aside: 0.0 },
    Row { sigma: 1.0, apart: 1.1, reach: 2.25, aside: 0.0 },
    Row { sigma: 1.0, apart: 1.8, reach: 1.25, aside: 1.45 },
    Row { sigma: 2.0, apart: 1.4, reach: 3.0, aside: 0.0 },
    Row { sigma: 2.0, apart: 2.1, reach: 1.5, aside: 1.8 },
    Row { sigma: 4.0, apart: 1.6, reach: 3.75, aside: 0.0 },
    Row { sigma: 4.0, apart: 2.1, reach: 3.0, aside: 1.8 },
    Row { sigma: 8.0, apart: 1.8, reach: 4.5, aside: 0.0 },
    Row { sigma: 8.0, apart: 2.0, reach: 3.5, aside: 1.6 },
];
/// Rows of wider Gaussians than this are left out, radians.
const MAX_SIGMA: f64 = 1.2;
/// The middle row is at most so much wider than the highlight's short width. Of GGX .1 × .4 seen at 6° and
/// 69° the middle row and wider ones are off by 1.6 and 12 % for 0.7, 1.6 and 11 for 1, and 11 and 16 for
/// 1.4.
const MAX_MIDDLE: f64 = 1.15;
/// Least number of half vectors to allow: three in each row.
pub const MIN_HALF_VECTORS: usize = 39;
/// Largest slope of a half vector: it sends light from the normal to the horizon, and beyond it only grazing
/// views see more.
const MAX_SLOPE: f64 = 1.5;
/// Part of the largest T that is added to T where it divides squared differences. 0.01 and 0.1 change the
/// median errors of lamps by up to a third, either way.
const FAINT: f64 = 0.03;
/// Points nearer together than this part of the narrowest width are one in a fit.
const FINE: f64 = 0.5;

impl HalfFit {
    /// Fits a reflectance by at most `most` half vectors. Widths are `level` times powers of 2: a chain of
    /// light filtered with these has them exactly, and a mixture of two levels has a peak up to half as high
    /// again as the Gaussian between them.
    pub fn new(brdf: &dyn Brdf, plan: Plan, most: usize, level: f64, task: &Task) -> Result<Self, Cancelled> {
        let keep = plan.objective == Objective::Energy;
        let kind = Kind { lobes: plan.lobes, keep, stretched: true, turned: true };
        let diffuse = chain::diffuse(brdf, kind);
        let half_vectors = rows(&Slice::new(brdf, diffuse, [0.0; 2], kind), most, level);
        let narrowest = half_vectors.iter().map(|h| h.sigma).fold(MAX_SIGMA, f64::min);
        let [n, m] = [plan.views.max(2), plan.azimuths.max(super::MIN_AZIMUTHS)];
        let equal = equal_azimuths(brdf, &half_vectors, m);
        let first: Vec<usize> = (0..m).filter(|j| equal[*j].0 == *j).collect();
        // Along the normal all azimuths are one view.
        let places: Vec<[usize; 2]> =
            std::iter::once([0, 0]).chain((1..n).flat_map(|i| first.iter().map(move |j| [i, *j]))).collect();
        task.begin("fitting", places.len() as u64);
        let one = |[i, j]: [usize; 2]| {
            task.check()?;
            let view = [theta(i, n), 2.0 * PI * j as f64 / m as f64];
            let slice = Slice::new(brdf, diffuse, view, kind).merged(FINE * narrowest);
            let fit = fit(&slice, view[1], &half_vectors, keep);
            task.advance(1);
            Ok(fit)
        };
        let made: Vec<Result<HalfView, Cancelled>> =
            places.clone().into_par_iter().with_max_len(1).map(one).collect();
        task.end();
        let made = made.into_iter().collect::<Result<Vec<HalfView>, Cancelled>>()?;
        let view = |i: usize, j: usize| {
            let (from, order) = if i == 0 { (0, &equal[0].1) } else { (equal[j].0, &equal[j].1) };
            let k = places.iter().position(|p| *p == [i, from]).unwrap_or(0);
            HalfView { weights: order.iter().map(|o| made[k].weights[*o]).collect(), ..made[k].clone() }
        };
        let views = (0..n).flat_map(|i| (0..m).map(move |j| (i, j))).map(|(i, j)| view(i, j)).collect();
        Ok(Self { diffuse, half_vectors, azimuths: m, views })
    }

    /// N.
    pub fn elevations(&self) -> usize {
        self.views.len() / self.azimuths
    }

    /// The polar angle of an elevation: from 0 to [`LAST`], closer together towards grazing views.
    pub fn theta(&self, elevation: usize) -> f64 {
        theta(elevation, self.elevations())
    }

    /// The weights of any view, linear between those of the fit: in azimuth, and in the root of what is left
    /// to the last elevation.
    pub fn at(&self, [polar, azimuth]: [f64; 2]) -> Vec<[f64; 3]> {
        let last = self.elevations() - 1;
        let x = (1.0 - (1.0 - polar / LAST).max(0.0).sqrt()) * last as f64;
        let i = (x as usize).min(last - 1);
        let y = (0.5 * azimuth / PI).rem_euclid(1.0) * self.azimuths as f64;
        let j = y as usize;
        let view =
            |i: usize, j: usize, k: usize| self.views[i * self.azimuths + j % self.azimuths].weights[k];
        let mix = |a: [f64; 3], b: [f64; 3], t: f64| [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * t);
        let row = |i: usize, k: usize| mix(view(i, j, k), view(i, j + 1, k), y - j as f64);
        (0..self.half_vectors.len()).map(|k| mix(row(i, k), row(i + 1, k), x - i as f64)).collect()
    }

    /// Bytes of the fit, weights in half precision.
    pub fn bytes(&self) -> usize {
        let k = self.half_vectors.len();
        4 * 3 + 16 * k + 2 * 3 * k * self.views.len()
    }
}

fn theta(elevation: usize, elevations: usize) -> f64 {
    let rest = 1.0 - elevation as f64 / (elevations - 1) as f64;
    LAST * (1.0 - rest * rest)
}

/// Half vectors in rows along the long axis of the highlight that is seen along the normal.
fn rows(top: &Slice, most: usize, level: f64) -> Vec<HalfVector> {
    // Moments of T², which has some where T of heavy tails has none. Of GGX and of Gaussian slopes twice the
    // deviation is α.
    let mut sum = [0.0; 4];
    for (i, d) in top.d.iter().enumerate() {
        let t: f64 = top.t.iter().map(|t| t[i] * t[i]).sum();
        let h = *d + DVec3::Z;
        if h.z > 1e-6 {
            let s = DVec2::new(h.x, h.y) / h.z;
            [1.0, s.x * s.x, s.x * s.y, s.y * s.y].iter().zip(&mut sum).for_each(|(v, to)| *to += t * v);
        }
    }
    let [xx, xy, yy] = [1, 2, 3].map(|k| 4.0 * sum[k] / sum[0].max(1e-300));
    let axes = eigen::symmetric(vec![vec![xx, xy], vec![xy, yy]]);
    let alpha = |k: usize| axes[k].0.max(1e-8).sqrt();
    let (long, short) = (alpha(0).min(1.0), alpha(1).min(1.0));
    let axis = DVec2::new(axes[0].1[0], axes[0].1[1]);
    // Exactly along tangent or bitangent, where it is nearly so: symmetric half vectors save fits.
    let axis = if axis.x.abs() < 1e-3 {
        DVec2::Y
    } else if axis.y.abs() < 1e-3 {
        DVec2::X
    } else {
        axis
    };
    let middle = level * (MAX_MIDDLE * short / level).log2().floor().exp2();
    let across = axis.perp();
    let all = |coarser: f64| -> Vec<HalfVector> {
        let mut out = Vec::new();
        for row in ROWS.iter().filter(|row| row.sigma * middle <= MAX_SIGMA) {
            let sigma = row.sigma * middle;
            let reach = (row.reach * long).min(MAX_SLOPE);
            let side = (reach / (coarser * row.apart * sigma)).ceil() as i32;
            let sides = if row.aside > 0.0 { vec![-row.aside, row.aside] } else { vec![0.0] };
            for aside in sides {
                let one = |k: i32| {
                    let s = axis * (reach * f64::from(k) / f64::from(side)) + across * (aside * sigma);
                    HalfVector { h: DVec3::new(s.x, s.y, 1.0).normalize(), sigma }
                };
                out.extend((-side..=side).map(one));
            }
        }
        out
    };
    // Where there would be more than `most`, they lie farther apart; each row has three at least.
    (0..).map(|k| all(1.05f64.powi(k))).find(|h| h.len() <= most.max(MIN_HALF_VECTORS)).unwrap_or_default()
}

/// For each azimuth the first one that equals it by symmetry, and the order in which the weights there are
/// this one's.
fn equal_azimuths(brdf: &dyn Brdf, half_vectors: &[HalfVector], m: usize) -> Vec<(usize, Vec<usize>)> {
    let identity: Vec<usize> = (0..half_vectors.len()).collect();
    // The half vector that each is moved to; `None` unless all are.
    let order = |by: DMat3| -> Option<Vec<usize>> {
        let moved = |h: &HalfVector| {
            let to = by * h.h;
            half_vectors.iter().position(|o| (o.h - to).length() < 1e-9 && o.sigma == h.sigma)
        };
        half_vectors.iter().map(moved).collect()
    };
    // Half a turn, and mirrors in both planes; where each moves azimuth j.
    type Moved = fn(usize, usize) -> usize;
    let symmetries: [(DMat3, Moved); 3] = [
        (DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0)), |j, m| j + m / 2),
        (DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)), |j, m| 2 * m - j),
        (DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)), |j, m| m + m / 2 - j),
    ];
    let held: Vec<_> = symmetries
        .iter()
        .filter(|(by, _)| m.is_multiple_of(2) && is_invariant(brdf, *by))
        .filter_map(|(by, to)| Some((order(*by)?, *to)))
        .collect();
    (0..m)
        .map(|j| {
            let all = held.iter().map(|(order, to)| (to(j, m) % m, order));
            let least = all.min_by_key(|(k, _)| *k).filter(|(k, _)| *k < j);
            least.map_or((j, identity.clone()), |(k, order)| (k, order.clone()))
        })
        .collect()
}

/// The Gaussian at the points of a slice, times the roots of their solid angles.
fn column(slice: &Slice, mean: DVec3, sigma: f64) -> Vec<f64> {
    let [gamma, aside, _] = Axes::angles(mean, DVec3::Y);
    let mut column = [Vec::new()];
    slice.gaussian([gamma, aside, 0.0], sigma, 0.0, &mut column);
    let [column] = column;
    column
}

/// The fit of a view at azimuth `phi`.
fn fit(slice: &Slice, phi: f64, half_vectors: &[HalfVector], keep: bool) -> HalfView {
    let n = half_vectors.len();
    let turn = DMat3::from_rotation_z(-phi);
    let wo = DVec3::new(slice.theta.sin(), 0.0, slice.theta.cos());
    // What lies below the horizon by more than its width lights nothing.
    let means = half_vectors.iter().map(|h| reflected(wo, turn * h.h));
    let used: Vec<(usize, DVec3)> =
        means.enumerate().filter(|(k, mean)| mean.z > -half_vectors[*k].sigma.min(0.5)).collect();
    // Roots of how much differences count.
    let t = |i: usize| slice.t.iter().map(|t| t[i]).sum::<f64>().abs() / slice.root[i].max(1e-12);
    let top = (0..slice.len()).map(t).fold(0.0, f64::max).max(1e-300);
    let count: Vec<f64> = (0..slice.len()).map(|i| (t(i) / top + FAINT).recip().sqrt()).collect();
    let counted = |mut of: Vec<f64>| {
        of.iter_mut().zip(&count).for_each(|(x, w)| *x *= w);
        of
    };
    let columns: Vec<Vec<f64>> =
        used.iter().map(|(k, mean)| counted(column(slice, *mean, half_vectors[*k].sigma))).collect();
    let t = slice.t.clone().map(counted);
    let apart = |i: usize, j: usize| {
        let [a, b] = [used[i], used[j]];
        let [sa, sb] = [half_vectors[a.0].sigma, half_vectors[b.0].sigma];
        // exp(−18) is 1e-8 of what they would share at one place.
        (a.1 - b.1).length_squared() > 36.0 * (sa * sa + sb * sb)
    };
    let (mut gram, onto) = run(Products { columns: &columns, t: &t, apart: Some(&apart) });
    // Neighbours that nearly coincide.
    (0..used.len()).for_each(|i| gram[i][i] *= 1.0 + 1e-9);
    let mut view = HalfView { weights: vec![[0.0; 3]; n], energy: 0.0, leak: 0.0 };
    let mut w = vec![0.0; used.len()];
    for c in 0..3 {
        // Channels mostly use the same ones.
        w = nonnegative(&gram, &onto[c], &w);
        let sum: f64 = w.iter().sum();
        let scale = if keep && sum > 0.0 { slice.albedo[c].max(0.0) / sum } else { 1.0 };
        used.iter().zip(&w).for_each(|((k, _), w)| view.weights[*k][c] = scale * w);
    }
    let mut fitted: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; slice.len()]);
    for ((k, _), column) in used.iter().zip(&columns) {
        for c in (0..3).filter(|c| view.weights[*k][*c] > 0.0) {
            let w = view.weights[*k][c];
            fitted[c].iter_mut().zip(column).for_each(|(f, g)| *f += w * g);
        }
    }
    fitted.iter_mut().for_each(|f| f.iter_mut().zip(&count).for_each(|(f, w)| *f /= w));
    let (mut square, mut all, mut below) = (0.0, 0.0, 0.0);
    for c in 0..3 {
        square += fitted[c].iter().zip(&slice.t[c]).map(|(f, t)| (t - f).powi(2)).sum::<f64>();
        for ((f, d), root) in fitted[c].iter().zip(&slice.d).zip(&slice.root) {
            all += f * root;
            below += if d.z < 0.0 { f * root } else { 0.0 };
        }
    }
    view.energy = if slice.square[0] > 0.0 { square / slice.square[0] } else { 0.0 };
    view.leak = if all > 0.0 { below / all } else { 0.0 };
    view
}

/// The direction to which `h` mirrors `wo`.
fn reflected(wo: DVec3, h: DVec3) -> DVec3 {
    2.0 * wo.dot(h) * h - wo
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::gaussian::density;
    use crate::math::spherical;
    use crate::{albedo, parse};

    /// One degree, the width of the first filtered level of `gaussian_lobes`.
    const LEVEL: f64 = PI / 180.0;

    fn fitted(spec: &str, plan: Plan) -> HalfFit {
        let brdf = parse(spec).expect(spec);
        HalfFit::new(&*brdf, plan, 176, LEVEL, &Task::quiet()).expect("not cancelled")
    }

    /// ‖T − fit‖/‖T‖ at any view, by another quadrature.
    fn error(fit: &HalfFit, brdf: &dyn Brdf, view: [f64; 2]) -> f64 {
        let wo = spherical(view[0], view[1]);
        let n = 24_000;
        let (mut off, mut all) = (0.0, 0.0);
        let weights = fit.at(view);
        for k in 0..n {
            // A spiral.
            let z = 1.0 - (2 * k + 1) as f64 / n as f64;
            let wi = spherical(z.acos(), 2.399_963_229_728_653 * k as f64);
            let t = brdf.f_cos(wi, wo);
            let mut f = fit.diffuse.map(|d| d / PI * wi.z.max(0.0));
            for (w, h) in weights.iter().zip(&fit.half_vectors) {
                let g = (reflected(wo, h.h).dot(wi) - 1.0) / (h.sigma * h.sigma);
                (0..3).for_each(|c| f[c] += w[c] * density(h.sigma) * g.exp());
            }
            (0..3).for_each(|c| off += (t[c] - f[c]).powi(2));
            all += t.iter().map(|t| t * t).sum::<f64>();
        }
        (off / all).sqrt()
    }

    /// Errors of brushed metals at views of the fit and between them; albedos are those of another
    /// quadrature.
    #[test]
    fn brushed_metals() {
        for spec in ["ggx:ax=0.1,ay=0.4,f0=0.9/0.6/0.3", "ward:ax=0.1,ay=0.4"] {
            let (brdf, fit) = (parse(spec).expect(spec), fitted(spec, Plan::default()));
            for (polar, most) in [(0.0, 0.05), (0.3, 0.05), (0.8, 0.1), (1.1, 0.12), (1.3, 0.25)] {
                for azimuth in [0.0, 0.9, 1.7, 5.3] {
                    let found = error(&fit, &*brdf, [polar, azimuth]);
                    assert!(found < most, "{spec} {polar} {azimuth}: {found:.4}");
                }
            }
            for (k, view) in fit.views.iter().enumerate().filter(|(k, _)| k % 7 == 0 && *k < 13 * 24) {
                let [i, j] = [k / fit.azimuths, k % fit.azimuths];
                let wo = spherical(fit.theta(i), 2.0 * PI * j as f64 / fit.azimuths as f64);
                let want = albedo::directional(&*brdf, wo, 1e-5);
                for c in 0..3 {
                    let got = fit.diffuse[c] + view.weights.iter().map(|w| w[c]).sum::<f64>();
                    assert!((got - want[c]).abs() < 5e-3 * want[c], "{spec} {k}: {got}, not {}", want[c]);
                }
            }
        }
    }

    /// Azimuths that are equal by symmetry are fitted once, and give what their own fits would.
    #[test]
    fn symmetric_azimuths() {
        let plan = Plan { views: 4, azimuths: 8, ..Plan::default() };
        let spec = "ggx:ax=0.15,ay=0.4";
        let brdf = parse(spec).expect(spec);
        let fit = fitted(spec, plan);
        let distinct = |m: usize| {
            let equal = equal_azimuths(&*brdf, &fit.half_vectors, m);
            (0..m).filter(|j| equal[*j].0 == *j).count()
        };
        assert_eq!([8, 24, 9].map(distinct), [3, 7, 9]);
        for j in 0..8 {
            let view = [fit.theta(1), 2.0 * PI * j as f64 / 8.0];
            let found = error(&fit, &*brdf, view);
            assert!((found - error(&fit, &*brdf, [view[0], PI - view[1]])).abs() < 1e-6, "{j}: {found}");
            assert!(found < 0.06, "{j}: {found}");
        }
    }
}
