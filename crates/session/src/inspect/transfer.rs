//! Facts of a file of transfer.

use super::bake::{TensorFacts, tensors};
use crate::{Error, Session};
use std::collections::BTreeMap;
use std::path::Path;
use steradian_transfer::Saved;

/// Facts of a file of transfer.
#[derive(Debug)]
pub struct TransferFacts {
    /// Transfer and the inputs that it was made from.
    pub saved: Saved,
    /// Mean of ambient occlusion over all sites.
    pub mean_ao: f64,
    /// Largest estimated errors of a site's transfer vector and of its visibility.
    pub worst: [f64; 2],
    /// RMS over all sites of the estimated error of transfer vectors.
    pub rms: f64,
    /// Tensors in the file.
    pub tensors: Vec<TensorFacts>,
    /// Metadata of the file.
    pub metadata: BTreeMap<String, String>,
}

impl Session {
    /// Facts of a file of transfer; `None` where `path` is something else.
    pub fn inspect_transfer(&mut self, path: &Path) -> Result<Option<TransferFacts>, Error> {
        let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("safetensors"));
        if !named || !path.is_file() {
            return Ok(None);
        }
        let Some((saved, file)) = self.saved_transfer(path)? else { return Ok(None) };
        let x = &saved.transfer;
        let sites = x.len().max(1) as f64;
        let mean_ao = x.ao.iter().map(|a| f64::from(*a)).sum::<f64>() / sites;
        let rms = (x.error.iter().map(|e| f64::from(e[0]).powi(2)).sum::<f64>() / sites).sqrt();
        let worst = x.worst_error();
        Ok(Some(TransferFacts {
            mean_ao,
            worst,
            rms,
            tensors: tensors(&file),
            metadata: file.metadata,
            saved,
        }))
    }
}
