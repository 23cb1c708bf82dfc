//! The reflectance's factor: projected to harmonics on both sides, then changed to hats of the outgoing
//! direction.

use super::hats::Hats;
use crate::BakeError;
use crate::shared::material::reflectance;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{Material, Part};
use steradian_base::Task;
use steradian_brdf::{Brdf, SharedBrdf};
use steradian_numerics::dense::Cholesky;
use steradian_parallel::prelude::*;
use steradian_sphere::quadrature::product_hemisphere;
use steradian_sphere::sh;

/// Degree of the rule over incoming directions: a lobe's bands up to 89 are integrated exactly against the
/// eight bands of the light.
const INCOMING: usize = 96;
/// Degree of the rule over outgoing directions: products of two harmonics of eight bands have 14, so that as
/// many are left for the change of reflectance with the view.
const OUTGOING: usize = 28;

/// Factors of the local coefficients of the light for each hat.
pub struct Reflected {
    /// Hats along an edge.
    pub hats: Hats,
    /// Bands on both sides.
    pub bands: usize,
    /// Factors by channel, hat after hat: one for each coefficient.
    pub rows: [Vec<f64>; 3],
    brdf: SharedBrdf,
}

impl Reflected {
    pub(super) fn bake(m: &Material, hats: Hats, bands: usize, task: &Task) -> Result<Self, BakeError> {
        let change = hats.change_of_basis(bands);
        let n = bands * bands;
        let twice = projected(&*m.brdf, bands, task)?;
        let rows = twice.map(|b| {
            let row = |hat: &[f64]| {
                (0..n).map(|j| (0..n).map(|i| hat[i] * b[i * n + j]).sum()).collect::<Vec<f64>>()
            };
            change.chunks_exact(n).flat_map(row).collect()
        });
        Ok(Self { hats, bands, rows, brdf: m.brdf.clone() })
    }
}

/// B_ij of f_cos(wi, wo) ≈ Σ_ij B_ij y_i(wo) y_j(wi), by channel: integrals over wi, least squares over the
/// hemisphere of wo (harmonics are no orthogonal basis of it).
fn projected(brdf: &dyn Brdf, bands: usize, task: &Task) -> Result<[Vec<f64>; 3], BakeError> {
    let n = bands * bands;
    let (incoming, outgoing) = (product_hemisphere(INCOMING), product_hemisphere(OUTGOING));
    let harmonics = |d: &glam::DVec3| {
        let mut y = vec![0.0; n];
        sh::eval(bands - 1, *d, &mut y);
        y
    };
    let at_light: Vec<Vec<f64>> = incoming.directions.par_iter().map(harmonics).collect();
    task.begin("reflectance", outgoing.len() as u64);
    let view = |wo: &glam::DVec3| {
        task.check()?;
        let mut c: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; n]);
        for ((wi, w), y) in incoming.directions.iter().zip(&incoming.weights).zip(&at_light) {
            let f = brdf.f_cos(*wi, *wo);
            for (c, f) in c.iter_mut().zip(f) {
                c.iter_mut().zip(y).for_each(|(c, y)| *c += w * f * y);
            }
        }
        task.advance(1);
        Ok(c)
    };
    let views: Result<Vec<[Vec<f64>; 3]>, BakeError> = outgoing.directions.par_iter().map(view).collect();
    task.end();
    let views = views?;
    let (mut gram, mut sums) = (vec![vec![0.0; n]; n], [0, 1, 2].map(|_| vec![vec![0.0; n]; n]));
    for ((wo, w), c) in outgoing.directions.iter().zip(&outgoing.weights).zip(&views) {
        let y = harmonics(wo);
        for i in 0..n {
            (0..n).for_each(|j| gram[i][j] += w * y[i] * y[j]);
            for (sum, c) in sums.iter_mut().zip(c) {
                // Columns of the right-hand side.
                (0..n).for_each(|j| sum[j][i] += w * y[i] * c[j]);
            }
        }
    }
    let gram = Cholesky::new(&gram);
    Ok(sums.map(|columns| {
        let mut out = vec![0.0; n * n];
        for (j, column) in columns.into_iter().enumerate() {
            let Some(gram) = &gram else { continue };
            gram.solve(column).into_iter().enumerate().for_each(|(i, x)| out[i * n + j] = x);
        }
        out
    }))
}

impl Part for Reflected {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let shape = vec![3, self.hats.side, self.hats.side, self.bands * self.bands];
        put_f64(to, format!("{prefix}.hats"), shape, self.rows.concat());
        reflectance::put(to, &format!("steradian.{prefix}.brdf"), &*self.brdf);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.hats");
        let (shape, v) = get_f64(from, &name, 4)?;
        let (side, bands) = (shape[1], shape[3].isqrt());
        if shape != [3, side, side, bands * bands] || side < 2 || !(1..=8).contains(&bands) {
            return Err(PartError::Unexpected(name));
        }
        let mut rows = v.chunks_exact(side * side * bands * bands).map(<[f64]>::to_vec);
        Ok(Self {
            hats: Hats { side },
            bands,
            rows: std::array::from_fn(|_| rows.next().unwrap_or_default()),
            brdf: reflectance::kept(from, &format!("steradian.{prefix}.brdf"))?,
        })
    }

    fn bytes(&self) -> usize {
        24 * self.rows[0].len()
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        Some(&*self.brdf)
    }
}
