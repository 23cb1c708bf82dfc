//! Sample / pdf / invert triples on the sphere.
