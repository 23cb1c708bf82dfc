//! Polynomial texture maps from photographs under known lights.
