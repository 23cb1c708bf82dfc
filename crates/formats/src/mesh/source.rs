//! Where bytes come from, and how many may be spent.

use crate::error::shortened;
use crate::image::read_bytes;
use crate::{FormatError, Limits};
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// Decoded bytes for each byte of a mesh file and of what it refers to: a scene of a thousand instances stays
/// below it.
const MAX_RATIO: u64 = 2000;

/// What any mesh may take, however short its file is.
const SMALL: u64 = 16 << 20;

/// Decompressed bytes for each byte of gzip: meshes come to about 10, smooth ones in text to 50.
const MAX_GZIP_RATIO: u64 = 200;

/// Notes that are kept; more are counted.
const MAX_NOTES: usize = 64;

/// A mesh file being read: its name for errors, the folder that it may refer to, and what is left to
/// allocate.
pub struct Source<'a> {
    path: &'a Path,
    folder: Option<&'a Path>,
    /// The limits of the whole read.
    pub limits: Limits,
    /// Bytes of the file and of what it refers to.
    read: u64,
    /// Bytes that were allocated.
    spent: u64,
    /// Other files that were read.
    files: Vec<PathBuf>,
    notes: Vec<String>,
    /// Notes beyond [`MAX_NOTES`].
    more_notes: usize,
}

impl<'a> Source<'a> {
    /// A file of `len` bytes. Beside the memory limit, a decoded mesh may hold [`MAX_RATIO`] times its bytes,
    /// so that a short file with large counts allocates little.
    pub fn new(path: &'a Path, folder: Option<&'a Path>, len: usize, limits: &Limits) -> Self {
        let (files, notes) = (Vec::new(), Vec::new());
        Self { path, folder, limits: *limits, read: len as u64, spent: 0, files, notes, more_notes: 0 }
    }

    /// Notes something that was left out or mended, once.
    pub fn note(&mut self, note: impl Into<String>) {
        let note = shortened(note.into());
        if self.notes.contains(&note) {
            return;
        }
        if self.notes.len() < MAX_NOTES { self.notes.push(note) } else { self.more_notes += 1 }
    }

    /// The other files that were read, each once.
    pub fn files(&mut self) -> Vec<PathBuf> {
        std::mem::take(&mut self.files)
    }

    /// The notes, which become those of the mesh.
    pub fn notes(self) -> Vec<String> {
        let mut notes = self.notes;
        if self.more_notes > 0 {
            notes.push(format!("and {} notes more", self.more_notes));
        }
        notes
    }

    /// The file is invalid.
    pub fn fault(&self, why: impl std::fmt::Display) -> FormatError {
        FormatError::invalid(self.path, why)
    }

    /// Can other files be read?
    pub fn has_folder(&self) -> bool {
        self.folder.is_some()
    }

    /// Announces an allocation of `count` items of `size` bytes.
    pub fn spend(&mut self, count: u64, size: usize) -> Result<(), FormatError> {
        match count.checked_mul(size as u64).filter(|n| *n <= self.left()) {
            Some(bytes) => {
                self.spent += bytes;
                Ok(())
            }
            None => Err(self.fault(format_args!(
                "{count} items of {size} bytes exceed the memory limit of {} MiB for {} bytes (`max-memory` raises it)",
                self.most() >> 20,
                self.read
            ))),
        }
    }

    /// Bytes that may be allocated in all.
    fn most(&self) -> u64 {
        let ratio = self.limits.max_ratio.min(MAX_RATIO);
        self.limits.decoded(self.read).min(self.read.saturating_mul(ratio).max(SMALL))
    }

    /// Bytes that may still be allocated.
    pub fn left(&self) -> u64 {
        self.most().saturating_sub(self.spent)
    }

    /// The content of a file that this one refers to, relative to its folder.
    pub fn read_reference(&mut self, reference: &str) -> Result<Vec<u8>, FormatError> {
        let relative =
            below(reference).map_err(|why| self.fault(format_args!("reference {reference:?}: {why}")))?;
        let Some(folder) = self.folder else {
            return Err(self.fault(format_args!("refers to another file, {reference:?}")));
        };
        let path = folder.join(relative);
        let root = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        if let (Ok(root), Ok(real)) = (root.canonicalize(), path.canonicalize())
            && !real.starts_with(&root)
        {
            return Err(
                self.fault(format_args!("reference {reference:?} leaves the file's folder by a link"))
            );
        }
        // Even where the bytes are not kept: a file that is named a thousand times is read a thousand times.
        if let Ok(found) = path.metadata()
            && found.is_file()
        {
            self.read = self.read.saturating_add(found.len());
            self.spend(found.len(), 1)?;
        }
        let bytes = read_bytes(&path, &self.limits)?;
        if !self.files.contains(&path) {
            self.files.push(path);
        }
        Ok(bytes)
    }
}

/// `reference` as a path that stays below its folder.
fn below(reference: &str) -> Result<PathBuf, &'static str> {
    if reference.is_empty() {
        return Err("is empty");
    }
    if reference.contains("://") || (reference.find(':').is_some_and(|i| i > 0) && !reference.contains('/')) {
        return Err("URLs and drives are not read");
    }
    let mut out = PathBuf::new();
    for component in Path::new(&reference.replace('\\', "/")).components() {
        match component {
            Component::Normal(c) => out.push(c),
            Component::CurDir => {}
            Component::ParentDir if out.pop() => {}
            _ => return Err("must stay below the file's own folder"),
        }
    }
    Ok(out)
}

/// Decompresses gzip within the limits of memory and ratio.
pub fn inflate(bytes: &[u8], path: &Path, limits: &Limits) -> Result<Vec<u8>, FormatError> {
    let ratio = limits.max_ratio.min(MAX_GZIP_RATIO);
    let max = limits.max_memory.min((bytes.len() as u64).saturating_mul(ratio));
    let mut out = Vec::new();
    flate2::read::MultiGzDecoder::new(bytes)
        .take(max.saturating_add(1))
        .read_to_end(&mut out)
        .map_err(|e| FormatError::invalid(path, format_args!("gzip: {e}")))?;
    if out.len() as u64 > max {
        return Err(FormatError::invalid(
            path,
            format_args!("decompresses to more than the allowed {max} bytes"),
        ));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_stay_below_their_folder() {
        for good in ["a.bin", "./a.bin", "t/a b.png", "t/../a.bin", "t\\a.png"] {
            assert!(below(good).is_ok(), "{good}");
        }
        for bad in
            ["", "/etc/passwd", "../a", "t/../../a", "http://x/y", "file:///x", "C:\\a.bin", "c:a", "..\\a"]
        {
            assert!(below(bad).is_err(), "{bad}");
        }
    }
}
