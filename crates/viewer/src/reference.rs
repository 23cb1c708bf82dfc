//! The reference beside the window, refined pass by pass.

/// Of each pass: the part of the picture's width and height, and the relative error asked for at each point.
/// The last one is what `steradian compare` asks for where nothing else is said.
pub const STEPS: [(usize, f64); 4] = [(4, 0.1), (2, 0.05), (1, 0.02), (1, 5e-3)];
