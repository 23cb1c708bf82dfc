//! One fit of slices by harmonics in the view or in the normal.

use super::powers::{Powers, Seen};
use steradian_brdf::central::{Argument, CentralError, Centre, Lpq, Slices};

/// Rounds of reweighting, by which the errors of the elevations that count become even.
const ROUNDS: usize = 8;

/// A fit and the slices that it approximates.
pub struct Fit {
    /// The slices without the diffuse part, which are fitted.
    pub rest: Slices,
    /// ρ̂_lpq.
    pub lpq: Lpq,
    /// Albedo of the diffuse part.
    pub diffuse: [f64; 3],
}

/// Options of a fit.
#[derive(Debug, Clone, Copy)]
pub struct How {
    /// The direction that y_pq are functions of.
    pub of: Argument,
    /// The paper's projection.
    pub plain: bool,
    /// Every elevation counts, not only those up to 60°.
    pub everywhere: bool,
    /// Relative error that each elevation should have.
    pub each: f64,
}

/// Weight of an elevation θ_v in the fit: 1 up to about 60°, then falling towards the horizon, since lobes at
/// grazing views, which harmonics of the view cannot represent anyway, would otherwise spoil the fit
/// elsewhere.
fn emphasis(theta_v: f64, of: Argument) -> f64 {
    let degrees = theta_v.to_degrees();
    match of {
        Argument::View => ((80.0 - degrees) / 15.0).clamp(0.0, 1.0).powi(2) + 0.002,
        Argument::Normal if degrees < 62.0 => 1.0,
        Argument::Normal => 0.3 * ((90.0 - degrees) / 28.0).clamp(0.0, 1.0).powi(2) + 0.003,
    }
}

/// The fit of order `p` that serves the elevations that count best, with its powers.
pub fn best(
    seen: &Seen<'_>,
    s: &Slices,
    p: usize,
    diffuse: bool,
    how: How,
    met: impl Fn(&Powers) -> bool,
) -> Result<(Fit, Powers), CentralError> {
    let mut emphases: Vec<f64> = match s.centre {
        Centre::Tangent => vec![1.0; s.slices.len()],
        _ => s.slices.iter().map(|s| emphasis(s.theta_v, how.of)).collect(),
    };
    let one = |emphases: &[f64]| {
        let fit = fit(s, p, diffuse, how, emphases)?;
        let powers = Powers::new(seen, s, &fit.rest, &fit.lpq, how.everywhere);
        Ok::<_, CentralError>((fit, powers))
    };
    let mut best = one(&emphases)?;
    best.1.even_out(how.each * how.each, &mut emphases);
    // About the tangent one more p costs one more map. That is better than an error that is spread evenly,
    // and is therefore visible where the surface is dark.
    let once = how.plain || how.everywhere || s.centre == Centre::Tangent;
    for _ in 1..if once { 1 } else { ROUNDS } {
        if met(&best.1) {
            break;
        }
        let next = one(&emphases)?;
        next.1.even_out(how.each * how.each, &mut emphases);
        if next.1.worst() < best.1.worst() {
            best = next;
        }
    }
    Ok(best)
}

fn fit(s: &Slices, p: usize, diffuse: bool, how: How, emphases: &[f64]) -> Result<Fit, CentralError> {
    // The fit's own measure is sin θ_o dθ_o; views are spread evenly over the hemisphere.
    let view = |theta_o: f64| match s.centre {
        Centre::Reflection => 0.5 * theta_o,
        _ => theta_o,
    };
    // Slices are evenly spaced.
    let count = s.slices.len();
    let index = |theta_o: f64| ((theta_o / s.centre.reach() * count as f64) as usize).min(count - 1);
    let weight = |theta_o: f64| match s.centre {
        _ if how.plain => 1.0,
        Centre::Tangent => emphases[index(theta_o)],
        _ => emphases[index(theta_o)] * view(theta_o).sin() / theta_o.sin().max(1e-3),
    };
    let albedo = if diffuse { s.best_diffuse(how.of, p, &weight)? } else { [0.0; 3] };
    let rest = if diffuse { s.without_diffuse(albedo) } else { s.clone() };
    let scaled = !how.plain && s.centre != Centre::Tangent && scalable(&rest);
    Ok(Fit { lpq: Lpq::fit(&rest, how.of, p, &weight, scaled)?, rest, diffuse: albedo })
}

/// Has every elevation an albedo to divide by?
fn scalable(s: &Slices) -> bool {
    (0..3).all(|c| {
        let albedo = (0..s.slices.len()).map(|i| s.row(i, 0)[c][0]);
        let most = albedo.clone().fold(0.0, f64::max);
        albedo.fold(f64::INFINITY, f64::min) >= 0.02 * most
    })
}
