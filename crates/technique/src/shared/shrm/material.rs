//! The reflectance's slices, evenly spaced in elevation.

use super::{Orders, TOLERANCE};
use crate::shared::material::kernels::{COARSE, Kernels, refused};
use crate::{BakeError, Material};
use steradian_base::Task;
use steradian_brdf::Brdf;
use steradian_brdf::central::{Argument, CentralError, Centre, Lpq, Slice, Slices};

/// Elevations of the fit.
const ELEVATIONS: usize = 45;
/// F of the slices at first.
const FIRST_ORDER: usize = 48;
/// The highest F that a tolerance may raise it to: as high as the light's spectrum reaches for any technique
/// ([`crate::shared::material::views::MOST`]).
const MAX_ORDER: usize = 96;
/// Number of elevations, F and P of the fits by which centres are compared.
const TRIAL: (usize, usize, usize) = (8, 16, 2);
/// F must represent the lobe for views up to this angle from the normal, degrees.
const VIEWS: f64 = 80.5;
/// Q of the slices. It exceeds the P of any fit, so that the energy that a fit leaves out is measured.
const AZIMUTH: usize = 12;

/// `count` elevations of the viewer about `centre`: the midpoints of equal parts of their range.
fn elevations(centre: Centre, count: usize) -> Vec<Slice> {
    let middle = |i: usize| centre.reach() * (i as f64 + 0.5) / count as f64;
    (0..count).map(|i| centre.slice(middle(i))).collect()
}

/// The centre about which low orders hold most of the energy: the tangent for anisotropic reflectance, which
/// depends on it alone, else the mirror direction or the normal.
fn best_centre(brdf: &dyn Brdf, task: &Task) -> Result<Centre, CentralError> {
    if !brdf.is_isotropic() {
        return Ok(Centre::Tangent);
    }
    let share = |centre| {
        let slices = Slices::to(brdf, centre, elevations(centre, TRIAL.0), [TRIAL.1; 2], COARSE, task)?;
        let fit = Lpq::fit(&slices, Argument::View, TRIAL.2, &|_| 1.0, false)?;
        Ok::<_, CentralError>(fit.share(TRIAL.1, TRIAL.2))
    };
    let (reflection, normal) = (share(Centre::Reflection)?, share(Centre::Normal)?);
    Ok(if normal > reflection { Centre::Normal } else { Centre::Reflection })
}

/// The slices of a material about the centre that the parameters say.
pub fn material(slug: &'static str, m: &Material, p: &Orders, task: &Task) -> Result<Kernels, BakeError> {
    let brdf = &*m.brdf;
    let refused = refused(slug);
    let centre = p.centre.map_or_else(|| best_centre(brdf, task), Ok).map_err(&refused)?;
    let tolerance = task.tolerance().unwrap_or(TOLERANCE);
    let share = (0.5 * tolerance).powi(2);
    let least = [p.order.unwrap_or(FIRST_ORDER), AZIMUTH];
    let most = [p.order.unwrap_or(MAX_ORDER), AZIMUTH];
    let elevations = elevations(centre, ELEVATIONS);
    Kernels::new(m, centre, &elevations, &[least, most], VIEWS.to_radians(), share, task).map_err(refused)
}
