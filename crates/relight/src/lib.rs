//! Surfaces that are known texel by texel, under lights that move: what photographs under known lights say of
//! them, and what bumps hide. Plain data in and out; techniques and commands read it.

pub mod btf;
pub mod height;
pub mod lobes;
pub mod polynomial;
