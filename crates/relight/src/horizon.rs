//! Horizons of height fields.
