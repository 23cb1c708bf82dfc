//! Surfaces described texel by texel, under moving lights: data from photographs under known lights, and
//! shadowing by bumps. Plain data in and out; techniques and commands read it.

pub mod btf;
pub mod height;
pub mod lobes;
pub mod polynomial;
