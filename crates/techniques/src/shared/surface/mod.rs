//! What varies over a surface: bumps, a point's own lobe, data per texel.

pub mod bumps;
pub mod lobe;
pub mod texels;
