//! Texture containers by content: KTX2, KTX1 and DDS, read and written.

use crate::{
    FormatError, Limits, Supercompression, TexelFormat, TextureLevels, WriteReport, read_dds, read_ktx1,
    read_ktx2, write_dds, write_ktx1, write_ktx2_as,
};
use std::io::Read;
use std::path::Path;

/// A container of texture levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Container {
    /// Khronos texture 2.
    Ktx2,
    /// Khronos texture 1.
    Ktx1,
    /// DirectDraw surface.
    Dds,
}

/// How a file stores its texels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TexelStorage {
    /// Their format, such as rgba16f or rgb9e5.
    pub format: String,
    /// What the levels are compressed by as a whole.
    pub compression: Option<&'static str>,
}

/// Bytes that hold the header of every container.
const HEADER: u64 = 256;

impl Container {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ktx2 => "KTX2",
            Self::Ktx1 => "KTX1",
            Self::Dds => "DDS",
        }
    }

    /// How a file stores its texels, by its header.
    pub fn texels(self, path: &Path) -> Result<TexelStorage, FormatError> {
        let unreadable =
            |e: std::io::Error| FormatError::Unreadable { path: path.into(), why: e.to_string() };
        let (file, _) = steradian_base::open_file(path).map_err(unreadable)?;
        let mut head = Vec::new();
        file.take(HEADER).read_to_end(&mut head).map_err(unreadable)?;
        let texels = match self {
            Self::Ktx2 => crate::ktx2::texels(&head),
            Self::Ktx1 => crate::ktx1::texels(&head),
            Self::Dds => crate::dds::texels(&head),
        };
        texels.map_err(|why| FormatError::invalid(path, why))
    }

    /// Extensions of the containers.
    pub const EXTENSIONS: [&str; 3] = ["ktx2", "ktx", "dds"];

    /// By the first bytes of a file.
    pub fn of_file(path: &Path) -> Option<Self> {
        let mut head = [0u8; 7];
        steradian_base::open_file(path).and_then(|(mut f, _)| f.read_exact(&mut head)).ok()?;
        match &head {
            b"\xabKTX 20" => Some(Self::Ktx2),
            b"\xabKTX 11" => Some(Self::Ktx1),
            _ if head.starts_with(b"DDS ") => Some(Self::Dds),
            _ => None,
        }
    }

    /// By a file's extension.
    pub fn of_name(path: &Path) -> Option<Self> {
        match path.extension()?.to_string_lossy().to_lowercase().as_str() {
            "ktx2" => Some(Self::Ktx2),
            "ktx" => Some(Self::Ktx1),
            "dds" => Some(Self::Dds),
            _ => None,
        }
    }

    /// Reads a file.
    pub fn read(self, path: &Path, limits: &Limits) -> Result<TextureLevels, FormatError> {
        match self {
            Self::Ktx2 => read_ktx2(path, limits),
            Self::Ktx1 => read_ktx1(path, limits),
            Self::Dds => read_dds(path, limits),
        }
    }

    /// Writes a file; what its format cannot hold is counted.
    pub fn write(
        self,
        path: &Path,
        texture: &TextureLevels,
        format: TexelFormat,
    ) -> Result<WriteReport, FormatError> {
        match self {
            Self::Ktx2 => write_ktx2_as(path, texture, format, Supercompression::None),
            Self::Ktx1 => write_ktx1(path, texture, format),
            Self::Dds => write_dds(path, texture, format),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn containers_are_told_by_content() {
        let dir = tempfile::tempdir().unwrap();
        let t = TextureLevels {
            width: 2,
            height: 2,
            faces: 6,
            levels: vec![vec![0.5; 96]],
            metadata: Vec::new(),
        };
        for (name, container) in
            [("a.ktx2", Container::Ktx2), ("b.ktx", Container::Ktx1), ("c.dds", Container::Dds)]
        {
            let path = dir.path().join(name);
            assert_eq!(Container::of_name(&path), Some(container));
            container.write(&path, &t, TexelFormat::Rgba16f).unwrap();
            // The content decides, not the name.
            let other = dir.path().join("x");
            std::fs::rename(&path, &other).unwrap();
            assert_eq!(Container::of_file(&other), Some(container));
            assert_eq!(container.read(&other, &Limits::default()).unwrap().levels, t.levels);
            for format in TexelFormat::ALL {
                container.write(&path, &t, format).unwrap();
                let want = TexelStorage { format: format.name().into(), compression: None };
                assert_eq!(container.texels(&path).unwrap(), want, "{name}");
            }
        }
        let path = dir.path().join("z.ktx2");
        write_ktx2_as(&path, &t, TexelFormat::Rgb9e5, Supercompression::Zstd).unwrap();
        assert_eq!(Container::Ktx2.texels(&path).unwrap().compression, Some("Zstandard"));
        assert!(Container::Dds.texels(&path).is_err());
        assert_eq!(Container::of_file(&dir.path().join("none")), None);
    }
}
