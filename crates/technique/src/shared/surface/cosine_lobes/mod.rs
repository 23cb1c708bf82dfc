//! Generalised cosine lobes whose parameters differ from texel to texel, stored as small integers.
//!
//! C and n do not average under a footprint. What is averaged are C, |C|² and 1/n, the lobe's variance across
//! its axis, weighed with the largest value ρ max|C|ⁿ of each texel's lobe, about axes of max|C| = 1, so that
//! texels without a lobe have no say: the length of C is the root of the mean of |C|², its direction that of
//! the mean, and what the directions scatter, 1 − |E\[C\]|²/E\[|C|²\], half of it each way, adds to 1/n, with
//! ρ scaled so that the lobe keeps its integral ([`Averages`]).
//!
//! Each texel of each level is stored as the lobe of its averages, in integers of one to three bytes between
//! the least and the largest value of a number over all texels (`packed`), so that numbers alike everywhere
//! are exact; a lookup decodes the texels around it and averages these (McAllister, Lastra & Heidrich 2002
//! store 8 bits a number). `lookup.wgsl` has the same functions, and `shader` writes the decoding of a
//! layout.

mod averages;
mod packed;
mod saved;
mod shader;

pub use averages::Averages;
pub use packed::{CosineLobes, Storage, Widths};
pub use shader::CosineText;

use crate::local::{Content, Plane};
use steradian_brdf::model::lafortune::Lafortune;
use steradian_brdf::{Brdf, Form};

/// Most lobes.
pub const MOST: usize = 4;
/// Averages of a lobe: its largest value, and times that C in x, in y, in z, 1/n and |C|², each for red,
/// green and blue.
const LAYERS: usize = 6;
/// Least exponent, since 1/n is averaged.
pub const LEAST: f64 = 1e-3;
/// Relative RMS error of f ⟨n·wi⟩ that the integers may have where the user gives no tolerance.
pub const TOLERANCE: f64 = 0.01;
/// Largest factor of a texel.
const MOST_FACTOR: f32 = 1e30;

/// The images of the lobes' parameters: factors as colours, C as red, green and blue, exponents as numbers.
pub const PLANES: [Plane; 7] = [
    Plane::new("rho_d", Content::Colours).within(0.0, MOST_FACTOR, 3),
    Plane::new("rho_1", Content::Colours).within(0.0, MOST_FACTOR, 3),
    Plane::new("c_1", Content::Numbers),
    Plane::new("n_1", Content::Numbers).within(LEAST as f32, 1e8, 3),
    Plane::new("rho_2", Content::Colours).within(0.0, MOST_FACTOR, 3),
    Plane::new("c_2", Content::Numbers),
    Plane::new("n_2", Content::Numbers).within(LEAST as f32, 1e8, 3),
];

/// A lobe of a point, for red, green and blue.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lobe {
    /// Factor.
    pub rho: [f32; 3],
    /// The components of C in x, y and z.
    pub c: [[f32; 3]; 3],
    /// Exponent.
    pub n: [f32; 3],
}

/// The reflectance of a point.
#[derive(Debug, Clone, Copy, Default)]
pub struct Texel {
    /// ρ_d/π.
    pub rho_d: [f32; 3],
    /// The point's lobes, then unused ones of factor 0.
    pub lobes: [Lobe; MOST],
}

impl Texel {
    /// f ⟨n·wi⟩ of the first `count` lobes and the diffuse part, in the local frame.
    #[inline(always)]
    pub fn f_cos(&self, count: usize, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        let v = [wi[0] * wo[0], wi[1] * wo[1], wi[2] * wo[2]];
        let mut f = self.rho_d;
        for lobe in self.lobes.iter().take(count) {
            for c in 0..3 {
                let cosine = lobe.c[0][c] * v[0] + lobe.c[1][c] * v[1] + lobe.c[2][c] * v[2];
                if cosine > 0.0 {
                    f[c] += lobe.rho[c] * cosine.powf(lobe.n[c]);
                }
            }
        }
        // False for NaN too.
        if wi[2] > 0.0 { f.map(|f| (f * wi[2]).min(f32::MAX)) } else { [0.0; 3] }
    }
}

/// The lobes of a reflectance whose parameters images may replace: its own, or none for a Lambertian one;
/// `None` for any other reflectance.
pub fn lobes_of(brdf: &dyn Brdf) -> Option<Lafortune> {
    match brdf.form() {
        Form::Lafortune(own) => Some(own),
        Form::Lambert { albedo } => Some(Lafortune { spec: brdf.spec(), kd: albedo, lobes: Vec::new() }),
        _ => None,
    }
}
