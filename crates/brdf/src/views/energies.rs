//! Energy of a tabulated reflectance, by band and by elevation of the view, and the error of the table's
//! lookups.

use super::paraboloid::ring;
use super::{Projection, Rule};
use crate::{Brdf, SharedBrdf};
use glam::DVec3;
use steradian_base::{Cancelled, Elevation, Task};
use steradian_parallel::prelude::*;

/// Highest band whose energy is computed.
pub const ORDER: usize = 32;
/// Most reflectances whose energies are computed.
const MOST_LOOKED_AT: usize = 9;
/// Number of angles of view.
pub const ANGLES: usize = 10;
/// Angles of view, degrees, at which energies are computed.
const DEGREES: [f64; ANGLES] = [4.0, 14.0, 24.0, 34.0, 44.0, 54.0, 64.0, 74.0, 82.0, 88.0];

/// Energies of f_cos by band at some angles of view, and how far the table's lookup is off there.
#[derive(Debug, Clone, PartialEq)]
pub struct Energies {
    /// Per angle: Σ_m c_lm² of the bands, then ∫ f_cos² dwi; by channel.
    rows: Vec<[Vec<f64>; 3]>,
    /// Per angle: relative RMS error of the coefficients looked up between texels.
    lookup: Vec<f64>,
    /// Relative error of the quadrature, the largest over the angles.
    quadrature: f64,
}

impl Energies {
    /// Measures a reflectance and a table of its coefficients in `bands` bands, which `table` looks up.
    pub fn new(
        brdf: &dyn Brdf,
        bands: usize,
        table: impl Fn(DVec3) -> [Vec<f32>; 3] + Sync,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        Self::of_table(brdf, bands, &table, task)
    }

    /// Mean energies of several reflectances, at least one, and their tables by number; errors of lookups are
    /// root mean squares, that of the quadrature the largest. Of more than nine only every second, third
    /// and so on is measured.
    pub fn of_all(
        brdfs: &[SharedBrdf],
        bands: usize,
        table: impl Fn(usize, DVec3) -> [Vec<f32>; 3] + Sync,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let step = brdfs.len().div_ceil(MOST_LOOKED_AT);
        let each = brdfs.iter().enumerate().step_by(step);
        let all: Result<Vec<Self>, Cancelled> =
            each.map(|(k, b)| Self::of_table(&**b, bands, &|wo| table(k, wo), task)).collect();
        let all = all?;
        let share = 1.0 / all.len() as f64;
        let row = |i: usize| {
            let number = |c: usize, k: usize| all.iter().map(|e| share * e.rows[i][c][k]).sum();
            [0, 1, 2].map(|c| (0..ORDER + 2).map(|k| number(c, k)).collect())
        };
        let root = |i: usize| all.iter().map(|e| share * e.lookup[i].powi(2)).sum::<f64>().sqrt();
        Ok(Self {
            rows: (0..DEGREES.len()).map(row).collect(),
            lookup: (0..DEGREES.len()).map(root).collect(),
            quadrature: all.iter().map(|e| e.quadrature).fold(0.0, f64::max),
        })
    }

    fn of_table(
        brdf: &dyn Brdf,
        bands: usize,
        table: &(dyn Fn(DVec3) -> [Vec<f32>; 3] + Sync),
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let (rule, more) = (Rule::new(ORDER), Rule::with_nodes(bands - 1, 9.0));
        let row = |degrees: &f64| {
            task.check()?;
            let views = ring(brdf, degrees.to_radians());
            let (mut row, mut errors) = (std::array::from_fn(|_| vec![0.0; ORDER + 2]), [0.0; 3]);
            for wo in &views {
                let p = rule.project(brdf, *wo);
                add(&mut row, &p, 1.0 / views.len() as f64);
                let exact = more.project(brdf, *wo);
                compare(&exact, &p, &table(*wo), &mut errors);
            }
            let ratio = |a: f64, b: f64| if b > 0.0 { (a / b).sqrt() } else { 0.0 };
            Ok((row, ratio(errors[0], errors[2]), ratio(errors[1], errors[2])))
        };
        let all: Result<Vec<_>, Cancelled> = DEGREES.par_iter().map(row).collect();
        let all = all?;
        Ok(Self {
            lookup: all.iter().map(|a| a.1).collect(),
            quadrature: all.iter().map(|a| a.2).fold(0.0, f64::max),
            rows: all.into_iter().map(|a| a.0).collect(),
        })
    }

    /// Angle of view and error of the lookup there.
    pub fn lookup(&self) -> impl Iterator<Item = (f64, f64)> {
        DEGREES.into_iter().zip(self.lookup.iter().copied())
    }

    /// Relative error of the coefficients by quadrature, against one of twice as many nodes.
    pub fn quadrature(&self) -> f64 {
        self.quadrature
    }

    /// Relative RMS errors over all views, and by elevation. Of light without its suns, and of all light,
    /// `light` holds the mean square of a coefficient by channel and band, `beyond` that above; band l is
    /// shaded times `kept[l]`. Over all frames coefficients are independent: the mean of (Σ L_i c_i)² is Σ_l
    /// |c_l|² · mean square.
    pub fn error(
        &self,
        [rest, all_light]: [&[Vec<f64>; 3]; 2],
        beyond: [f64; 3],
        kept: &[f64],
    ) -> (f64, Vec<Elevation>) {
        let (mut lost, mut all) = (0.0, 0.0);
        let mut elevations = Vec::new();
        for (degrees, row) in DEGREES.iter().zip(&self.rows) {
            let mut at = [0.0; 2];
            for c in 0..3 {
                let mut above = row[c][ORDER + 1];
                for l in 0..=ORDER {
                    let missed = (1.0 - kept.get(l).copied().unwrap_or(0.0)).powi(2);
                    let square = |light: &[Vec<f64>; 3]| light[c].get(l).copied().unwrap_or(beyond[c]);
                    at[0] += row[c][l] * square(rest) * missed;
                    at[1] += row[c][l] * square(all_light);
                    above -= row[c][l];
                }
                let e = above.max(0.0) * beyond[c];
                at = at.map(|x| x + e);
            }
            let theta = degrees.to_radians();
            elevations
                .push(Elevation::computed(theta, if at[1] > 0.0 { (at[0] / at[1]).sqrt() } else { 0.0 }));
            lost += theta.sin() * at[0];
            all += theta.sin() * at[1];
        }
        (if all > 0.0 { (lost / all).sqrt() } else { 0.0 }, elevations)
    }

    /// Σ_m c_lm² of every band and ∫ f_cos² dwi, angle by angle and channel by channel, [`ORDER`] + 2 numbers
    /// each; and the errors of lookups, then that of the quadrature.
    pub fn numbers(&self) -> [Vec<f64>; 2] {
        let rows = self.rows.iter().flat_map(|r| r.concat()).collect();
        [rows, self.lookup.iter().copied().chain([self.quadrature]).collect()]
    }

    /// The energies of [`Energies::numbers`]; `None` where they are not those of any.
    pub fn from_numbers([rows, mut errors]: [Vec<f64>; 2]) -> Option<Self> {
        let whole = rows.len() == 3 * ANGLES * (ORDER + 2) && errors.len() == ANGLES + 1;
        let row = |r: &[f64]| std::array::from_fn(|c| r[c * (ORDER + 2)..(c + 1) * (ORDER + 2)].to_vec());
        let quadrature = errors.pop().unwrap_or_default();
        let rows = rows.chunks_exact(3 * (ORDER + 2)).map(row).collect();
        whole.then_some(Self { rows, lookup: errors, quadrature })
    }
}

fn add(row: &mut [Vec<f64>; 3], p: &Projection, weight: f64) {
    for c in 0..3 {
        for l in 0..=ORDER {
            row[c][l] += weight * p.c[c][l * l..(l + 1) * (l + 1)].iter().map(|x| x * x).sum::<f64>();
        }
        row[c][ORDER + 1] += weight * p.energy[c];
    }
}

/// Adds the squares of the lookup's error, of the quadrature's, and of the coefficients.
fn compare(exact: &Projection, usual: &Projection, found: &[Vec<f32>; 3], errors: &mut [f64; 3]) {
    for c in 0..3 {
        for (k, e) in exact.c[c].iter().enumerate() {
            errors[0] += (f64::from(found[c][k]) - e).powi(2);
            errors[1] += (usual.c[c][k] - e).powi(2);
            errors[2] += e * e;
        }
    }
}
