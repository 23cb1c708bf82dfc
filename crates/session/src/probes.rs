//! Light fields: captured in a scene by paths, kept in files, and shaded by.

mod capture;
mod kept;
mod shade;

pub(crate) use shade::{has_no_light, refuse};

pub use capture::{Captured, Request, Where};

use crate::{Error, Session};
use std::path::Path;
use steradian_formats::{TensorFile, read_tensors, write_tensors};
use steradian_light::Probes;

impl Session {
    /// Writes a light field with its provenance, and removes the data kept for resuming after an
    /// interruption.
    pub fn write_probes(&self, done: Captured, path: &Path) -> Result<(), Error> {
        self.check()?;
        let mut file = done.field.tensors();
        file.metadata.extend(self.provenance_pairs());
        write_tensors(path, &file)?;
        done.store.map_or(Ok(()), |s| Ok(s.finish()?))
    }

    /// The light field of a file.
    pub fn probes(&mut self, path: &Path) -> Result<Probes, Error> {
        let file = read_tensors(path, &self.limits())?;
        self.note_input(path);
        read(&file, path)
    }

    /// A light field with the file that holds it; `None` where the file holds something else.
    pub(crate) fn probes_in(&mut self, path: &Path) -> Result<Option<(Probes, TensorFile)>, Error> {
        let file = read_tensors(path, &self.limits())?;
        if !Probes::is_one(&file) {
            return Ok(None);
        }
        self.note_input(path);
        Ok(Some((read(&file, path)?, file)))
    }
}

fn read(file: &TensorFile, path: &Path) -> Result<Probes, Error> {
    Probes::read(file).map_err(|e| Error::input(format!("{}: {e}", path.display())))
}
