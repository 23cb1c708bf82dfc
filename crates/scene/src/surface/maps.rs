//! Maps that vary over a surface: normals, roughness, colours of the reflectance, emitted light.

use super::{NormalMap, Texture};
use std::sync::Arc;

/// Use of the normals under a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NormalFiltering {
    /// Their mean alone, as usual: highlights of distant bumps alias or become too sharp.
    None,
    /// They widen the lobe: alpha'² = alpha² + 2σ² (Olano & Baker 2010), σ² their mean variance.
    Isotropic,
    /// Lookups along several of them, as their covariance spreads the reflection (Schilling 1997).
    #[default]
    Covariance,
}

impl NormalFiltering {
    /// All, with their names.
    pub const ALL: [(&'static str, Self); 3] =
        [("none", Self::None), ("isotropic", Self::Isotropic), ("covariance", Self::Covariance)];

    /// The one of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|a| a.0 == name).map(|a| a.1)
    }
}

/// The maps of a surface, except the textures that multiply its radiance.
#[derive(Debug, Clone, Default)]
pub struct SurfaceMaps {
    /// Normals.
    pub normal: Option<Arc<NormalMap>>,
    /// alpha² in every channel, in place of the material's: variances of slopes average linearly.
    pub alpha2: Option<Arc<Texture>>,
    /// Albedo and f0 in place of the material's.
    pub colours: Option<Colours>,
    /// Radiance that the surface emits, W sr⁻¹ m⁻².
    pub emission: Option<Arc<Texture>>,
    /// Filtering of the normals.
    pub filtering: NormalFiltering,
}

/// The colours of a reflectance with a diffuse and a specular part. Radiance is linear in each of them, so
/// that they may be averaged over a footprint.
#[derive(Debug, Clone)]
pub struct Colours {
    /// Albedo of the diffuse part.
    pub albedo: Arc<Texture>,
    /// Reflectance of the specular part at normal incidence.
    pub f0: Arc<Texture>,
}

impl Colours {
    /// The colours of glTF 2.0 (B.2) by base colour and metalness of the same texels: albedo = (1 − m) c,
    /// f0 = (1 − m) `dielectric` + m c.
    pub fn metallic(base: &Texture, metallic: &Texture, dielectric: [f32; 3]) -> Self {
        let mix = |f: &dyn Fn(f32, f32, f32) -> f32| {
            let texel = |c: [f32; 3], m: [f32; 3]| {
                std::array::from_fn(|k| f(c[k], m[k].clamp(0.0, 1.0), dielectric[k]))
            };
            Arc::new(base.joined(metallic, texel))
        };
        Self { albedo: mix(&|c, m, _| (1.0 - m) * c), f0: mix(&|c, m, f0| (1.0 - m) * f0 + m * c) }
    }
}

impl SurfaceMaps {
    /// Is every point's reflectance the same, about the mesh's own normals?
    pub fn is_empty(&self) -> bool {
        self.normal.is_none() && self.alpha2.is_none() && self.colours.is_none()
    }

    /// Are the normals under a sample more than their mean?
    pub fn filters(&self) -> bool {
        self.normal.is_some() && self.filtering != NormalFiltering::None
    }
}

/// A map of alpha² from perceptual roughness: alpha = (factor · r)², at least `least`. `None` where the plane
/// is empty or too short.
pub fn alpha2(
    width: usize,
    height: usize,
    perceptual_roughness: &[f32],
    factor: f32,
    least: f32,
) -> Option<Texture> {
    let plane: Vec<f32> = perceptual_roughness
        .iter()
        .map(|r| {
            let alpha = (factor * r).powi(2).clamp(least, 1.0);
            alpha * alpha
        })
        .collect();
    Texture::new(width, height, &[plane.clone(), plane.clone(), plane])
}
