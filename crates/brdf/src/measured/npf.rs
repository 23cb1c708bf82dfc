//! The 100 MERL materials as tabulated factors.
//!
//! Bagher, Snyder & Nowrouzezahrai 2016, A Non-Parametric Factor Microfacet Model for Isotropic BRDFs. Per
//! channel, 90 numbers each of D over √θ_h, of G₁ over θ and of F over θ_d:
//!
//! **f = (ρ_d + ρ_s D(θ_h) F(θ_d) G₁(θ_i) G₁(θ_o)/(n·wi n·wo))/π**
//!
//! Numbers stand at the centres of their bins, i + ½ = 90 √(θ_h/(π/2)) for D and degrees for G₁ and F, linear
//! between them and constant beyond. The first number of G₁ is 0 for every material, and that of F almost 0:
//! nothing was measured within a degree there. Where a first number is less than half of the second it is
//! missing, and the second replaces it. (The authors take the nearest bin for D and F, so that f is nearly
//! ρ_d/π at θ_d below 1°.)
//!
//! File: 32-bit floats `[256][512][3]`, rows of materials, columns ρ_d, ρ_s, 90 of D, 90 of G₁, 90 of F;
//! names in `npf_material_names.txt` beside it, one per line.

use super::grid::half_angles;
use super::materials;
use super::tabulated::{self, Tabulated, Twin};
use crate::math::{INV_PI, polar_angle};
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Info, SharedBrdf, SpecError};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::sync::Arc;
use steradian_base::ParamInfo;
use steradian_formats::{Limits, NPF_BYTES, decode_npf};

/// The page.
pub static INFO: Info = Info {
    name: "npf",
    source: "Bagher, Snyder & Nowrouzezahrai 2016, with the authors' table of 100 MERL materials",
    formula: "f = (ρ_d + ρ_s D(θ_h) F(θ_d) G₁(θ_i) G₁(θ_o)/(n·wi n·wo))/π, factors tabulated",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::file("file", "path of the table (npf.bin)").positional(),
        ParamInfo::name("material", "a material of its list, such as gold-metallic-paint").positional(),
        ParamInfo::file("names", "path of the list; npf_material_names.txt beside the table"),
    ],
    reciprocity: "reciprocal",
    energy: "as fitted to measurements",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// Name of the list of names in the table's folder.
pub(super) const NAMES: &str = "npf_material_names.txt";

/// Entries of each tabulated factor, a degree each.
const BINS: usize = 90;
/// ρ_d, ρ_s and the three factors.
const USED: usize = 2 + 3 * BINS;

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &Path| {
        let bytes = a.bytes(path, NPF_BYTES, "a table of tabulated factors")?;
        let names = materials::list(path, NAMES, a);
        let row = materials::find(&names, a.name("material").as_deref(), a)?;
        let columns = decode_npf(path, &bytes, row, &Limits::default())?;
        Npf::new(columns.iter().take(USED).flatten().copied()).ok_or_else(|| SpecError::File {
            file: path.display().to_string(),
            what: "the material's row holds negative numbers".into(),
        })
    };
    let keep = |numbers: &[f64]| Npf::new(numbers.iter().map(|v| *v as f32));
    tabulated::make(a, "npf:npf.bin,chrome", read, keep)
}

/// One material.
#[derive(Debug, Clone)]
struct Npf {
    /// ρ_d, ρ_s, D, G₁, F.
    columns: Arc<Vec<[f32; 3]>>,
}

impl Npf {
    fn new(numbers: impl Iterator<Item = f32>) -> Option<Self> {
        let numbers: Vec<f32> = numbers.collect();
        let (columns, []) = numbers.as_chunks::<3>() else { return None };
        let valid = columns.len() == USED && numbers.iter().all(|v| v.is_finite() && *v >= 0.0);
        if !valid {
            return None;
        }
        let mut columns = columns.to_vec();
        for first in [2 + BINS, 2 + 2 * BINS] {
            for c in (0..3).filter(|c| numbers[3 * first + c] < 0.5 * numbers[3 * (first + 1) + c]) {
                columns[first][c] = columns[first + 1][c];
            }
        }
        Some(Self { columns: Arc::new(columns) })
    }

    /// Linear between the centres of the bins of the factor that begins at column `from`.
    fn factor(&self, from: usize, x: f64) -> [f64; 3] {
        let t = (x - 0.5).clamp(0.0, (BINS - 1) as f64);
        let i = (t as usize).min(BINS - 2);
        let (a, b, t) = (self.columns[from + i], self.columns[from + i + 1], t - i as f64);
        std::array::from_fn(|c| f64::from(a[c]) + t * (f64::from(b[c]) - f64::from(a[c])))
    }
}

impl Tabulated for Npf {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn held(&self) -> Vec<f64> {
        self.columns.iter().flatten().map(|v| f64::from(*v)).collect()
    }

    fn twin(&self) -> Option<Twin> {
        let source = concat!(include_str!("half.wgsl"), include_str!("npf.wgsl"));
        Some(Twin { source, parameters: Vec::new(), cells: self.columns.clone() })
    }

    fn value(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let [theta_h, _, theta_d, _] = half_angles(wi, wo);
        let bin = |theta: f64| BINS as f64 * theta / FRAC_PI_2;
        let d = self.factor(2, BINS as f64 * (theta_h / FRAC_PI_2).sqrt());
        let gi = self.factor(2 + BINS, bin(polar_angle(wi)));
        let go = self.factor(2 + BINS, bin(polar_angle(wo)));
        let f = self.factor(2 + 2 * BINS, bin(theta_d));
        let cosines = (wi.z * wo.z).max(1e-150);
        std::array::from_fn(|c| {
            let [rho_d, rho_s] = [0, 1].map(|i| f64::from(self.columns[i][c]));
            INV_PI * (rho_d + rho_s * d[c] * f[c] * gi[c] * go[c] / cosines)
        })
    }
}

#[cfg(test)]
mod tests {

    use crate::conformance::check_measured;
    use crate::{Files, parse_with};

    #[test]
    fn the_published_table() {
        let Some(path) = steradian_testkit::data("brdfs/merl_reduced/npf.bin") else { return };
        for name in ["chrome", "@blue-acrylic", "white-fabric"] {
            let spec = format!("npf:{},{name}", path.display());
            let brdf = parse_with(&spec, Files::Any).expect("valid");
            check_measured(&*brdf);
            let held = brdf.held().expect("numbers");
            assert!(parse_with(&brdf.spec(), Files::Held(&held)).is_ok());
        }
        let e = parse_with(&format!("npf:{},chrom", path.display()), Files::Any).expect_err("no such");
        assert!(e.to_string().contains("did you mean 'chrome'?"), "{e}");
    }

    /// In the mean the tabulated factors and the shifted-gamma fits describe the same measurements.
    #[test]
    fn near_the_other_description_of_the_same_materials() {
        let Some(path) = steradian_testkit::data("brdfs/merl_reduced/npf.bin") else { return };
        let mut logs = Vec::new();
        for name in ["gold-metallic-paint", "pink-felt", "blue-acrylic", "alum-bronze"] {
            let npf = parse_with(&format!("npf:{},{name}", path.display()), Files::Any).expect("valid");
            let sgd = crate::parse(&format!("sgd:{name}")).expect("known");
            for (wi, wo) in super::super::nbrdf::pairs(100) {
                logs.push((npf.eval(wi, wo)[1] / sgd.eval(wi, wo)[1]).ln().abs());
            }
        }
        logs.sort_by(f64::total_cmp);
        assert!(logs[logs.len() / 2] < 0.3, "{}", logs[logs.len() / 2]);
    }
}
