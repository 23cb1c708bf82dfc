//! Anisotropic materials of the Institute of Information Theory and Automation in Prague (Filip & Vávra 2014,
//! "Template-Based Sampling of Anisotropic BRDFs"), linear in the four angles between the measured
//! directions. Beyond 75°, the last polar angle, f is constant. Numbers are scaled by 1/140, decoded by
//! sRGB's curve and multiplied by 100, as the institute's own viewer does, and taken as f: Dupuy's reader
//! multiplies the same number by the cosine. Negative ones are set to 0 and counted.

use super::grid::{Coordinates, Grid};
use super::table::{Counts, Table};
use super::tabulated::make as made;
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Info, SharedBrdf, SpecError};
use std::path::Path;
use steradian_base::ParamInfo;
use steradian_formats::{Limits, UTIA_BYTES, UTIA_ELEVATIONS, UTIA_TURNS, UtiaTable, decode_utia};

/// The page.
pub static INFO: Info = Info {
    name: "utia",
    source: "Filip & Vávra 2014; units as in the institute's viewer",
    formula: "f linear in θ_i, φ_i, θ_o and φ_o between 6 × 48 × 6 × 48 measured pairs; beyond 75° as at 75°",
    units: "sr⁻¹ by the viewer's convention",
    parameters: &[ParamInfo::file("file", "path of a .bin file of 1990656 bytes").positional()],
    reciprocity: "as measured",
    energy: "as measured",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &Path| {
        let bytes = a.bytes(path, UTIA_BYTES, "a table of UTIA's")?;
        let table = decode_utia(path, &bytes, &Limits::default())?;
        of(&table).ok_or_else(|| SpecError::File {
            file: path.display().to_string(),
            what: "no number of it is positive".into(),
        })
    };
    made(a, "utia:m003_carpet01.bin", read, |n| Table::of_numbers(&INFO, notes, n))
}

/// The viewer's curve, which is not quite sRGB's.
fn decoded(v: f64) -> f32 {
    let x = v.max(0.0) / 140.0;
    let linear = if x > 0.0375 { ((x + 0.055) / 1.055).powf(2.4) } else { x / 12.92 };
    (100.0 * linear).min(1e30) as f32
}

fn of(table: &UtiaTable) -> Option<Table> {
    let [r, g, b] = &table.channels;
    let negative = table.channels.iter().flatten().filter(|v| **v < 0.0).count();
    let cells: Vec<[f32; 3]> = (0..r.len()).map(|i| [r[i], g[i], b[i]].map(decoded)).collect();
    if cells.iter().flatten().all(|v| *v == 0.0) {
        return None;
    }
    let counts = Counts { all: cells.len(), missing: 0, negative };
    let sizes = [UTIA_ELEVATIONS, UTIA_TURNS, UTIA_ELEVATIONS, UTIA_TURNS];
    let grid = Grid::filled(Coordinates::Directions { last: 75 }, sizes, cells, &[2])?;
    Some(Table { info: &INFO, notes, counts, grid })
}

fn notes(table: &Table) -> Vec<String> {
    let Counts { all, negative, .. } = table.counts;
    vec![
        format!("{negative} of the numbers of {all} pairs of directions are negative: set to 0"),
        "polar angles beyond 75° were not measured: as at 75°".into(),
        format!("the brightest cell is {:.4} sr⁻¹", table.brightest()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::check_measured;
    use crate::math::spherical;
    use crate::{Files, parse_with};

    #[test]
    fn a_file_of_known_numbers() {
        let path = std::env::temp_dir().join(format!("steradian-utia-{}.bin", std::process::id()));
        let directions = UTIA_ELEVATIONS * UTIA_TURNS;
        let number = |c: usize, i: usize, v: usize| -> f64 {
            let brushed = ((i % UTIA_TURNS) as f64 * 0.13).cos() * ((v % UTIA_TURNS) as f64 * 0.13).cos();
            if c == 2 && i == 0 && v == 7 { -1.0 } else { 5.0 + 2.0 * brushed + c as f64 }
        };
        let mut bytes = Vec::new();
        for c in 0..3 {
            for i in 0..directions {
                (0..directions).for_each(|v| bytes.extend(number(c, i, v).to_le_bytes()));
            }
        }
        std::fs::write(&path, &bytes).expect("written");
        let spec = format!("utia:{}", path.display());
        let brdf = parse_with(&spec, Files::Any).expect("valid");
        check_measured(&*brdf);
        assert!(!brdf.is_isotropic() && brdf.notes()[0].starts_with("1 of "), "{:?}", brdf.notes());
        // At a node: θ_i = 30°, φ_i = 52.5°, θ_o = 45°, φ_o = 7.5°.
        let at = |t: f64, p: f64| spherical(t.to_radians(), p.to_radians());
        let f = brdf.eval(at(30.0, 52.5), at(45.0, 7.5));
        let want = f64::from(decoded(number(1, 2 * UTIA_TURNS + 7, 3 * UTIA_TURNS + 1)));
        assert!((f[1] / want - 1.0).abs() < 1e-5, "{} {want}", f[1]);
        assert_eq!(brdf.eval(at(80.0, 5.0), at(85.0, 9.0)), brdf.eval(at(75.0, 5.0), at(75.0, 9.0)));
        let held = brdf.held().expect("numbers");
        assert!(parse_with(&spec, Files::Held(&held)).is_ok());
        std::fs::write(&path, vec![0; bytes.len()]).expect("written");
        let e = parse_with(&spec, Files::Any).expect_err("dark").to_string();
        assert!(e.contains("no number of it is positive"), "{e}");
        std::fs::remove_file(&path).expect("removed");
    }
}
