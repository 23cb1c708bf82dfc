//! Measurements in the manner of ASTM E1392 (`.astm`): rows of theta_i, phi_i (missing where the material is
//! isotropic), theta_s, phi_s and red, green and blue, or X, Y and Z, or one value, which is grey. Angles are
//! in radians, or in degrees where a polar angle is above π/2. Between the measured directions `scattered`
//! interpolates.

use super::scattered::{MAX_ROWS, Samples, notes};
use super::table::Table;
use super::tabulated::make as made;
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Info, SharedBrdf, SpecError};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use steradian_base::{ParamInfo, brief};
use steradian_formats::{AstmTable, Limits, decode_astm};

/// The page.
pub static INFO: Info = Info {
    name: "astm",
    source: "ASTM E1392, as Cornell's Program of Computer Graphics and ALTA write it; interpolated as in Kautz, Sloan & Snyder 2002",
    formula: "f between scattered measurements by radial-basis functions of half and difference angles",
    units: "sr⁻¹; X, Y, Z as linear Rec. 709",
    parameters: &[ParamInfo::file("file", "path of an .astm file").positional()],
    reciprocity: "reciprocal",
    energy: "as measured",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// Four million measurements take less.
const MAX_BYTES: u64 = 256 << 20;

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &Path| {
        let bytes = a.bytes(path, MAX_BYTES, "a table of measurements")?;
        let table = decode_astm(path, &bytes, &Limits::default())?;
        of(&table).map_err(|what| SpecError::File { file: path.display().to_string(), what })
    };
    made(a, "astm:paint.astm", read, |n| Table::of_numbers(&INFO, notes, n))
}

fn of(table: &AstmTable) -> Result<Table, String> {
    let column =
        |names: &[&str]| table.variables.iter().position(|v| names.iter().any(|n| v.eq_ignore_ascii_case(n)));
    let need = |names: &[&str]| {
        let shown = || brief(&table.variables.join(", ")).into_owned();
        column(names).ok_or_else(|| format!("has no column '{}'; it has {}", names[0], shown()))
    };
    if table.rows.len() > MAX_ROWS {
        return Err(format!("holds {} measurements; {MAX_ROWS} at most are read", table.rows.len()));
    }
    let [ti, to] = [need(&["theta_i"])?, need(&["theta_s", "theta_r"])?];
    let [pi, po] = [column(&["phi_i"]), column(&["phi_s", "phi_r"])];
    if pi.or(po).is_none() {
        return Err("has neither a column 'phi_i' nor 'phi_s'".into());
    }
    let angles = [Some(ti), pi, Some(to), po];
    let rgb = [column(&["R", "red"]), column(&["G", "green"]), column(&["B", "blue"])];
    let xyz = [column(&["X"]), column(&["Y"]), column(&["Z"])];
    let grey = (0..table.variables.len()).find(|i| !angles.contains(&Some(*i)));
    let (values, matrix) = match (rgb, xyz, grey) {
        ([Some(r), Some(g), Some(b)], _, _) => ([r, g, b], None),
        (_, [Some(x), Some(y), Some(z)], _) => ([x, y, z], Some(steradian_formats::cie::XYZ_TO_REC709)),
        (_, _, Some(grey)) => ([grey; 3], None),
        _ => return Err("has no column of values beside the angles".into()),
    };
    let steepest = table.rows.iter().map(|r| r[ti].abs().max(r[to].abs())).fold(0.0, f64::max);
    let unit = if steepest > FRAC_PI_2 + 1e-3 { 1f64.to_radians() } else { 1.0 };
    let mut samples = Samples::default();
    for row in &table.rows {
        let value = values.map(|c| row[c]);
        let value = matrix.map_or(value, |m: [[f64; 3]; 3]| {
            m.map(|m| m.iter().zip(&value).map(|(m, v)| m * v).sum::<f64>().max(0.0))
        });
        samples.push(angles.map(|c| c.map_or(0.0, |c| row[c] * unit)), value);
    }
    let isotropic = samples.one_azimuth();
    samples.table(&INFO, notes, isotropic)
}
