//! Checks that come before every allocation.

use crate::{FormatError, Limits, TextureLevels};
use std::path::Path;

/// Decoded bytes for each byte of a file that need no other ground: photographs come to 4 … 20, textures of
/// few colours to 50.
const BACKED: u64 = 64;
/// Part of the memory limit that a file may fill whatever its size, such as a flat normal map: 512 MiB by
/// default, which an image of 8192 x 4096 pixels stays below and which is decoded within 2 s.
const UNBACKED_PART: u64 = 16;
/// Planes that an image comes to in use: a grey one becomes red, green and blue.
const COLOURS: u64 = 3;
/// What that part is at least.
const MIN_UNBACKED_BYTES: u64 = 64 << 20;

impl Limits {
    /// Bytes that a file of `file_bytes` may decode to within [`Limits::max_memory`]: much for a large file,
    /// little for a short one that claims to be large.
    pub(crate) fn decoded(&self, file_bytes: u64) -> u64 {
        let unbacked = (self.max_memory / UNBACKED_PART).max(MIN_UNBACKED_BYTES);
        self.max_memory.min(unbacked.max(file_bytes.saturating_mul(BACKED)))
    }

    /// May an image of `width`·`height` pixels, `planes` planes of f32, be decoded from `file_bytes` bytes?
    /// Gives the pixel count. Refuses empty images, sides and memory beyond the limits, and files that are so
    /// much smaller than what they claim to hold that they must be truncated or hostile.
    pub fn image(
        &self,
        path: &Path,
        width: u64,
        height: u64,
        planes: u64,
        file_bytes: u64,
    ) -> Result<usize, FormatError> {
        if width == 0 || height == 0 {
            return Err(FormatError::invalid(path, format!("the image is empty: {width} x {height} pixels")));
        }
        if width.max(height) > u64::from(self.max_side) {
            let why =
                format!("{width} x {height} pixels is beyond the limit of {} pixels a side", self.max_side);
            return Err(FormatError::invalid(path, why));
        }
        let pixels = width * height;
        let bytes = |planes: u64| u128::from(pixels) * u128::from(planes) * 4;
        self.memory(path, bytes(planes.max(1)), file_bytes)?;
        self.backed(path, bytes(planes.max(COLOURS)), file_bytes)?;
        usize::try_from(pixels).map_err(|_| FormatError::invalid(path, "too large for this machine"))
    }

    /// May a texture of the shape of `texture`, with `levels` mip levels, be decoded from `file_bytes` bytes?
    pub(crate) fn texture(
        &self,
        path: &Path,
        texture: &TextureLevels,
        levels: usize,
        file_bytes: u64,
    ) -> Result<(), FormatError> {
        let (width, height) = (texture.width as u64, texture.height as u64);
        self.image(path, width, height, 4, file_bytes)?;
        // All levels together are less than twice the first.
        let floats = u128::from(width) * u128::from(height) * texture.faces as u128 * 4 * 2;
        self.memory(path, floats * 4, file_bytes)?;
        if levels > TextureLevels::full_chain(texture.width, texture.height) {
            return Err(FormatError::invalid(path, format!("{levels} mip levels are too many for its size")));
        }
        Ok(())
    }

    /// May `bytes` be allocated to decode `file_bytes` bytes?
    pub fn memory(&self, path: &Path, bytes: u128, file_bytes: u64) -> Result<(), FormatError> {
        if bytes > u128::from(self.max_memory) {
            let why = format!(
                "decoding needs {} MiB, beyond the limit of {} MiB (`max-memory` raises it)",
                bytes >> 20,
                self.max_memory >> 20
            );
            return Err(FormatError::invalid(path, why));
        }
        if bytes > u128::from(self.max_ratio) * u128::from(file_bytes.max(1)) {
            let why = format!(
                "{file_bytes} bytes claim to hold {bytes} decoded bytes, more than {} times as many; \
                 the file is truncated or damaged",
                self.max_ratio
            );
            return Err(FormatError::invalid(path, why));
        }
        self.backed(path, bytes, file_bytes)
    }

    /// Is a file of `file_bytes` bytes long enough for `bytes` decoded ones?
    fn backed(&self, path: &Path, bytes: u128, file_bytes: u64) -> Result<(), FormatError> {
        let most = self.decoded(file_bytes);
        if bytes > u128::from(most) {
            let why = format!(
                "{file_bytes} bytes claim to hold {} MiB; more than {BACKED} times as many are decoded up to {} MiB alone \
                 (`max-memory` raises it)",
                bytes >> 20,
                most >> 20
            );
            return Err(FormatError::invalid(path, why));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_refused_before_they_are_allocated() {
        let (l, p) = (Limits::default(), Path::new("f"));
        assert_eq!(l.image(p, 4, 2, 3, 100).unwrap(), 8);
        let why = |w, h, n| l.image(p, w, h, 3, n).unwrap_err().to_string();
        assert!(why(0, 4, 9).contains("empty"));
        assert!(why(1 << 31, 1 << 31, 9).contains("65536 pixels a side"));
        assert!(why(1 << 16, 1 << 16, 1 << 40).contains("`max-memory`"));
        assert!(why(10_000, 10_000, 9).contains("truncated or damaged"));
        // A flat image of 8k is decoded, one of 20k only where the limit was raised.
        assert!(l.image(p, 8192, 4096, 3, 40_000).is_ok());
        // A grey image counts as the three colours that it becomes.
        assert!(l.image(p, 9000, 9000, 1, 97_000).is_err());
        assert!(why(20_000, 20_000, 430_000).contains("up to 512 MiB alone"));
        assert!(Limits { max_memory: 80 << 30, ..l }.image(p, 20_000, 20_000, 3, 430_000).is_ok());
    }
}
