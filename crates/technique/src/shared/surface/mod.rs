//! Properties that vary over a surface: bumps, a point's own lobe, data per texel.

pub mod bumps;
pub mod cosine_lobes;
pub mod kept;
pub mod lobe;
pub mod reflectance;
pub mod texels;
