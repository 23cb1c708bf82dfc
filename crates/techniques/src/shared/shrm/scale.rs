//! The factor by elevation that a fit leaves to shading: the albedo.

use crate::Part;
use crate::gpu::{Format, Level, Shape, Table};
use crate::shared::tables::texel_bytes;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};

/// Four numbers by the angle between n and wo: evenly spaced knots, linear between them, constant beyond.
#[derive(Debug, Clone, PartialEq)]
pub struct ScaleTable {
    first: f32,
    /// Intervals per radian.
    density: f32,
    knots: Vec<[f32; 4]>,
}

impl ScaleTable {
    /// 1 everywhere.
    pub fn one() -> Self {
        Self { first: 0.0, density: 1.0, knots: vec![[1.0; 4]; 2] }
    }

    /// Knots at evenly spaced angles; 1 everywhere for less than two.
    pub fn new(angles: &[f64], factor: impl Fn(usize) -> [f64; 3]) -> Self {
        let [first, .., last] = angles else { return Self::one() };
        let knots = (0..angles.len()).map(|i| {
            let [r, g, b] = factor(i).map(|f| f as f32);
            [r, g, b, 1.0]
        });
        let density = ((angles.len() - 1) as f64 / (last - first)) as f32;
        Self { first: *first as f32, density, knots: knots.collect() }
    }

    /// At n·wo in (0, 1].
    #[inline(always)]
    pub fn at(&self, cos_o: f32) -> [f32; 3] {
        let last = self.knots.len() - 1;
        let x = ((cos_o.acos() - self.first) * self.density).clamp(0.0, last as f32);
        let i = (x as usize).min(last - 1);
        let t = x - i as f32;
        let (a, b) = (self.knots[i], self.knots[i + 1]);
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
    }

    /// The first angle, and the range's inverse: `fetch_NAME((angle − x)·y)`.
    pub fn range(&self) -> [f32; 2] {
        [self.first, self.density / (self.knots.len() - 1) as f32]
    }

    /// As a GPU table.
    pub fn table(&self, name: &'static str) -> Table {
        let level =
            Level { width: self.knots.len(), height: 1, layers: 1, bytes: texel_bytes(self.knots.iter()) };
        Table { name, shape: Shape::Line, format: Format::Rgba32Float, level }
    }
}

impl Part for ScaleTable {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f32(to, format!("{prefix}.scale"), vec![self.knots.len(), 4], self.knots.concat());
        put_f32(to, format!("{prefix}.range"), vec![2], vec![self.first, self.density]);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.scale");
        let (shape, v) = get_f32(from, &name, 2)?;
        if shape[0] < 2 || shape[1] != 4 {
            return Err(PartError::Unexpected(name));
        }
        let knots = v.as_chunks::<4>().0.to_vec();
        let name = format!("{prefix}.range");
        match get_f32(from, &name, 1)?.1[..] {
            [first, density] if first.is_finite() && density.is_finite() => {
                Ok(Self { first, density, knots })
            }
            _ => Err(PartError::Unexpected(name)),
        }
    }

    fn bytes(&self) -> usize {
        16 * self.knots.len()
    }
}
