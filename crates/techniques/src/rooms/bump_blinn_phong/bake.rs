//! Normals with their moments, and the model's parameters.

use crate::local::FileName;
use crate::shared::surface::bumps::{self, Bumps};
use crate::shared::surface::texels::TextureLayers;
use crate::{BakeError, Material};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::{ParamInfo, params};
use steradian_brdf::Form;
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
        /// Shadowing by the horizon of the unbumped surface, an index of the choices.
        pub self_shadow: usize = ParamInfo::choice("self_shadow", &["step", "ramp"], "the light at the surface's own horizon: a step, or Kilgard's ramp min(1, 8 n·l)").numbered(0.0),
        /// Widening of the highlight by the normals under a footprint, an index of the choices.
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
    pub texels: TextureLayers,
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
        Some(b) => TextureLayers::new(vec![Arc::new(b.map.mean().clone()), Arc::new(b.map.spread().clone())]),
        None => {
            TextureLayers::new([[0.0, 0.0, 1.0], [0.0; 3]].map(|c| Arc::new(Texture::constant(c))).into())
        }
    };
    Ok(Bumped { kd, ks, n, ramp: p.self_shadow == 1, filter: p.filter, bumps, texels })
}

impl Bumped {
    /// The equation with the normal `n`.
    pub(super) fn exact(&self, n: DVec3, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 || wo.z <= 0.0 || n.dot(wi) <= 0.0 {
            return [0.0; 3];
        }
        let s = if self.ramp { (8.0 * wi.z).min(1.0) } else { 1.0 };
        let h = (wi + wo).normalize_or(n);
        let sine = n.cross(h).length_squared().min(1.0);
        let power = if n.dot(h) > 0.0 { (0.5 * self.n * (-sine).ln_1p()).exp() } else { 0.0 };
        std::array::from_fn(|c| s * (self.kd[c] / PI * n.dot(wi) + self.ks[c] * power))
    }

    pub(super) fn normal(&self, texel: [usize; 2]) -> DVec3 {
        self.bumps.as_ref().map_or(DVec3::Z, |b| b.normal(texel))
    }
}
