//! Facts of a file of probes.

use super::bake::{TensorFacts, tensors};
use crate::{Error, Session};
use std::collections::BTreeMap;
use std::path::Path;
use steradian_light::Probes;

/// Facts of a light field.
#[derive(Debug)]
pub struct ProbesFacts {
    /// The field.
    pub field: Probes,
    /// Probes inside solids.
    pub inside: usize,
    /// Mean radiance over the sphere and over all probes.
    pub mean: [f64; 3],
    /// Share of the coefficients' energy by band, over all probes.
    pub energy: Vec<f64>,
    /// Tensors in the file.
    pub tensors: Vec<TensorFacts>,
    /// Metadata of the file.
    pub metadata: BTreeMap<String, String>,
}

impl Session {
    /// Facts of a file of probes; `None` where `path` is something else.
    pub fn inspect_probes(&mut self, path: &Path) -> Result<Option<ProbesFacts>, Error> {
        let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("safetensors"));
        if !named || !path.is_file() {
            return Ok(None);
        }
        let Some((field, file)) = self.probes_in(path)? else { return Ok(None) };
        let there: Vec<_> = field.light.iter().flatten().map(|p| &p.sh).collect();
        let n = there.len().max(1) as f64;
        let y00 = 0.5 / std::f64::consts::PI.sqrt();
        let mean = [0, 1, 2].map(|c| there.iter().map(|sh| sh.c[c][0] * y00).sum::<f64>() / n);
        let energy_of = |l: usize| {
            let band = |c: &Vec<f64>| c[l * l..(l + 1) * (l + 1)].iter().map(|x| x * x).sum::<f64>();
            there.iter().flat_map(|sh| &sh.c).map(band).sum::<f64>()
        };
        let energy: Vec<f64> = (0..field.bands()).map(energy_of).collect();
        let all: f64 = energy.iter().sum();
        let energy = energy.iter().map(|e| if all > 0.0 { e / all } else { 0.0 }).collect();
        Ok(Some(ProbesFacts {
            inside: field.light.len() - there.len(),
            mean,
            energy,
            tensors: tensors(&file),
            metadata: file.metadata,
            field,
        }))
    }
}
