//! Radiance by a path tracer: with shadows and light that surfaces send to each other.

use super::Shader;
use glam::DVec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use steradian_base::{Cancelled, Task};
use steradian_brdf::SharedBrdf;
use steradian_light::Lights;
use steradian_reference::path::{PathOptions, PathPoint, PathScene, trace_points};
use steradian_scene::surface::Texture;
use steradian_scene::{Bvh, Mesh, Surface as Hit};
use steradian_sphere::Frame;
use steradian_technique::{Points, Radiance};

/// The scene that paths are traced through.
pub struct PathStage {
    /// The geometry.
    pub mesh: Arc<Mesh>,
    /// Acceleration structure of the mesh.
    pub bvh: Arc<Bvh>,
    /// Reflectances by material slot, with the base colours that multiply them.
    pub materials: Vec<(SharedBrdf, Option<Arc<Texture>>)>,
    /// All light.
    pub lights: Lights,
    /// Reflections at most; 1 is direct light only.
    pub bounces: u32,
    /// Paths of each shaded point.
    pub samples: u32,
    /// Seed of the next picture: pictures of different seeds are independent.
    pub seed: AtomicU64,
}

/// A material of a [`PathStage`]: unbiased radiance with noise.
pub struct PathShader {
    /// The scene that paths are traced through.
    pub stage: Arc<PathStage>,
    /// The reflectance that paths start from; its base colour stays with the renderer.
    pub brdf: SharedBrdf,
}

impl PathStage {
    /// Calls `f` with the scene as the path tracer takes it.
    pub fn with_scene<R>(&self, f: impl FnOnce(&PathScene<'_>) -> R) -> R {
        let brdfs: Vec<SharedBrdf> = self.materials.iter().map(|m| m.0.clone()).collect();
        let tint = |hit: &Hit| {
            let slot = (hit.material as usize).min(self.materials.len().saturating_sub(1));
            match self.materials.get(slot).and_then(|m| m.1.as_ref()) {
                Some(texture) => texture.sample(hit.uv.x, hit.uv.y, 0.0).map(f64::from),
                None => [1.0; 3],
            }
        };
        f(&PathScene {
            mesh: &self.mesh,
            bvh: &self.bvh,
            materials: &brdfs,
            tint: Some(&tint),
            lights: &self.lights,
            offset: PathScene::OFFSET,
        })
    }
}

impl Shader for PathShader {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        task.check()?;
        let at = |v: &[&[f32]; 3], i: usize| DVec3::from_array(v.map(|c| f64::from(c[i])));
        let points: Vec<PathPoint<'_>> = (0..q.len())
            .map(|i| PathPoint {
                position: at(&q.p, i),
                frame: Frame::from_normal_tangent(at(&q.n, i).normalize(), at(&q.t, i)),
                wo: at(&q.wo, i).normalize(),
                brdf: &*self.brdf,
            })
            .collect();
        let Some(first) = points.first() else { return Ok(()) };
        // Batches of one picture have different random numbers.
        let place = first.position.to_array().map(f64::to_bits).into_iter();
        let seed = place.fold(self.stage.seed.load(Ordering::Relaxed), |h, x| {
            (h.rotate_left(23) ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        });
        let options = PathOptions { bounces: self.stage.bounces, samples: self.stage.samples, seed };
        let task = task.clone().without_progress();
        let estimates = self.stage.with_scene(|s| trace_points(s, &points, options, &task))?;
        for (i, e) in estimates.iter().enumerate() {
            (0..3).for_each(|c| out.rgb[c][i] = e.rgb[c] as f32);
        }
        Ok(())
    }
}
