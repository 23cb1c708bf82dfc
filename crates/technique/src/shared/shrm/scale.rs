//! The factor by elevation ([`ScaleTable`]) in files and on GPUs.

use crate::Part;
use crate::gpu::{Format, Level, Shape, Table};
use crate::shared::tables::texel_bytes;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
pub use steradian_prefilter::shrm::choice::ScaleTable;

/// The factor as a GPU table.
pub fn table(scale: &ScaleTable, name: &'static str) -> Table {
    let (_, knots) = scale.parts();
    let level = Level { width: knots.len(), height: 1, layers: 1, bytes: texel_bytes(knots.iter()) };
    Table { name, shape: Shape::Line, format: Format::Rgba32Float, level }
}

impl Part for ScaleTable {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let (range, knots) = self.parts();
        put_f32(to, format!("{prefix}.scale"), vec![knots.len(), 4], knots.concat());
        put_f32(to, format!("{prefix}.range"), vec![2], range.to_vec());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.scale");
        let (shape, v) = get_f32(from, &name, 2)?;
        if shape[0] < 2 || shape[1] != 4 {
            return Err(PartError::Unexpected(name));
        }
        let name = format!("{prefix}.range");
        let range = get_f32(from, &name, 1)?.1;
        let range = <[f32; 2]>::try_from(range).ok();
        let table = range.and_then(|r| Self::from_parts(r, v.as_chunks::<4>().0.to_vec()));
        table.ok_or(PartError::Unexpected(name))
    }

    fn bytes(&self) -> usize {
        16 * self.parts().1.len()
    }
}
