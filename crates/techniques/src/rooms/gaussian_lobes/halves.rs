//! Anisotropic reflectance by round Gaussians about mirror images of the view in fixed half vectors:
//! tables by elevation and azimuth of the view hold their weights. `halves.wgsl` has the same
//! functions.

use super::light::Light;
use super::params::Params;
use super::place::Place;
use super::views::Views;
use super::visibility::MOST;
use crate::certify::Report;
use crate::shared::maths::vector::dot;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use steradian_brdf::fit::gaussian::{HalfFit, HalfVector, HalfView};
use steradian_sphere::sh::zonal;

/// Adds a fit to a file.
pub(super) fn save(fit: &HalfFit, to: &mut TensorFile, prefix: &str) {
    let half_vectors = fit.half_vectors.iter().flat_map(|h| [h.h.x, h.h.y, h.h.z, h.sigma]).collect();
    let (views, k) = (fit.views.len(), fit.half_vectors.len());
    put_f64(to, format!("{prefix}.half_vectors"), vec![k, 4], half_vectors);
    let numbers = fit.views.iter().flat_map(|v| [v.energy, v.leak]).collect();
    put_f64(to, format!("{prefix}.half_views"), vec![views / fit.azimuths, fit.azimuths, 2], numbers);
    let weights = fit.views.iter().flat_map(|v| v.weights.as_flattened().to_vec()).collect();
    put_f64(to, format!("{prefix}.half_weights"), vec![views, k, 3], weights);
    put_f64(to, format!("{prefix}.half_diffuse"), vec![3], fit.diffuse.to_vec());
}

/// Reads what [`save`] has written; `None` where the file has another fit.
pub(super) fn load(from: &TensorFile, prefix: &str) -> Result<Option<HalfFit>, PartError> {
    let name = format!("{prefix}.half_vectors");
    if !from.tensors.contains_key(&name) {
        return Ok(None);
    }
    let (shape, numbers) = get_f64(from, &name, 2)?;
    let half_vectors: Vec<HalfVector> = numbers
        .as_chunks::<4>()
        .0
        .iter()
        .map(|[x, y, z, sigma]| HalfVector { h: glam::DVec3::new(*x, *y, *z), sigma: *sigma })
        .collect();
    let sound = |h: &HalfVector| (h.h.length() - 1.0).abs() < 1e-6 && h.h.z > 0.0 && h.sigma > 0.0;
    if shape[1] != 4 || half_vectors.is_empty() || !half_vectors.iter().all(sound) {
        return Err(PartError::Unexpected(name));
    }
    let name = format!("{prefix}.half_views");
    let (shape, numbers) = get_f64(from, &name, 3)?;
    if shape[0] < 2 || shape[1] < 2 || shape[2] != 2 {
        return Err(PartError::Unexpected(name));
    }
    let azimuths = shape[1];
    let name = format!("{prefix}.half_weights");
    let (of, weights) = get_f64(from, &name, 3)?;
    if of != [shape[0] * shape[1], half_vectors.len(), 3] {
        return Err(PartError::Unexpected(name));
    }
    let rows = weights.as_chunks::<3>().0.chunks_exact(half_vectors.len());
    let view = |([energy, leak], weights): (&[f64; 2], &[[f64; 3]])| HalfView {
        weights: weights.to_vec(),
        energy: *energy,
        leak: *leak,
    };
    let views = numbers.as_chunks::<2>().0.iter().zip(rows).map(view).collect();
    let name = format!("{prefix}.half_diffuse");
    let (_, diffuse) = get_f64(from, &name, 1)?;
    let diffuse = diffuse[..].try_into().map_err(|_| PartError::Unexpected(name))?;
    Ok(Some(HalfFit { diffuse, half_vectors, azimuths, views }))
}

/// The tables of a fit for the levels of a chain; each row goes once around.
pub(super) fn views(light: &Light, fit: &HalfFit, p: &Params) -> (Views, Report) {
    let (rows, columns) = (fit.elevations(), fit.azimuths + 1);
    let at = |place: usize| &fit.views[place / columns * fit.azimuths + place % columns % fit.azimuths];
    let all =
        || (0..fit.half_vectors.len()).flat_map(move |k| (0..rows * columns).map(move |place| (k, place)));
    let weight = |(k, place): (usize, usize)| {
        let [r, g, b] = at(place).weights[k];
        [r, g, b, 0.0].map(|v| v as f32)
    };
    let zonal = |h: &HalfVector| {
        let a = zonal::gaussian(MOST - 1, (h.sigma * h.sigma).recip());
        [1, 2, 3, 4].map(|l| a.get(l).map_or(0.0, |x| (x / a[0]) as f32))
    };
    let half_vector = |h: &HalfVector| [h.h.x, h.h.y, h.h.z, light.level(h.sigma)].map(|v| v as f32);
    let views = Views {
        means: Vec::new(),
        sweeps: Vec::new(),
        half_vectors: fit.half_vectors.iter().map(half_vector).collect(),
        columns,
        weights: all().map(weight).collect(),
        zonal: if p.is_convolved() { fit.half_vectors.iter().map(zonal).collect() } else { Vec::new() },
        lobes: fit.half_vectors.len(),
        diffuse: fit.diffuse.map(|d| d as f32),
        used: Vec::new(),
    };
    let views = views.with_used();
    let report = report(light, fit, &views);
    (views, report)
}

fn report(light: &Light, fit: &HalfFit, views: &Views) -> Report {
    let [narrow, _] = light.range();
    let (mut all, mut sharper) = (0.0, 0.0);
    for view in &fit.views {
        for (w, h) in view.weights.iter().zip(&fit.half_vectors) {
            let weight = w.iter().sum::<f64>();
            all += weight;
            sharper += if h.sigma < narrow { weight } else { 0.0 };
        }
    }
    let most = |of: fn(&HalfView) -> f64| fit.views.iter().map(of).fold(0.0, f64::max);
    let lookups = |of: &Vec<u32>| of.len();
    let mean = views.used.iter().map(lookups).sum::<usize>() as f64 / views.used.len() as f64;
    Report::default()
        .detail("bytes of the material", fit.bytes() as f64)
        .detail("levels", light.sigmas.len() as f64)
        .detail("half vectors", fit.half_vectors.len() as f64)
        .detail("weight sharper than level 0", if all > 0.0 { sharper / all } else { 0.0 })
        .detail(
            "fit error of the specular part, energy, mean over views",
            fit.views.iter().map(|v| v.energy).sum::<f64>() / fit.views.len() as f64,
        )
        .detail("fit error of the specular part, energy, worst view", most(|v| v.energy))
        .detail("weight below the horizon, worst view", most(|v| v.leak))
        .detail("lookups of a point, mean over views", mean)
        .detail("lookups of a point, most", views.used.iter().map(lookups).max().unwrap_or(0) as f64)
}

/// Row of the tables, fractional, of θ_o over the last elevation: rows lie closer together towards grazing
/// views ([`HalfFit::theta`]).
#[inline(always)]
fn row(theta: f32, rows: usize) -> f32 {
    (1.0 - (1.0 - theta.clamp(0.0, 1.0)).sqrt()) * (rows - 1) as f32
}

/// The place of a view in the tables.
#[inline(always)]
pub(super) fn place(v: &Views, n: [f32; 3], t: [f32; 3], wo: [f32; 3]) -> Place {
    Place::at_row(v, n, t, wo, row)
}

/// The Gaussian about a half vector: its mean, weights and level, and zonal coefficients of visibility.
pub(super) struct Gaussian {
    pub mean: [f32; 3],
    pub weight: [f32; 4],
    pub level: f32,
    pub zonal: [f32; 4],
}

impl Gaussian {
    /// The `k`-th, in a frame of tangent, bitangent and normal.
    #[inline(always)]
    pub(super) fn new(v: &Views, place: &Place, k: usize, axes: &[[f32; 3]; 3], wo: [f32; 3]) -> Self {
        let [x, y, z, level] = v.half_vectors[k];
        let h: [f32; 3] = std::array::from_fn(|c| x * axes[0][c] + y * axes[1][c] + z * axes[2][c]);
        let twice = 2.0 * dot(wo, h);
        Self {
            mean: std::array::from_fn(|c| twice * h[c] - wo[c]),
            weight: place.at(v, &v.weights, k),
            level,
            zonal: v.zonal.get(k).copied().unwrap_or([1.0; 4]),
        }
    }
}
