//! Scattered measurements as comma-separated values with a header: theta_i, phi_i, theta_o, phi_o and r, g,
//! b, or one column `f`, which is grey; other columns pass. Angles are in radians, or in degrees where a
//! polar angle is above π/2, both directions away from the surface; values are f in sr⁻¹, without the cosine.
//! A row with a negative value, or with a direction at the horizon or below it, was not measured. The
//! material is isotropic if φ_i is the same in all rows. Between the measured directions `scattered`
//! interpolates.

use super::scattered::{MAX_ROWS, Samples, notes};
use super::table::Table;
use super::tabulated::make as made;
use crate::math::spherical;
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Brdf, Info, SharedBrdf, SpecError};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;
use steradian_base::ParamInfo;
use steradian_formats::{CsvTable, FormatError, Limits, decode_csv_like};

/// The page.
pub static INFO: Info = Info {
    name: "csv",
    source: "scattered measurements, interpolated as in Kautz, Sloan & Snyder 2002",
    formula: "f between scattered measurements by radial-basis functions of half and difference angles",
    units: "sr⁻¹",
    parameters: &[ParamInfo::file(
        "file",
        "path of a table with columns theta_i, phi_i, theta_o, phi_o, r, g, b",
    )
    .positional()],
    reciprocity: "reciprocal",
    energy: "as measured",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// Four million measurements take less.
const MAX_BYTES: u64 = 256 << 20;
const ANGLES: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];
const VALUES: [&str; 3] = ["r", "g", "b"];

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &Path| {
        let bytes = a.bytes(path, MAX_BYTES, "a table of measurements")?;
        let table = decode_csv_like(path, &bytes, &Limits::default(), "theta_i,phi_i,theta_o,phi_o,r,g,b")?;
        let rows = rows(&table)?;
        if rows.len() > MAX_ROWS {
            let what = format!("holds {} measurements; {MAX_ROWS} at most are read", rows.len());
            return Err(SpecError::File { file: path.display().to_string(), what });
        }
        let mut samples = Samples::default();
        rows.into_iter().for_each(|(a, v)| samples.push(a, v));
        let isotropic = samples.one_azimuth();
        let table = samples.table(&INFO, notes, isotropic);
        table.map_err(|what| SpecError::File { file: path.display().to_string(), what })
    };
    made(a, "csv:measurements.csv", read, |n| Table::of_numbers(&INFO, notes, n))
}

/// Angles in radians, and a colour.
type Row = ([f64; 4], [f64; 3]);

fn rows(table: &CsvTable) -> Result<Vec<Row>, FormatError> {
    let mut angles = table.vectors(ANGLES)?;
    let steepest = angles.iter().map(|a| a[0].abs().max(a[2].abs())).fold(0.0, f64::max);
    if steepest > FRAC_PI_2 + 1e-3 {
        angles.iter_mut().flatten().for_each(|a| *a = a.to_radians());
    }
    let grey = table.header.iter().any(|h| h == "f") && !table.header.iter().any(|h| h == VALUES[0]);
    let values = if grey {
        table.vectors(["f"])?.into_iter().map(|[f]| [f; 3]).collect()
    } else {
        table.vectors(VALUES)?
    };
    Ok(angles.into_iter().zip(values).collect())
}

/// `brdf` at scattered directions as such a table: for isotropic reflectance 40 half angles, 24 difference
/// angles and 13 turns; for anisotropic reflectance 12, 16, 10 and 10. Where light or view would be below the
/// horizon there is no row.
pub fn tabulate(brdf: &dyn Brdf, name: &Path) -> CsvTable {
    let sizes = if brdf.is_isotropic() { [40, 1, 24, 13] } else { [12, 16, 10, 10] };
    let header = ANGLES.iter().chain(&VALUES).map(|s| (*s).to_owned()).collect();
    let mut table = CsvTable { name: name.into(), header, ..CsvTable::default() };
    for i in 0..sizes.iter().product() {
        let (wi, wo) = super::grid::Grid::centre(sizes, i);
        // 1° above the horizon: the lowest direction in such a table.
        if wi.z < 0.0175 || wo.z < 0.0175 {
            continue;
        }
        let polar = |w: glam::DVec3| crate::math::polar_angle(w);
        let turn = |w: glam::DVec3| w.y.atan2(w.x).rem_euclid(TAU);
        let from = if brdf.is_isotropic() { turn(wi) } else { 0.0 };
        let angles = [polar(wi), turn(wi) - from, polar(wo), (turn(wo) - from).rem_euclid(TAU)];
        let [wi, wo] = [spherical(angles[0], angles[1]), spherical(angles[2], angles[3])];
        let f = brdf.eval(wi, wo);
        if f.iter().all(|v| v.is_finite()) {
            table.lines.push(table.rows.len() + 2);
            table.rows.push(angles.iter().chain(&f).map(f64::to_string).collect());
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::check_measured;
    use crate::{Files, parse, parse_with};
    use steradian_formats::write_csv;

    /// A table written from a model is read back: relative errors of nine tenths of the directions.
    #[test]
    fn any_model_is_tabulated_and_read_back() {
        let folder = std::env::temp_dir().join(format!("steradian-csv-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("m.csv");
        let models = [
            ("ggx:alpha=0.3,f0=0.9/0.5/0.1", 0.05),
            ("ward:ax=0.2,ay=0.5,rd=0.2", 0.3),
            ("sgd:gold-metallic-paint", 0.06),
        ];
        let tried = if steradian_testkit::full() { models.len() } else { 2 };
        for (spec, bound) in models.into_iter().take(tried) {
            let model = parse(spec).expect(spec);
            write_csv(&path, &tabulate(&*model, &path)).expect("written");
            let read = parse_with(&format!("csv:{}", path.display()), Files::Any).expect("valid");
            if model.is_isotropic() {
                check_measured(&*read);
            }
            assert_eq!(read.is_isotropic(), model.is_isotropic());
            let pairs = crate::measured::nbrdf::pairs(400);
            let mut off: Vec<f64> =
                pairs.map(|(i, o)| (model.eval(i, o)[1] / read.eval(i, o)[1]).ln().abs()).collect();
            off.sort_by(f64::total_cmp);
            assert!(off[360] < bound, "{spec}: {}", off[360]);
        }
        for (text, part) in [
            ("theta_i,phi_i,theta_o,phi_o,r,g\n0,0,0,0,1,1\n", "no column 'b'"),
            ("theta_i,phi_i,theta_o,phi_o,f\n0,0,0,0,-1\n", "none of these is positive"),
            ("theta_i,phi_i,theta_o,phi_o,f\n0,0,0,0,1\n", "different directions"),
            ("theta_i,phi_i,theta_o,phi_o,f\n0,0,0,0,x\n", "line 2"),
        ] {
            std::fs::write(&path, text).expect("written");
            let e = parse_with(&format!("csv:{}", path.display()), Files::Any).expect_err(text).to_string();
            assert!(e.contains(part) && e.contains("m.csv"), "{e}");
        }
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}
