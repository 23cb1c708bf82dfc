//! What varies over a surface beside its base colour: normals and roughness.

use crate::{NormalMap, Texture};
use std::sync::Arc;

/// How the normals under a sample are taken into account.
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

/// The maps of a surface.
#[derive(Debug, Clone, Default)]
pub struct Maps {
    /// Normals.
    pub normal: Option<Arc<NormalMap>>,
    /// alpha² in every channel, in place of the material's: variances of slopes are what averages linearly.
    pub alpha2: Option<Arc<Texture>>,
    /// How normals are filtered.
    pub filtering: NormalFiltering,
}

impl Maps {
    /// Does nothing vary?
    pub fn is_empty(&self) -> bool {
        self.normal.is_none() && self.alpha2.is_none()
    }

    /// Are the normals under a sample more than their mean?
    pub fn filters(&self) -> bool {
        self.normal.is_some() && self.filtering != NormalFiltering::None
    }
}

/// A map of alpha² from perceptual roughness: alpha = (factor · r)², at least `least`. `None` where the plane is
/// empty or too short.
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
