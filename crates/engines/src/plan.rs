//! What is to be made: the kernels of the levels, their sizes, and the arrangement.

use crate::request::check_levels;
use crate::{Engine, EngineError, Files, Request};
use std::sync::Arc;
use steradian_brdf::{NormalKernel, SharedBrdf};
use steradian_light::load::Arrangement;
use steradian_prefilter::{Lobe, Radial, Zonal};
use steradian_sphere::Layout;

/// What one map holds.
#[derive(Clone)]
pub struct Filter {
    /// `None`: a mirror.
    pub lobe: Option<Kernel>,
    /// Of the microfacet kernels.
    pub roughness: Option<f64>,
}

/// What a map is convolved with.
#[derive(Clone)]
pub enum Kernel {
    /// Of a formula.
    Lobe(Lobe),
    /// A reflectance at normal incidence.
    Radial(Arc<Radial>),
}

impl Kernel {
    /// As a kernel of the filters.
    pub fn zonal(&self) -> &dyn Zonal {
        match self {
            Self::Lobe(lobe) => lobe,
            Self::Radial(radial) => &**radial,
        }
    }

    /// Error of its band coefficients, relative to the first; 0 where they have a closed form.
    pub fn accuracy(&self) -> f64 {
        match self {
            Self::Lobe(_) => 0.0,
            Self::Radial(radial) => radial.accuracy(),
        }
    }
}

/// A kernel of the family `name` at a perceptual roughness.
pub(crate) fn microfacet(name: &str, r: f64) -> Filter {
    // Charlie's lobe ends at a width, which is what its level holds and its file says.
    let r = if name == "charlie" { r.max(Lobe::LEAST_CHARLIE.sqrt()) } else { r };
    let alpha = r * r;
    let lobe = match name {
        "charlie" => Some(Lobe::charlie(alpha)),
        _ if alpha == 0.0 => None,
        "beckmann" => Some(Lobe::beckmann(alpha)),
        _ => Some(Lobe::ggx(alpha)),
    };
    Filter { lobe: lobe.map(Kernel::Lobe), roughness: Some(r) }
}

pub(crate) fn has_roughness(name: &str) -> bool {
    matches!(name, "ggx" | "beckmann" | "charlie")
}

/// The kernel of a reflectance: f ⟨n·wi⟩ at n = wo, its channels' mean.
pub(crate) fn normal_incidence(name: &str, brdf: SharedBrdf) -> Result<Kernel, EngineError> {
    let kernel = NormalKernel::new(brdf).ok_or_else(|| {
        EngineError::request(format!(
            "`kernel` {name}: is anisotropic; a filtered map needs an isotropic one"
        ))
    })?;
    let radial = Radial::new(|theta| kernel.at_angle(theta).iter().sum::<f64>() / 3.0);
    let radial = radial.ok_or_else(|| {
        EngineError::request(format!(
            "`kernel` {name}: reflects nothing, or no finite amount, at normal incidence"
        ))
    })?;
    Ok(Kernel::Radial(Arc::new(radial)))
}

/// Largest exponent of a Phong or Blinn–Phong kernel: a hundredth of a degree wide, and as reflectances take
/// it.
const MAX_EXPONENT: f64 = 1e8;
/// Narrowest Gaussian in degrees: a fortieth of a texel of an image of 8192 × 4096.
const MIN_SIGMA_DEGREES: f64 = 1e-3;

/// The single kernel that the options name; `given` is that of a reflectance.
fn single(o: &Request, given: Option<Kernel>) -> Result<Filter, EngineError> {
    if given.is_some() {
        return Ok(Filter { lobe: given, roughness: None });
    }
    let needs = |option: &str| EngineError::request(format!("`kernel` {} needs {option}", o.kernel));
    let plain = |lobe| Ok(Filter { lobe: Some(Kernel::Lobe(lobe)), roughness: None });
    if let Some(n) = o.exponent.filter(|n| !(*n > 0.0 && *n <= MAX_EXPONENT)) {
        return Err(EngineError::Request(format!(
            "`exponent` {n:e}: a number above 0, {MAX_EXPONENT:e} at most"
        )));
    }
    if let Some(s) = o.sigma.filter(|s| !(MIN_SIGMA_DEGREES..=180.0).contains(s)) {
        return Err(EngineError::Request(format!("`sigma` {s:e}: {MIN_SIGMA_DEGREES} to 180 degrees")));
    }
    match o.kernel.as_str() {
        "lambert" => plain(Lobe::lambert()),
        "phong" => plain(Lobe::phong(o.exponent.ok_or_else(|| needs("`exponent`"))?)),
        "blinn-phong" => plain(Lobe::blinn_phong(o.exponent.ok_or_else(|| needs("`exponent`"))?)),
        "gaussian" => plain(Lobe::gaussian(o.sigma.ok_or_else(|| needs("`sigma`"))?.to_radians())),
        "spherical-gaussian" => {
            let sigma = o.sigma.ok_or_else(|| needs("`sigma`"))?;
            plain(Lobe::spherical_gaussian(sigma.to_radians()))
        }
        name => {
            let r = o.perceptual_roughness.or(o.alpha.map(f64::sqrt));
            Ok(microfacet(name, r.ok_or_else(|| needs("`perceptual-roughness` or `alpha`, or `levels`"))?))
        }
    }
}

/// Everything that is to be made.
pub struct Plan {
    /// Whose conventions.
    pub engine: &'static Engine,
    /// Level by level.
    pub filters: Vec<Filter>,
    /// Width and height of level 0.
    pub size: (usize, usize),
    /// Cube or lat-long.
    pub layout: Layout,
}

impl Plan {
    /// The consumer, with the format of texels that was asked for.
    pub fn with_format(&self, o: &Request) -> Engine {
        Engine { format: o.format.unwrap_or(self.engine.format), ..*self.engine }
    }
}

pub(crate) fn plan(o: &Request, given: Option<Kernel>) -> Result<Plan, EngineError> {
    let raw = || Engine::find("raw").ok_or_else(|| EngineError::Failed("the profile raw is missing".into()));
    let engine = o.engine.map_or_else(raw, Ok)?;
    let extension = o.output.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if matches!(engine.files, Files::LatLong { cube: None, .. }) {
        return panorama(o, engine);
    }
    let lat_long = o.engine.is_none() && matches!(extension.as_str(), "exr" | "hdr" | "pfm");
    if o.engine.is_none() && !lat_long && !matches!(extension.as_str(), "ktx2" | "ktx" | "dds") {
        let why = "the output is a .ktx2, .ktx, .dds, .exr, .hdr or .pfm file; with `profile` it is a folder";
        return Err(EngineError::request(format!("{}: {why}", o.output.display())));
    }
    let target = if lat_long { Arrangement::LatLong } else { Arrangement::Cube };
    let usual = if lat_long { 4 * engine.size } else { engine.size };
    let size = side(o.size.unwrap_or((usual, usual)), target)?;
    let chain = o.engine.is_some() || o.levels.is_some();
    if !chain {
        let layout = if lat_long { Layout::LatLong } else { Layout::Cube };
        return Ok(Plan { engine, filters: vec![single(o, given)?], size, layout });
    }
    if lat_long {
        return Err(EngineError::request(
            "`levels`: a lat-long file has one level; `dump-levels` writes them all",
        ));
    }
    if !has_roughness(&o.kernel) || (o.engine.is_some() && o.kernel != "ggx") {
        return Err(EngineError::request(format!(
            "`kernel` {}: chains go over the roughness of ggx{}",
            o.kernel,
            if o.engine.is_some() { "" } else { ", beckmann or charlie" }
        )));
    }
    if !size.0.is_power_of_two() {
        return Err(EngineError::request(format!(
            "`size` {}: the side of a chain is a power of two",
            size.0
        )));
    }
    let most = size.0.ilog2() as usize + 1;
    let whole = engine.unfiltered() || size.0 <= engine.last;
    let usual = if whole { 1 } else { (size.0 / engine.last).ilog2() as usize + 1 };
    let levels = o.levels.unwrap_or(usual);
    if levels > most {
        return Err(EngineError::request(format!(
            "`levels` {levels}: {} texels a side have {most} at most",
            size.0
        )));
    }
    if let Some(e) = o.engine {
        check_levels(e, size.0, levels)?;
    }
    let filters = (0..levels).map(|m| microfacet(&o.kernel, engine.curve.roughness(m, levels - 1))).collect();
    Ok(Plan { engine, filters, size, layout: Layout::Cube })
}

/// [`Arrangement::side`].
fn side(size: (usize, usize), arrangement: Arrangement) -> Result<(usize, usize), EngineError> {
    arrangement.side(size).map_err(|e| EngineError::Request(format!("`size`: {e}")))
}

/// The light as it is, lat-long; as large as the input where nothing else is asked for.
fn panorama(o: &Request, engine: &'static Engine) -> Result<Plan, EngineError> {
    if o.levels.is_some_and(|l| l > 1) {
        let name = engine.name;
        return Err(EngineError::request(format!(
            "`levels`: {name} filters by itself and takes one lat-long image"
        )));
    }
    let size = o.size.map_or(Ok((0, 0)), |s| side(s, Arrangement::LatLong))?;
    Ok(Plan {
        engine,
        filters: vec![Filter { lobe: None, roughness: Some(0.0) }],
        size,
        layout: Layout::LatLong,
    })
}
