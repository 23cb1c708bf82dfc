//! Where radiance comes from.

use glam::DVec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use steradian_base::{Cancelled, Task};
use steradian_brdf::SharedBrdf;
use steradian_reference::{Judge, JudgePoint};
use steradian_sphere::Frame;
use steradian_techniques::direct::Direct;
use steradian_techniques::{AnyBake, Points, Radiance};

/// Outgoing radiance of batches of surface points.
pub trait Shader: Send + Sync {
    /// Writes the radiance of every point of `q`.
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled>;
}

/// A technique's bake.
pub struct BakeShader(pub Box<dyn AnyBake>);

impl Shader for BakeShader {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        task.check()?;
        self.0.shade(q, out);
        Ok(())
    }
}

/// A technique's bake, and lights that are shaded with the exact reflectance on top of it.
pub struct DirectShader {
    /// The bake.
    pub bake: Arc<BakeShader>,
    /// The lights.
    pub direct: Direct,
    /// The reflectance.
    pub brdf: SharedBrdf,
}

impl Shader for DirectShader {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        self.bake.shade(q, out, task)?;
        self.direct.add(&*self.brdf, q, out);
        Ok(())
    }
}

/// The judge: the integral itself, unshadowed, to a tolerance.
pub struct JudgeShader {
    /// The judge of the lights.
    pub judge: Arc<Judge>,
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// Relative error asked for at each point.
    pub tolerance: f64,
    /// Bits of the largest error so far; those of non-negative doubles grow with them.
    worst: AtomicU64,
}

impl JudgeShader {
    /// The judge's radiance of `brdf` to a relative error of `tolerance` at each point.
    pub fn new(judge: Arc<Judge>, brdf: SharedBrdf, tolerance: f64) -> Self {
        Self { judge, brdf, tolerance, worst: AtomicU64::new(0) }
    }

    /// The largest relative error that a point has been left with.
    pub fn worst(&self) -> f64 {
        f64::from_bits(self.worst.load(Ordering::Relaxed))
    }
}

impl Shader for JudgeShader {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        let at = |v: &[&[f32]; 3], i: usize| DVec3::from_array(v.map(|c| f64::from(c[i])));
        let points: Vec<JudgePoint> = (0..q.len())
            .map(|i| JudgePoint {
                frame: Frame::from_normal_tangent(at(&q.n, i).normalize(), at(&q.t, i)),
                wo: at(&q.wo, i).normalize(),
                position: (!q.p[0].is_empty()).then(|| at(&q.p, i)),
            })
            .collect();
        let estimates = self.judge.radiance_batch(&*self.brdf, &points, self.tolerance, task)?;
        for (i, e) in estimates.iter().enumerate() {
            (0..3).for_each(|c| out.rgb[c][i] = e.rgb[c] as f32);
            self.worst.fetch_max(e.error.abs().to_bits(), Ordering::Relaxed);
        }
        Ok(())
    }
}
