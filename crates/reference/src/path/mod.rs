//! The reference where there is visibility: a path tracer.
//!
//! Distant light and reflectance are both sampled at every vertex and combined by the balance heuristic;
//! directional and point lights are summed. One bounce is direct light. Every pixel and every point has
//! random numbers of its own, made of the seed and its index, so that nothing depends on the number of
//! threads; each mean comes with the variance of that mean. Texels are constant over their exact lat-long
//! cells. Surfaces seen from behind (n·wo ≤ 0) are black.

mod photograph;
mod probes;
mod random;
mod sampler;
mod tracer;

pub use photograph::{Patch, Photographs, photograph};
pub use probes::{Kept, ProbeEstimate, ProbeImage, trace_environments, trace_probes};

use glam::DVec3;
use random::Random;
use sampler::Sampler;
use steradian_base::{Cancelled, Task};
use steradian_brdf::{Brdf, SharedBrdf};
use steradian_light::Lights;
use steradian_parallel::prelude::*;
use steradian_scene::{Bvh, Camera, Mesh, Surface};
use steradian_sphere::Frame;
use tracer::{Tracer, Vertex};

/// Base colour at a point of a surface, linear Rec. 709.
pub type Tint<'a> = dyn Fn(&Surface) -> [f64; 3] + Sync + 'a;

/// The scene that paths are traced through.
#[derive(Clone, Copy)]
pub struct PathScene<'a> {
    /// The geometry.
    pub mesh: &'a Mesh,
    /// Acceleration structure of the mesh.
    pub bvh: &'a Bvh,
    /// Reflectances by material slot; slots beyond the last take the first.
    pub materials: &'a [SharedBrdf],
    /// Multiplies the net reflectance at a point of the mesh (a base-colour texture).
    pub tint: Option<&'a Tint<'a>>,
    /// All light. Environments are lat-long images.
    pub lights: &'a Lights,
    /// Distance that rays start off the surface, metres; see [`PathScene::OFFSET`].
    pub offset: f64,
}

impl PathScene<'_> {
    /// Default offset of rays: 1e-4 in scene units.
    pub const OFFSET: f64 = 1e-4;
}

/// The instruction set by which paths are traced: another one gives other bits.
pub fn instructions() -> &'static str {
    steradian_simd::isa().name()
}

/// Number of paths and of scattering events.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathOptions {
    /// Reflections at most; 1 is direct light only.
    pub bounces: u32,
    /// Paths per pixel or point.
    pub samples: u32,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Default for PathOptions {
    fn default() -> Self {
        Self { bounces: 4, samples: 64, seed: 0 }
    }
}

/// A mean over paths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathEstimate {
    /// Radiance, W sr⁻¹ m⁻².
    pub rgb: [f64; 3],
    /// Estimated variance of that mean, per channel; infinite with fewer than two samples.
    pub variance: [f64; 3],
}

/// A point of a surface whose radiance is computed.
#[derive(Debug, Clone, Copy)]
pub struct PathPoint<'a> {
    /// Position, metres.
    pub position: DVec3,
    /// Shading frame, orthonormal.
    pub frame: Frame,
    /// Unit direction to the viewer, world space.
    pub wo: DVec3,
    /// Reflectance.
    pub brdf: &'a dyn Brdf,
}

/// A picture of means and variances.
#[derive(Debug, Clone, PartialEq)]
pub struct PathImage {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pixels, rows from the top.
    pub pixels: Vec<PathEstimate>,
}

/// Radiance that leaves `points`, with visibility and `bounces` reflections.
pub fn trace_points(
    scene: &PathScene<'_>,
    points: &[PathPoint<'_>],
    options: PathOptions,
    task: &Task,
) -> Result<Vec<PathEstimate>, Cancelled> {
    let tracer = Tracer { scene, sampler: Sampler::new(scene.lights) };
    task.begin("path tracing", points.len() as u64);
    let one = |(k, p): (usize, &PathPoint<'_>)| {
        task.check()?;
        let v = Vertex {
            position: p.position,
            side: p.frame.n,
            frame: p.frame,
            wo: p.frame.to_local(p.wo),
            brdf: p.brdf,
            tint: [1.0; 3],
        };
        let path = |random: &mut Random| tracer.reflected(v, options.bounces, random);
        let e = mean(options, k as u64, path);
        task.advance(1);
        Ok(e)
    };
    let out = points.par_iter().enumerate().with_max_len(1).map(one).collect();
    task.end();
    out
}

/// The picture that a camera sees, each pixel a box filter over its area; distant light is the background.
pub fn trace_image(
    scene: &PathScene<'_>,
    camera: &Camera,
    width: u32,
    height: u32,
    options: PathOptions,
    task: &Task,
) -> Result<PathImage, Cancelled> {
    let tracer = Tracer { scene, sampler: Sampler::new(scene.lights) };
    task.begin("path tracing", u64::from(height));
    let row = |j: u32| {
        task.check()?;
        let pixel = |i: u32| {
            mean(options, u64::from(j) * u64::from(width) + u64::from(i), |random| {
                let u = random.pair();
                let ray = camera.ray(i as f32 + u.x as f32, j as f32 + u.y as f32, width, height);
                tracer.along(&ray, options.bounces, random)
            })
        };
        let out: Vec<_> = (0..width).map(pixel).collect();
        task.advance(1);
        Ok(out)
    };
    let rows: Result<Vec<_>, Cancelled> = (0..height).into_par_iter().with_max_len(1).map(row).collect();
    task.end();
    Ok(PathImage { width, height, pixels: rows?.concat() })
}

/// Mean of `path` over the samples, and the variance of the mean (Welford 1962).
fn mean(options: PathOptions, index: u64, mut path: impl FnMut(&mut Random) -> [f64; 3]) -> PathEstimate {
    let (mut rgb, mut squares) = ([0.0; 3], [0.0; 3]);
    for s in 0..options.samples {
        let value = path(&mut Random::new(options.seed, index, u64::from(s)));
        for c in 0..3 {
            let from = value[c] - rgb[c];
            rgb[c] += from / f64::from(s + 1);
            squares[c] += from * (value[c] - rgb[c]);
        }
    }
    let n = f64::from(options.samples);
    let variance =
        if options.samples > 1 { squares.map(|s| s / (n * (n - 1.0))) } else { [f64::INFINITY; 3] };
    PathEstimate { rgb, variance }
}
