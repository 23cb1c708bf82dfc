//! Textures whose texels are encoded: one encoding serves the file and the question what it changed.

use crate::ktx2::{check, check_levels};
use crate::texel::TexelFormat;
use crate::{FormatError, TextureLevels, WriteReport};
use std::path::Path;

/// A texture in a texel format, as containers hold it.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredTexture {
    pub(crate) format: TexelFormat,
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) faces: usize,
    /// Level by level the bytes of all faces.
    pub(crate) levels: Vec<Vec<u8>>,
    reports: Vec<WriteReport>,
    /// Keys and values.
    pub metadata: Vec<(String, String)>,
}

impl StoredTexture {
    /// Encodes `texture` in `format`; what does not fit is counted. Textures that are not whole, and values
    /// that are not finite, are refused; `path` is for that message.
    pub fn new(path: &Path, texture: &TextureLevels, format: TexelFormat) -> Result<Self, FormatError> {
        check(texture).map_err(|why| FormatError::Unwritable { path: path.into(), why })?;
        Ok(Self::encode(texture, format))
    }

    /// [`Self::new`] for any number of faces.
    pub(crate) fn of_layers(
        path: &Path,
        texture: &TextureLevels,
        format: TexelFormat,
    ) -> Result<Self, FormatError> {
        check_levels(texture).map_err(|why| FormatError::Unwritable { path: path.into(), why })?;
        Ok(Self::encode(texture, format))
    }

    pub(crate) fn encode(t: &TextureLevels, format: TexelFormat) -> Self {
        let (mut levels, mut reports) = (Vec::new(), Vec::new());
        for (i, level) in t.levels.iter().enumerate() {
            let (mut bytes, mut report) = (Vec::new(), WriteReport::default());
            format.encode(level, t.size(i), &mut bytes, &mut report);
            levels.push(bytes);
            reports.push(report);
        }
        let metadata = t.metadata.clone();
        Self { format, width: t.width, height: t.height, faces: t.faces, levels, reports, metadata }
    }

    /// Width and height of level `level`: halves, rounded down, at least 1.
    pub fn size(&self, level: usize) -> (usize, usize) {
        let half = |n: usize| n.checked_shr(level as u32).unwrap_or(0).max(1);
        (half(self.width), half(self.height))
    }

    /// Level `level` as it is read from a file: `faces` images, R G B A interleaved; `None` beyond the last.
    pub fn level(&self, level: usize) -> Option<Vec<f32>> {
        Some(self.format.decode(self.levels.get(level)?, self.size(level)))
    }

    /// Keeps the first `levels` levels.
    pub fn truncate(&mut self, levels: usize) {
        self.levels.truncate(levels);
        self.reports.truncate(levels);
    }

    /// What the format could not hold.
    pub fn report(&self) -> WriteReport {
        self.reports.iter().fold(WriteReport::default(), |mut all, r| {
            all.merge(*r);
            all
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Limits, Supercompression, read_dds, read_ktx1, read_ktx2};

    #[test]
    fn what_it_says_is_what_every_container_holds() {
        let dir = tempfile::tempdir().unwrap();
        let mut t = TextureLevels { width: 8, height: 8, faces: 6, ..TextureLevels::default() };
        for level in 0..3 {
            let value = |i: usize| if i % 4 == 3 { 1.0 } else { 0.3 + (i % 97) as f32 * 0.71 };
            t.levels.push((0..t.level_len(level)).map(value).collect());
        }
        t.levels[1][4] = 1e9;
        for format in TexelFormat::ALL {
            let stored = StoredTexture::new(Path::new("t"), &t, format).unwrap();
            let path = |name: &str| dir.path().join(name);
            let reports = [
                stored.write_ktx2(&path("a"), Supercompression::Zstd).unwrap(),
                stored.write_ktx1(&path("b")).unwrap(),
                stored.write_dds(&path("c")).unwrap(),
            ];
            let limits = Limits::default();
            let back = [
                read_ktx2(&path("a"), &limits).unwrap(),
                read_ktx1(&path("b"), &limits).unwrap(),
                read_dds(&path("c"), &limits).unwrap(),
            ];
            for (texture, report) in back.iter().zip(reports) {
                for level in 0..3 {
                    assert_eq!(texture.levels.get(level), stored.level(level).as_ref(), "{format:?} {level}");
                }
                assert_eq!(report, stored.report());
                assert_eq!(report.clipped, u64::from(format != TexelFormat::Rgba32f), "{format:?}");
            }
            assert_eq!(stored.level(3), None);
            let mut first = stored.clone();
            first.truncate(1);
            assert_eq!((first.report().clipped, first.level(1)), (0, None));
        }
        t.levels[2][0] = f32::NAN;
        let why = StoredTexture::new(Path::new("t.ktx2"), &t, TexelFormat::Rgba16f).unwrap_err().to_string();
        assert!(why.contains("t.ktx2") && why.contains("level 2"), "{why}");
    }
}
