//! KTX2 textures (Khronos KTX File Format Specification 2.0): two-dimensional maps, arrays of them, and cube
//! maps, with mip levels, floats.
//!
//! Written: R32G32B32A32_SFLOAT, R16G16B16A16_SFLOAT, E5B9G9R9_UFLOAT_PACK32, B10G11R11_UFLOAT_PACK32 and
//! BC6H_UFLOAT and _SFLOAT blocks, as they are or with Zstandard or ZLIB supercompression; linear Rec. 709 in
//! the data format descriptor, `KTXorientation` rd and `KTXwriter`. Read: these, and 16- and 32-bit float
//! formats of one to three components. Refused: arrays of cubes, volumes, other block compression, BasisLZ.

mod array;
mod decode;
mod encode;

pub use array::{TextureArray, decode_ktx2_array, read_ktx2_array, write_ktx2_array};
pub(crate) use decode::{DAMAGED, key_values, texels};
pub use decode::{decode_ktx2, read_ktx2};
pub use encode::{Supercompression, write_ktx2, write_ktx2_as};
pub(crate) use encode::{check, check_levels};

const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";

/// Identifier, nine fields and the index.
const HEADER_BYTES: usize = 80;

/// Bytes of one entry of the level index.
const LEVEL_BYTES: usize = 24;

/// A texture of floats: one image or six cube faces, and its mip levels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TextureLevels {
    /// Width of level 0 in texels.
    pub width: usize,
    /// Height of level 0 in texels.
    pub height: usize,
    /// 1, or 6 for a cube: +X −X +Y −Y +Z −Z, as Vulkan has them.
    pub faces: usize,
    /// Level by level from the largest: `faces` images of rows from the top, R G B A interleaved.
    pub levels: Vec<Vec<f32>>,
    /// Keys and values.
    pub metadata: Vec<(String, String)>,
}

impl TextureLevels {
    /// Width and height of level `level`: halves, rounded down, at least 1.
    pub fn size(&self, level: usize) -> (usize, usize) {
        let half = |n: usize| n.checked_shr(level as u32).unwrap_or(0).max(1);
        (half(self.width), half(self.height))
    }

    /// Numbers that level `level` must have.
    pub fn level_len(&self, level: usize) -> usize {
        let (w, h) = self.size(level);
        self.faces * w * h * 4
    }

    /// The red, green and blue planes of level `level`, faces one below the other; empty where there is no
    /// such level.
    pub fn planes(&self, level: usize) -> [Vec<f32>; 3] {
        let texels = self.levels.get(level).map_or(&[][..], Vec::as_slice);
        std::array::from_fn(|c| texels.iter().skip(c).step_by(4).copied().collect())
    }

    /// The value of `key`.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.metadata.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    /// Levels down to 1 × 1.
    pub fn full_chain(width: usize, height: usize) -> usize {
        width.max(height).max(1).ilog2() as usize + 1
    }
}
