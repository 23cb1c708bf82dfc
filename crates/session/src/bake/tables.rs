//! The tables of a technique as array textures.

use steradian_formats::{TexelFormat, TextureArray};
use steradian_techniques::gpu::{Shape, Table};

/// A table on its way to a file.
pub struct Map {
    /// The technique's name of it.
    pub name: &'static str,
    /// Shape of the table, in the words of the shader's documentation.
    pub shape: String,
    /// The texels.
    pub array: TextureArray,
    /// Halves, unless they clip or lose too much.
    pub format: TexelFormat,
    /// Relative RMS error of the texels in that format.
    pub error: f64,
}

/// Largest relative RMS rounding error of 16-bit texels; beyond it texels are 32-bit floats. Halves stay
/// below it unless they underflow.
const ROUNDING: f64 = 5e-4;

impl Map {
    /// Texels of a table, in 16-bit floats where rounding permits.
    pub fn of(t: &Table) -> Self {
        let texels = expand(t);
        let (width, height, layers) = (t.level.width, t.level.height, t.level.layers);
        let halves = TexelFormat::Rgba16f.round_trip(&texels, (width, height));
        let error = relative_rms(&texels, &halves);
        let half = error <= ROUNDING;
        let array = TextureArray { width, height, layers, levels: vec![texels], metadata: Vec::new() };
        Self {
            name: t.name,
            shape: shape(&t.shape),
            array,
            format: if half { TexelFormat::Rgba16f } else { TexelFormat::Rgba32f },
            error: if half { error } else { 0.0 },
        }
    }

    /// Bytes of the texels in the file.
    pub fn bytes(&self) -> usize {
        self.array.width * self.array.height * self.array.layers * self.format.bytes()
    }
}

/// `EdgeCube`, `EdgeCubeChain([[x, y, size], …])`, `Plane`, …
fn shape(s: &Shape) -> String {
    format!("{s:?}")
}

/// R G B A; channels that the format lacks are 0, alpha 1.
fn expand(t: &Table) -> Vec<f32> {
    let (channels, values) = (t.channels(), t.numbers());
    if channels == 4 {
        return values;
    }
    values.chunks_exact(channels).flat_map(|c| [c[0], c[1], 0.0, 1.0]).collect()
}

/// Relative RMS difference over red, green and blue; alpha, which is often 1 throughout, is left out.
fn relative_rms(a: &[f32], b: &[f32]) -> f64 {
    let (mut d2, mut a2) = (0.0, 0.0);
    for (x, y) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        for c in 0..3 {
            d2 += (f64::from(x[c]) - f64::from(y[c])).powi(2);
            a2 += f64::from(x[c]).powi(2);
        }
    }
    if d2 == 0.0 { 0.0 } else { (d2 / a2).sqrt() }
}
