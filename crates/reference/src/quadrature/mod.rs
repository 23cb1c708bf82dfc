//! The reference: deterministic adaptive quadrature of L_o = ∫ L(wi) f(wi, wo) ⟨n·wi⟩ dwi, without
//! visibility.
//!
//! Each distant light is a set of rectangles in polar coordinates (φ, θ) of some chart: the image's blocks of
//! texels in the world's, a disk's in polar coordinates about its centre. On a rectangle, g = f_cos sin θ is
//! sampled on a 6 × 6 Gauss grid and interpolated; the integral of the interpolant against the light is
//! exact, by moments of L that a pyramid holds for every block (product integration). So light of any
//! contrast costs nothing where the reflectance is smooth. The error is estimated from the decay of the
//! interpolant's Legendre coefficients and from five check points. Rectangles are cut, the worst first, until
//! the errors sum to the tolerance; below single texels too. Rectangles larger than the lobes that a
//! reflectance names are cut before they are trusted, and at the horizon n·wi = 0, where f_cos has a kink or
//! a jump, texels are integrated up to the analytic curve.

mod cells;
mod engine;
mod fit;
mod geometry;
mod hints;
mod horizon;
mod legendre;
mod pyramid;
mod rule;

pub use cells::Lookup;

use cells::ImageCells;
use engine::{Engine, Scene, View};
use geometry::Chart;
use glam::DVec3;
use hints::Hints;
use pyramid::Pyramid;
use rule::Integrand;
use steradian_base::{Cancelled, Task};
use steradian_brdf::{Brdf, Domain};
use steradian_light::{Lights, Unsound};
use steradian_parallel::prelude::*;
use steradian_sphere::{Frame, Layout};

/// Evaluations of f_cos after which a point stops; the remaining error is stated.
pub const MAX_EVALUATIONS: u64 = 4_000_000;

/// Least tolerance: sums in double precision reach no further.
const FINEST_TOLERANCE: f64 = 1e-12;

/// Light that the reference cannot take.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ReferenceError {
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// An environment is a lat-long image.
    #[error("the reference takes lat-long environments; resample this {0:?} image first")]
    Layout(Layout),
    /// Planes whose lengths differ from width × height, or an image without texels.
    #[error("the environment's planes do not hold {width} x {height} texels")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// Light that is not finite, or too strong.
    #[error(transparent)]
    Unsound(#[from] Unsound),
}

/// Outgoing radiance with its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Radiance, W sr⁻¹ m⁻².
    pub rgb: [f64; 3],
    /// Estimated relative error: the largest absolute error of a channel over the largest channel. 0 where
    /// the radiance is exactly zero; infinite where the reflectance is not finite, or a point light has no
    /// position to be seen from.
    pub error: f64,
    /// Number of evaluations of f_cos.
    pub evaluations: u64,
}

impl Estimate {
    /// No radiance.
    pub const ZERO: Self = Self { rgb: [0.0; 3], error: 0.0, evaluations: 0 };
}

/// A point to be judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferencePoint {
    /// Shading frame of the point, world space, orthonormal.
    pub frame: Frame,
    /// Unit direction to the viewer, world space.
    pub wo: DVec3,
    /// Position, metres, which point lights need.
    pub position: Option<DVec3>,
}

/// The reference of one set of lights.
#[derive(Debug, Clone)]
pub struct Reference {
    lights: Lights,
    lookup: Lookup,
    pyramid: Option<Pyramid>,
    budget: u64,
}

impl Reference {
    /// Takes the lights and sums the moments of the environment.
    pub fn new(lights: &Lights, lookup: Lookup, task: &Task) -> Result<Self, ReferenceError> {
        check(lights)?;
        let pyramid = match &lights.environment {
            Some(e) => Some(Pyramid::build(&ImageCells::new(&e.image, lookup), task)?),
            None => None,
        };
        Ok(Self { lights: lights.clone(), lookup, pyramid, budget: MAX_EVALUATIONS })
    }

    /// This reference with a limit of about `evaluations` per point.
    pub fn with_budget(mut self, evaluations: u64) -> Self {
        self.budget = evaluations;
        self
    }

    /// Radiance from a point towards the unit direction `wo` (world space), to a relative error of about
    /// `tolerance` (the usual one is 1e-4). n·wo ≤ 0 gives 0.
    pub fn radiance(
        &self,
        brdf: &dyn Brdf,
        frame: &Frame,
        wo: DVec3,
        position: Option<DVec3>,
        tolerance: f64,
    ) -> Estimate {
        let wo = frame.to_local(wo);
        if wo.is_finite() && wo.z <= 0.0 {
            return Estimate::ZERO;
        }
        if !wo.is_finite() {
            return Estimate { error: f64::INFINITY, ..Estimate::ZERO };
        }
        let mut g = Integrand::new(brdf, wo);
        let small = self.small_lights(&mut g, frame, position);
        let tolerance = if tolerance > FINEST_TOLERANCE { tolerance } else { FINEST_TOLERANCE };
        let scene = self.scene(brdf, frame, wo, tolerance);
        let total = Engine::new(&scene, &mut g, self.budget).run(tolerance, small);
        let rgb = std::array::from_fn(|c| total.value[c] + small[c]);
        let lost = g.broken || (position.is_none() && !self.lights.points.is_empty());
        let error = if lost { f64::INFINITY } else { relative(total.error, rgb) };
        Estimate { rgb, error, evaluations: g.evaluations }
    }

    /// Radiance of many points, on all cores; the bits do not depend on their number.
    pub fn radiance_batch(
        &self,
        brdf: &dyn Brdf,
        points: &[ReferencePoint],
        tolerance: f64,
        task: &Task,
    ) -> Result<Vec<Estimate>, Cancelled> {
        task.begin("reference", points.len() as u64);
        let judged = |p: &ReferencePoint| {
            task.check()?;
            let e = self.radiance(brdf, &p.frame, p.wo, p.position, tolerance);
            task.advance(1);
            Ok(e)
        };
        let out = points.par_iter().with_max_len(1).map(judged).collect();
        task.end();
        out
    }

    fn scene(&self, brdf: &dyn Brdf, frame: &Frame, wo: DVec3, tolerance: f64) -> Scene<'_> {
        let world =
            Chart { x: frame.to_local(DVec3::X), y: frame.to_local(DVec3::Y), z: frame.to_local(DVec3::Z) };
        let mut views = vec![View::new(world)];
        for d in &self.lights.disks {
            views.push(View::new(Chart::about(frame.to_local(d.direction).normalize())));
        }
        let image = self.lights.environment.as_ref().zip(self.pyramid.as_ref());
        Scene {
            image: image.map(|(e, p)| (ImageCells::new(&e.image, self.lookup), p)),
            views,
            disks: self.lights.disks.iter().map(|d| (radius(d.angular_radius), d.radiance)).collect(),
            hints: Hints::new(&brdf.lobes(wo), wo.z, tolerance),
            tolerance,
            clip: brdf.domain() == Domain::Hemisphere,
        }
    }

    /// Directional and point lights: f_cos times irradiance on a surface that faces them.
    fn small_lights(&self, g: &mut Integrand<'_>, frame: &Frame, position: Option<DVec3>) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut light = |direction: DVec3, irradiance: [f64; 3]| {
            let f = g.at(frame.to_local(direction), 1.0);
            for c in 0..3 {
                sum[c] += f[c] * irradiance[c];
            }
        };
        for d in &self.lights.directionals {
            light(d.direction.normalize(), d.irradiance);
        }
        for p in &self.lights.points {
            let Some(position) = position else { break };
            let to = p.position.as_dvec3() - position;
            let d2 = to.length_squared();
            if d2 > 0.0 {
                light(to / d2.sqrt(), p.intensity.map(|i| f64::from(i) / d2));
            }
        }
        sum
    }
}

/// An angular radius within [0, π].
fn radius(r: f64) -> f64 {
    r.clamp(0.0, std::f64::consts::PI)
}

/// Below this, intermediate products underflow: an absolute error that is added to every radiance's.
const UNDERFLOW: f64 = 1e-290;

/// Absolute → relative error.
fn relative(error: f64, rgb: [f64; 3]) -> f64 {
    let top = rgb.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    if error == 0.0 { 0.0 } else { (error + UNDERFLOW) / top }
}

fn check(lights: &Lights) -> Result<(), ReferenceError> {
    if let Some(e) = &lights.environment {
        let image = &e.image;
        if image.layout != Layout::LatLong {
            return Err(ReferenceError::Layout(image.layout));
        }
        let (width, height) = (image.width, image.height);
        if width == 0 || height == 0 || image.planes.iter().any(|p| p.len() != width * height) {
            return Err(ReferenceError::Size { width, height });
        }
    }
    Ok(lights.check()?)
}
