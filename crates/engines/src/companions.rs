//! What an engine's files hold in addition to the specular levels: diffuse light, sheen, the light as it is.

use crate::levels::{Job, Level};
use crate::plan::{Filter, Kernel, Plan, microfacet};
use crate::{Engine, EngineError, Files};
use steradian_prefilter::Lobe;
use steradian_sphere::Layout;
use steradian_sphere::sh::ShRgb;

/// Texels a side of the faces of diffuse cubes.
pub(crate) const DIFFUSE: usize = 32;

/// Is there a diffuse cube?
pub(crate) fn has_diffuse(engine: &Engine) -> bool {
    matches!(engine.files, Files::Khronos | Files::Ktx2 { diffuse: Some(_), .. })
}

/// Is there a cube of sheen, as large as the specular one?
pub(crate) fn has_sheen(engine: &Engine) -> bool {
    engine.files == Files::Khronos
}

/// Is there a lat-long image of the light in addition to the cube?
pub(crate) fn has_panorama(engine: &Engine) -> bool {
    matches!(engine.files, Files::LatLong { cube: Some(_), .. })
}

/// The sheen level that belongs to a specular one.
fn sheen_of(specular: &Filter) -> Filter {
    microfacet("charlie", specular.roughness.unwrap_or(0.0))
}

/// The kernels of all maps other than the levels: the light is analysed up to the bands that these need.
pub(crate) fn kernels(plan: &Plan) -> Vec<Kernel> {
    let mut all = Vec::new();
    if has_diffuse(plan.engine) {
        all.push(Kernel::Lobe(Lobe::lambert()));
    }
    if has_sheen(plan.engine) {
        all.extend(plan.filters.iter().filter_map(|f| sheen_of(f).lobe));
    }
    all
}

/// Filtered maps other than the specular levels.
pub struct Companions {
    /// The cube of diffuse light.
    pub diffuse: Option<Level>,
    /// The levels of the cube of sheen.
    pub sheen: Vec<Level>,
    /// The unfiltered light, in addition to cubes.
    pub panorama: Option<Level>,
    /// Radiance, bands 0 to 2.
    pub sh: ShRgb,
}

impl Companions {
    /// What accompanies a single file.
    pub(crate) fn none() -> Self {
        Self { diffuse: None, sheen: Vec::new(), panorama: None, sh: ShRgb::zero(0) }
    }

    pub(crate) fn new(plan: &Plan, job: &Job<'_>, levels: &[Level]) -> Result<Self, EngineError> {
        let engine = plan.engine;
        let mut out = Self { sh: job.light.coefficients(2), ..Self::none() };
        if has_diffuse(engine) {
            let filter = Filter { lobe: Some(Kernel::Lobe(Lobe::lambert())), roughness: None };
            out.diffuse = Some(job.level(filter, (Layout::Cube, DIFFUSE, DIFFUSE))?);
        }
        if has_sheen(engine) {
            for l in levels {
                let n = l.filtered.image.width;
                out.sheen.push(job.level(sheen_of(&l.filter), (Layout::Cube, n, n))?);
            }
        }
        if has_panorama(engine) {
            let (w, h) = (job.light.image.width, job.light.image.height);
            let mirror = Filter { lobe: None, roughness: Some(0.0) };
            out.panorama = Some(job.level(mirror, (Layout::LatLong, w, h))?);
        }
        Ok(out)
    }

    /// Every map, and what it is.
    pub fn maps(&self) -> impl Iterator<Item = (&'static str, &Level)> {
        let diffuse = self.diffuse.iter().map(|l| ("diffuse", l));
        let sheen = self.sheen.iter().map(|l| ("sheen", l));
        diffuse.chain(sheen).chain(self.panorama.iter().map(|l| ("panorama", l)))
    }
}
