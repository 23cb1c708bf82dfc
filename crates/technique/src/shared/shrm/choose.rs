//! The choice of an expansion for a bake, with what its certificate says of it.

use super::Orders;
use crate::BakeError;
use crate::certify::Report;
use crate::shared::material::kernels::{Kernels, refused};
use steradian_base::Task;
use steradian_prefilter::SunlitSpectrum;
use steradian_prefilter::shrm::choice::{self, Expansion, HighestP};

/// The figure by [`steradian_brdf::central::Centre::number`].
const CENTRE: &str = "centre (1 mirror direction, 2 normal, 3 tangent)";

/// [`choice::choose`] by the parameters, and the report of what was chosen.
pub fn choose(
    slug: &'static str,
    light: &SunlitSpectrum,
    kernels: &Kernels,
    p: &Orders,
    spacing: impl Fn(usize) -> f64,
    highest: HighestP,
    task: &Task,
) -> Result<(Expansion, Report), BakeError> {
    let chosen = choice::choose(light, &kernels.slices, &p.options(kernels), spacing, highest, task);
    let e = chosen.map_err(refused(slug))?;
    let mut report = Report::estimated(e.errors.all, e.errors.elevations.clone())
        .detail("error of views up to 60 degrees", e.errors.near)
        .detail("F", e.f as f64)
        .detail("P", e.lpq.p as f64)
        .detail("Q", e.q as f64)
        .detail("S", e.size as f64)
        .detail("lights", e.apart.suns.len() as f64)
        .detail(CENTRE, kernels.slices.centre.number())
        .detail("diffuse part", e.diffuse.iter().sum::<f64>() / 3.0)
        .detail("error up to 60 degrees beside the suns", e.errors.beside_suns);
    report.missing_energy = Some(e.missing_energy);
    Ok((e, report))
}
