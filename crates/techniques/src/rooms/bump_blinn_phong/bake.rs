//! Normals with their moments, and the numbers of the model.

use super::shade;
use crate::local::{FileName, Place, error_at, texel, texel_at};
use crate::shared::surface::bumps::{self, Bumps};
use crate::shared::surface::texels::Texels;
use crate::{BakeError, Material};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::{ParamInfo, params};
use steradian_brdf::{Brdf, Form};
use steradian_scene::surface::Texture;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// The height map.
        pub height: Option<FileName> = bumps::HEIGHT_FILE,
        /// The normal map.
        pub normal: Option<FileName> = bumps::NORMAL_FILE,
        /// Height of white.
        pub relief: f64 = bumps::RELIEF,
        /// How the surface's own horizon shadows.
        pub self_shadow: usize = ParamInfo::choice("self_shadow", &["step", "ramp"], "the light at the surface's own horizon: a step, or Kilgard's ramp min(1, 8 n·l)").numbered(0.0),
        /// How normals under a footprint widen the highlight.
        pub filter: usize = ParamInfo::choice("filter", &["covariance", "toksvig", "mean"], "how the normals under a sample widen the highlight").numbered(0.0),
    }
}

/// The ways of [`Params::filter`].
pub const TOKSVIG: usize = 1;
/// See [`TOKSVIG`].
pub const MEAN: usize = 2;

/// A bumpy surface.
#[derive(Debug, Clone)]
pub struct Bumped {
    pub kd: [f64; 3],
    pub ks: [f64; 3],
    pub n: f64,
    pub ramp: bool,
    pub filter: usize,
    pub bumps: Option<Bumps>,
    /// Mean normals, and their covariances.
    pub texels: Texels,
}

pub(super) fn bake(m: &Material, p: &Params) -> Result<Bumped, BakeError> {
    let slug = "bump_blinn_phong";
    let (kd, ks, n) = match m.brdf.form() {
        Form::BlinnPhongGl { kd, ks, n } => (kd, ks, n),
        Form::Lambert { albedo } => (albedo, [0.0; 3], 1.0),
        _ => return Err(BakeError::Material { slug, why: "takes blinn-phong-gl and lambert only".into() }),
    };
    let bumps = Bumps::of(slug, m, p.relief)?;
    let texels = match &bumps {
        Some(b) => Texels::new(vec![Arc::new(b.map.mean().clone()), Arc::new(b.map.spread().clone())]),
        None => Texels::new([[0.0, 0.0, 1.0], [0.0; 3]].map(|c| Arc::new(Texture::constant(c))).into()),
    };
    Ok(Bumped { kd, ks, n, ramp: p.self_shadow == 1, filter: p.filter, bumps, texels })
}

impl Bumped {
    /// The equation with the normal `n`.
    fn exact(&self, n: DVec3, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 || wo.z <= 0.0 || n.dot(wi) <= 0.0 {
            return [0.0; 3];
        }
        let s = if self.ramp { (8.0 * wi.z).min(1.0) } else { 1.0 };
        let h = (wi + wo).normalize_or(n);
        let sine = n.cross(h).length_squared().min(1.0);
        let power = if n.dot(h) > 0.0 { (0.5 * self.n * (-sine).ln_1p()).exp() } else { 0.0 };
        std::array::from_fn(|c| s * (self.kd[c] / PI * n.dot(wi) + self.ks[c] * power))
    }

    fn normal(&self, texel: [usize; 2]) -> DVec3 {
        self.bumps.as_ref().map_or(DVec3::Z, |b| b.normal(texel))
    }
}

fn shaded(t: &Bumped, at: Place, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    shade::f_cos(t, &shade::texel(t, at), wi, wo)
}

/// Against the equation at the texels themselves.
pub(super) fn error(t: &Bumped, m: &Material) -> f64 {
    let brdf: &dyn Brdf = &*m.brdf;
    let size = t.texels.size();
    let exact = |at: Place, wi, wo| t.exact(t.normal(texel_at(at, size)), wi, wo);
    error_at(brdf, |k| texel(k, size).0, exact, |at, wi, wo| shaded(t, at, wi, wo))
}

/// Texels of a side of the blocks whose means are tried.
const BLOCK: usize = 4;

/// Relative RMS error of samples that cover 4 × 4 texels against the mean of these: what filtering costs.
pub(super) fn details(t: &Bumped) -> Vec<(&'static str, f64)> {
    let size = t.texels.size();
    if t.bumps.is_none() || size.0 < BLOCK || size.1 < BLOCK {
        return Vec::new();
    }
    let (mut squares, mut energy) = (0.0, 0.0);
    for k in 0..1024u32 {
        let (_, [i, j]) = texel(k, size);
        let [i, j] = [i / BLOCK * BLOCK, j / BLOCK * BLOCK];
        if i + BLOCK > size.0 || j + BLOCK > size.1 {
            continue;
        }
        // Light and view up to 60 degrees off the normal.
        let direction = |a: f64, b: f64| {
            let (z, phi) = (0.5 + 0.5 * (f64::from(k) * a).fract(), f64::from(k) * b);
            let s = (1.0f64 - z * z).sqrt();
            DVec3::new(s * phi.cos(), s * phi.sin(), z)
        };
        let (wi, wo) = (direction(0.618_034, 2.4), direction(0.754_878, 3.7));
        let all = (0..BLOCK * BLOCK).map(|m| t.exact(t.normal([i + m % BLOCK, j + m / BLOCK]), wi, wo));
        let mut mean = [0.0; 3];
        all.for_each(|x| (0..3).for_each(|c| mean[c] += x[c] / (BLOCK * BLOCK) as f64));
        let half = 0.5 * BLOCK as f32;
        let uv = [(i as f32 + half) / size.0 as f32, (j as f32 + half) / size.1 as f32];
        let footprint = BLOCK as f32 / size.0.max(size.1) as f32;
        let got = shaded(t, Place { uv, footprint }, wi.as_vec3().to_array(), wo.as_vec3().to_array());
        for c in 0..3 {
            squares += (f64::from(got[c]) - mean[c]).powi(2);
            energy += mean[c] * mean[c];
        }
    }
    if energy > 0.0 { vec![("error over 4 x 4 texels", (squares / energy).sqrt())] } else { Vec::new() }
}
