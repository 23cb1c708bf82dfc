//! Tables as parts and as GPU data.

pub mod aligned;
pub mod bundle;
pub mod chain;
pub mod grid;
pub mod hemisphere;

use crate::gpu::{Format, Level, Shape, Table};
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use steradian_prefilter::EdgeCube;

/// Writes a cube as a tensor [6, size + 1, size + 1, 3].
pub fn save_cube(cube: &EdgeCube, to: &mut TensorFile, name: String) {
    let n = cube.size() + 1;
    let data = cube.texels().iter().flat_map(|t| [t[0], t[1], t[2]]).collect();
    put_f32(to, name, vec![6, n, n, 3], data);
}

/// Reads a cube that [`save_cube`] wrote.
pub fn load_cube(from: &TensorFile, name: &str) -> Result<EdgeCube, PartError> {
    let bad = || PartError::Unexpected(name.into());
    let (shape, v) = get_f32(from, name, 4)?;
    let size = shape[1].checked_sub(1).ok_or_else(bad)?;
    if shape != [6, size + 1, size + 1, 3] {
        return Err(bad());
    }
    let texels = v.chunks_exact(3).map(|t| [t[0], t[1], t[2], 1.0]).collect();
    EdgeCube::from_texels(size, texels).ok_or_else(bad)
}

/// Bytes of a cube's texels.
pub fn cube_bytes(cube: &EdgeCube) -> usize {
    16 * cube.texels().len()
}

/// A cube as a GPU table.
pub fn cube_table(name: &'static str, cube: &EdgeCube) -> Table {
    let n = cube.size() + 1;
    let level = Level { width: n, height: n, layers: 6, bytes: texel_bytes(cube.texels().iter()) };
    Table { name, shape: Shape::EdgeCube, format: Format::Rgba32Float, level }
}

/// Little-endian bytes of texels.
pub fn texel_bytes<'a>(texels: impl Iterator<Item = &'a [f32; 4]>) -> Vec<u8> {
    texels.flatten().flat_map(|x| x.to_le_bytes()).collect()
}
