//! Tables of a fit over the view, for the levels of a chain.

use super::params::{MAX_HALF_VECTORS, MAX_TAPS};
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
    /// Half vectors in the tangent frame, and the level of the chain of each; empty where lobes have means of
    /// their own. Each has a Gaussian about the direction to which it mirrors the view, `means` and `sweeps`
    /// are empty.
    pub half_vectors: Vec<[f32; 4]>,
    /// Columns of a row: 1, or those by the azimuth.
    pub columns: usize,
    /// Weights, 0.
    pub weights: Vec<[f32; 4]>,
    /// A_1, A_2, A_3 of the Gaussian that is looked up, 0; empty where visibility is not convolved with it.
    /// One for each half vector, where there are such.
    pub zonal: Vec<[f32; 4]>,
    /// Lobes.
    pub lobes: usize,
    /// ρ_d.
    pub diffuse: [f32; 3],
    /// The half vectors whose weight is not 0 at all views about a place of the tables, by the place.
    pub used: Vec<Vec<u32>>,
}

impl Views {
    /// Views of each lobe.
    pub fn count(&self) -> usize {
        self.weights.len() / self.lobes
    }

    /// With [`Self::used`] of the weights.
    pub fn with_used(mut self) -> Self {
        if self.half_vectors.is_empty() {
            return self;
        }
        let (count, columns) = (self.count(), self.columns);
        let rows = count / columns;
        let used = |place: usize| -> Vec<u32> {
            let (i, j) = (place / columns, place % columns);
            let corner = |k: usize| (i + k / 2).min(rows - 1) * columns + (j + k % 2).min(columns - 1);
            let any = |k: &u32| {
                let first = *k as usize * count;
                (0..4).any(|c| self.weights[first + corner(c)][..3].iter().any(|w| *w != 0.0))
            };
            (0..self.lobes as u32).filter(any).collect()
        };
        self.used = (0..count).map(used).collect();
        self
    }

    /// The half vectors that views about a place of the tables need.
    #[inline(always)]
    pub(super) fn used_at(&self, place: usize) -> &[u32] {
        self.used.get(place).map_or(&[], |u| u)
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
        put_f32(to, format!("{prefix}.weights"), shape(), self.weights.concat());
        put_f32(to, format!("{prefix}.diffuse"), vec![3], self.diffuse.to_vec());
        if self.half_vectors.is_empty() {
            put_f32(to, format!("{prefix}.means"), shape(), self.means.concat());
        } else {
            put_f32(to, format!("{prefix}.half_vectors"), vec![self.lobes, 4], self.half_vectors.concat());
        }
        if !self.sweeps.is_empty() {
            put_f32(to, format!("{prefix}.sweeps"), shape(), self.sweeps.concat());
        }
        if !self.zonal.is_empty() {
            let shape = if self.half_vectors.is_empty() { shape() } else { vec![self.lobes, 4] };
            put_f32(to, format!("{prefix}.zonal"), shape, self.zonal.concat());
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let sweeps = format!("{prefix}.sweeps");
        let halves = format!("{prefix}.half_vectors");
        let half_vectors: Vec<[f32; 4]> = match from.tensors.contains_key(&halves) {
            true => match get_f32(from, &halves, 2)? {
                (shape, v) if shape[1] == 4 && shape[0] > 0 => v.as_chunks().0.to_vec(),
                _ => return Err(PartError::Unexpected(halves)),
            },
            false => Vec::new(),
        };
        let most = if half_vectors.is_empty() { MAX_LOBES } else { MAX_HALF_VECTORS as usize };
        let turned = from.tensors.contains_key(&sweeps) || !half_vectors.is_empty();
        // Lobes, columns, numbers.
        let table = |name: &String| -> Result<([usize; 2], Vec<[f32; 4]>), PartError> {
            let (shape, v) = get_f32(from, name, if turned { 4 } else { 3 })?;
            let columns = if turned { shape[2] } else { 1 };
            let valid = (1..=most).contains(&shape[0])
                && shape[1] >= 2
                && shape[shape.len() - 1] == 4
                && (!turned || columns >= 2);
            if !valid {
                return Err(PartError::Unexpected(name.clone()));
            }
            Ok(([shape[0], columns], v.as_chunks().0.to_vec()))
        };
        let (size, weights) = table(&format!("{prefix}.weights"))?;
        let [lobes, columns] = size;
        // As large as the weights.
        let other = |name: String| match table(&name)? {
            (other, v) if other == size && v.len() == weights.len() => Ok(v),
            _ => Err(PartError::Unexpected(name)),
        };
        let (mut means, mut swept) = (Vec::new(), Vec::new());
        if half_vectors.is_empty() {
            let name = format!("{prefix}.means");
            means = other(name.clone())?;
            // The fourth number of a mean is the number of lookups that shading makes.
            if means.iter().any(|m| !(0.0..=MAX_TAPS as f32).contains(&m[3])) {
                return Err(PartError::Unexpected(name));
            }
            if turned {
                swept = other(sweeps)?;
            }
        } else if half_vectors.len() != lobes {
            return Err(PartError::Unexpected(halves));
        }
        let name = format!("{prefix}.diffuse");
        let (_, diffuse) = get_f32(from, &name, 1)?;
        let diffuse = diffuse[..].try_into().map_err(|_| PartError::Unexpected(name))?;
        let name = format!("{prefix}.zonal");
        let zonal = match from.tensors.contains_key(&name) {
            false => Vec::new(),
            true if half_vectors.is_empty() => other(name)?,
            true => match get_f32(from, &name, 2)? {
                (shape, v) if shape == [lobes, 4] => v.as_chunks().0.to_vec(),
                _ => return Err(PartError::Unexpected(name)),
            },
        };
        let used = Vec::new();
        let views =
            Self { means, sweeps: swept, half_vectors, columns, weights, zonal, lobes, diffuse, used };
        Ok(views.with_used())
    }

    fn bytes(&self) -> usize {
        let tables = [&self.means, &self.sweeps, &self.half_vectors, &self.weights, &self.zonal];
        16 * tables.iter().map(|t| t.len()).sum::<usize>() + 12
    }
}
