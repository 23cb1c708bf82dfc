//! Tables of a fit over the view, for the levels of a chain.

use super::params::MAX_TAPS;
use crate::Part;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use steradian_brdf::fit::gaussian::MAX_LOBES;

/// Values that shading reads for a view, by θ_o from 0 to [`LAST`], lobe after lobe; where reflectance is
/// anisotropic each row goes once around by the azimuth of the view.
#[derive(Debug, Clone, PartialEq)]
pub struct Views {
    /// Angle of the mean, level of the chain, standard deviation of the angles at which it is looked up,
    /// their number; of anisotropic reflectance the mean's angles in the plane of incidence and out of it,
    /// level and number.
    pub means: Vec<[f32; 4]>,
    /// For anisotropic reflectance the square of that deviation, times cosine and sine of twice the angle
    /// from the plane to the sweep; 0, 0.
    pub sweeps: Vec<[f32; 4]>,
    /// Columns of a row: 1, or those by the azimuth.
    pub columns: usize,
    /// Weights, 0.
    pub weights: Vec<[f32; 4]>,
    /// A_1, A_2, A_3 of the Gaussian that is looked up, 0; empty where visibility is not convolved with it.
    pub zonal: Vec<[f32; 4]>,
    /// Lobes.
    pub lobes: usize,
    /// ρ_d.
    pub diffuse: [f32; 3],
}

impl Views {
    /// Views of each lobe.
    pub fn count(&self) -> usize {
        self.means.len() / self.lobes
    }

    /// Does the azimuth of the view count?
    pub(super) fn is_turned(&self) -> bool {
        self.columns > 1
    }

    /// Is there a diffuse part?
    pub(super) fn is_diffuse(&self) -> bool {
        self.diffuse.iter().any(|d| *d > 0.0)
    }
}

impl Part for Views {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let shape = || match self.columns {
            1 => vec![self.lobes, self.count(), 4],
            columns => vec![self.lobes, self.count() / columns, columns, 4],
        };
        put_f32(to, format!("{prefix}.means"), shape(), self.means.concat());
        put_f32(to, format!("{prefix}.weights"), shape(), self.weights.concat());
        put_f32(to, format!("{prefix}.diffuse"), vec![3], self.diffuse.to_vec());
        if self.is_turned() {
            put_f32(to, format!("{prefix}.sweeps"), shape(), self.sweeps.concat());
        }
        if !self.zonal.is_empty() {
            put_f32(to, format!("{prefix}.zonal"), shape(), self.zonal.concat());
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let sweeps = format!("{prefix}.sweeps");
        let turned = from.tensors.contains_key(&sweeps);
        // Lobes, columns, numbers.
        let table = |name: String| -> Result<([usize; 2], Vec<[f32; 4]>), PartError> {
            let (shape, v) = get_f32(from, &name, if turned { 4 } else { 3 })?;
            let columns = if turned { shape[2] } else { 1 };
            let valid = (1..=MAX_LOBES).contains(&shape[0])
                && shape[1] >= 2
                && shape[shape.len() - 1] == 4
                && (!turned || columns >= 2);
            if !valid {
                return Err(PartError::Unexpected(name));
            }
            Ok(([shape[0], columns], v.as_chunks().0.to_vec()))
        };
        let name = format!("{prefix}.means");
        let (size, means) = table(name.clone())?;
        let [lobes, columns] = size;
        // The fourth number of a mean is the number of lookups that shading makes.
        if means.iter().any(|m| !(0.0..=MAX_TAPS as f32).contains(&m[3])) {
            return Err(PartError::Unexpected(name));
        }
        let name = format!("{prefix}.weights");
        let (other, weights) = table(name.clone())?;
        if other != size || weights.len() != means.len() {
            return Err(PartError::Unexpected(name));
        }
        let name = sweeps;
        let (other, sweeps) = if turned { table(name.clone())? } else { (size, Vec::new()) };
        if other != size || ![0, means.len()].contains(&sweeps.len()) {
            return Err(PartError::Unexpected(name));
        }
        let name = format!("{prefix}.diffuse");
        let (_, diffuse) = get_f32(from, &name, 1)?;
        let diffuse = diffuse[..].try_into().map_err(|_| PartError::Unexpected(name))?;
        let name = format!("{prefix}.zonal");
        let zonal = if from.tensors.contains_key(&name) { table(name.clone())?.1 } else { Vec::new() };
        if ![0, means.len()].contains(&zonal.len()) {
            return Err(PartError::Unexpected(name));
        }
        Ok(Self { means, sweeps, columns, weights, zonal, lobes, diffuse })
    }

    fn bytes(&self) -> usize {
        16 * (2 * self.means.len() + self.sweeps.len() + self.zonal.len()) + 12
    }
}
