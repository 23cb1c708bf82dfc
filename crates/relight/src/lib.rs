//! Surfaces that are known texel by texel, under lights that move: what photographs under known lights, or a height field,
//! say of them. Plain data in and out; techniques and commands read it.

pub mod horizon;
pub mod polynomial;
