//! What an engine's files hold beside the specular levels: diffuse light, sheen, the light as it is.

use super::plan::{Filter, Kernel, Plan, microfacet};
use super::{Job, Level};
use crate::context::Context;
use crate::failure::Failure;
use steradian_prefilter::Lobe;
use steradian_sphere::Layout;
use steradian_sphere::sh::ShRgb;
use steradian_verify::engines::{Engine, Files};

/// Texels a side of the faces of diffuse cubes.
pub const DIFFUSE: usize = 32;

/// Is there a diffuse cube?
pub fn has_diffuse(engine: &Engine) -> bool {
    matches!(engine.files, Files::Khronos | Files::Ktx2 { diffuse: Some(_), .. })
}

/// Is there a cube of sheen, as large as the specular one?
pub fn has_sheen(engine: &Engine) -> bool {
    engine.files == Files::Khronos
}

/// Is there a lat-long image of the light beside the cube?
fn has_panorama(engine: &Engine) -> bool {
    matches!(engine.files, Files::LatLong { cube: Some(_), .. })
}

/// The sheen's level beside a specular one.
fn sheen_of(specular: &Filter) -> Filter {
    microfacet("charlie", specular.roughness.unwrap_or(0.0))
}

/// The kernels of everything beside the levels, which the light's analysis must know of.
pub fn kernels(plan: &Plan) -> Vec<Kernel> {
    let mut all = Vec::new();
    if has_diffuse(plan.engine) {
        all.push(Kernel::Lobe(Lobe::lambert()));
    }
    if has_sheen(plan.engine) {
        all.extend(plan.filters.iter().filter_map(|f| sheen_of(f).lobe));
    }
    all
}

/// Filtered maps beside the specular levels.
pub struct Beside {
    pub diffuse: Option<Level>,
    pub sheen: Vec<Level>,
    /// The light as it is, beside cubes.
    pub panorama: Option<Level>,
    /// Radiance, bands 0 to 2.
    pub sh: ShRgb,
}

impl Beside {
    /// What a single file has beside it.
    pub fn nothing() -> Self {
        Self { diffuse: None, sheen: Vec::new(), panorama: None, sh: ShRgb::zero(0) }
    }

    pub fn new(plan: &Plan, job: &Job<'_>, levels: &[Level], context: &Context) -> Result<Self, Failure> {
        let engine = plan.engine;
        let mut beside = Self { sh: job.light.coefficients(2), ..Self::nothing() };
        if has_diffuse(engine) {
            let filter = Filter { lobe: Some(Kernel::Lobe(Lobe::lambert())), roughness: None };
            beside.diffuse = Some(job.level(filter, (Layout::Cube, DIFFUSE, DIFFUSE), context)?);
        }
        if has_sheen(engine) {
            for l in levels {
                let n = l.filtered.image.width;
                beside.sheen.push(job.level(sheen_of(&l.filter), (Layout::Cube, n, n), context)?);
            }
        }
        if has_panorama(engine) {
            let (w, h) = (job.light.image.width, job.light.image.height);
            let mirror = Filter { lobe: None, roughness: Some(0.0) };
            beside.panorama = Some(job.level(mirror, (Layout::LatLong, w, h), context)?);
        }
        Ok(beside)
    }

    /// Every map, and what it is.
    pub fn maps(&self) -> impl Iterator<Item = (&'static str, &Level)> {
        let diffuse = self.diffuse.iter().map(|l| ("diffuse", l));
        let sheen = self.sheen.iter().map(|l| ("sheen", l));
        diffuse.chain(sheen).chain(self.panorama.iter().map(|l| ("panorama", l)))
    }
}
