//! Data of the ALTA library (Belcour, Barla & Pacanowski 2014): text, `.dat` or `.alta`.
//!
//! Coordinates that are read: COS_TH, COS_TH_TD, RUSIN_TH_TD, RUSIN_TH_TD_PD, RUSIN_TH_PH_TD_PD,
//! ISOTROPIC_TV_TL_DPHI, ISOTROPIC_TV_PROJ_DPHI, ISOTROPIC_TL_TV_PROJ_DPHI, SPHERICAL_TL_PL_TV_PV and
//! CARTESIAN (the view first), with L the light and V the view; a projected pair (x, y) has the polar angle
//! √(x² + y²) and the azimuth atan2(y, x) from the light's, which may be 180° away. Values are f in sr⁻¹;
//! those called INV_STERADIAN_COSINE_FACTOR are f n·wo and are divided by it. XYZ_COLOR becomes linear Rec.
//! 709; one value is grey. Where a file has half angles only, f is assumed to depend on nothing else. Between
//! the measured directions `scattered` interpolates; where values are weighted by the cosine, views within 2°
//! of the horizon do not determine f, and are missing.

use super::grid::of_half_angles;
use super::scattered::{MAX_ROWS, Samples, notes};
use super::table::Table;
use super::tabulated::make as made;
use crate::math::spherical;
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Info, SharedBrdf, SpecError};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;
use steradian_base::{ParamInfo, brief};
use steradian_formats::{AltaTable, Limits, decode_alta};

/// The page.
pub static INFO: Info = Info {
    name: "alta",
    source: "Belcour, Barla & Pacanowski 2014, the ALTA library's text; interpolated as in Kautz, Sloan & Snyder 2002",
    formula: "f between scattered measurements by radial-basis functions of half and difference angles",
    units: "sr⁻¹; XYZ as linear Rec. 709",
    parameters: &[ParamInfo::file("file", "path of a .dat or .alta text").positional()],
    reciprocity: "reciprocal",
    energy: "as measured",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// Four million measurements take less.
const MAX_BYTES: u64 = 256 << 20;
/// Smallest n·wo that f n·wo is divided by: 2° above the horizon.
const LOWEST: f64 = 0.034_899;

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &Path| {
        let bytes = a.bytes(path, MAX_BYTES, "a table of measurements")?;
        let table = decode_alta(path, &bytes, &Limits::default())?;
        of(&table).map_err(|what| SpecError::File { file: path.display().to_string(), what })
    };
    made(a, "alta:retro-gray-tape.dat", read, |n| Table::of_numbers(&INFO, notes, n))
}

/// Name of coordinates, their number, whether they can express anisotropy, and the function to light and
/// view.
type Reader = (&'static str, usize, bool, fn(&[f64]) -> (DVec3, DVec3));

fn half(angles: [f64; 4]) -> (DVec3, DVec3) {
    of_half_angles(angles)
}

fn projected(light: f64, x: f64, y: f64) -> (DVec3, DVec3) {
    (spherical(light, 0.0), spherical(x.hypot(y), y.atan2(x)))
}

const READERS: &[Reader] = &[
    ("COS_TH", 1, false, |x| half([x[0].clamp(-1.0, 1.0).acos(), 0.0, 0.0, 0.0])),
    ("COS_TH_TD", 2, false, |x| {
        half([x[0].clamp(-1.0, 1.0).acos(), 0.0, x[1].clamp(-1.0, 1.0).acos(), FRAC_PI_2])
    }),
    ("RUSIN_TH_TD", 2, false, |x| half([x[0], 0.0, x[1], FRAC_PI_2])),
    ("RUSIN_TH_TD_PD", 3, false, |x| half([x[0], 0.0, x[1], x[2]])),
    ("RUSIN_TH_PH_TD_PD", 4, true, |x| half([x[0], x[1], x[2], x[3]])),
    ("ISOTROPIC_TV_TL_DPHI", 3, false, |x| (spherical(x[1], x[2]), spherical(x[0], 0.0))),
    ("ISOTROPIC_TV_PROJ_DPHI", 2, false, |x| projected(0.0, x[0], x[1])),
    ("ISOTROPIC_TL_TV_PROJ_DPHI", 3, false, |x| projected(x[0], x[1], x[2])),
    ("SPHERICAL_TL_PL_TV_PV", 4, true, |x| (spherical(x[0], x[1]), spherical(x[2], x[3]))),
    ("CARTESIAN", 6, true, |x| {
        let unit = |x: &[f64]| DVec3::new(x[0], x[1], x[2]).normalize_or(-DVec3::Z);
        (unit(&x[3..]), unit(x))
    }),
];

fn of(table: &AltaTable) -> Result<Table, String> {
    let name = table.input.as_str();
    let Some((_, count, anisotropic, directions)) = READERS.iter().find(|r| r.0 == name) else {
        let all: Vec<&str> = READERS.iter().map(|r| r.0).collect();
        return Err(format!("has the coordinates '{}'; read are {}", brief(name), all.join(", ")));
    };
    let [nx, ny] = table.dimensions;
    if nx != *count || (ny != 1 && ny != 3) {
        return Err(format!(
            "has {nx} coordinates and {ny} values; {name} has {count}, and 1 or 3 values are read"
        ));
    }
    if table.rows.len() > MAX_ROWS {
        return Err(format!("holds {} measurements; {MAX_ROWS} at most are read", table.rows.len()));
    }
    let weighted = match table.output.as_str() {
        "INV_STERADIAN_COSINE_FACTOR" => true,
        "INV_STERADIAN" | "RGB_COLOR" | "XYZ_COLOR" | "" => false,
        other => return Err(format!("holds '{}', which is no reflectance", brief(other))),
    };
    let xyz = table.output == "XYZ_COLOR" && ny == 3;
    let mut samples = Samples::default();
    for row in &table.rows {
        let (x, y) = row.split_at(nx);
        let (wi, mut wo) = directions(x);
        let mut value = if ny == 3 { [y[0], y[1], y[2]] } else { [y[0]; 3] };
        if xyz {
            let dot = |m: [f64; 3]| m.iter().zip(&value).map(|(m, v)| m * v).sum::<f64>().max(0.0);
            value = steradian_formats::cie::XYZ_TO_REC709.map(dot);
        }
        if weighted {
            value = value.map(|v| v / wo.z.max(LOWEST));
            // Below, the quotient is noise: missing.
            wo = if wo.z < LOWEST { -DVec3::Z } else { wo };
        }
        if *count <= 2 && !name.starts_with("ISOTROPIC") {
            spread(&mut samples, x, name, value);
        } else {
            samples.add(wi, wo, value);
        }
    }
    samples.table(&INFO, notes, !anisotropic)
}

/// A measurement without θ_d or φ_d applies to all values of it.
fn spread(samples: &mut Samples, x: &[f64], name: &str, value: [f64; 3]) {
    let angle = |x: f64| if name.starts_with("COS") { x.clamp(-1.0, 1.0).acos() } else { x };
    let theta_d: Vec<f64> = match x.get(1) {
        Some(x) => vec![angle(*x)],
        None => (0..6).map(|i| 0.25 * f64::from(i)).collect(),
    };
    for theta_d in theta_d {
        for k in 0..4 {
            let (wi, wo) = of_half_angles([angle(x[0]), 0.0, theta_d, PI * f64::from(k) / 6.0]);
            samples.add(wi, wo, value);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::conformance::check_measured;
    use crate::math::spherical;
    use crate::{Files, Peak, albedo, parse_with};
    use glam::DVec3;

    #[test]
    fn retro_reflective_tapes() {
        for name in ["retro-3M-jaune", "retro-gray-tape"] {
            let Some(path) = steradian_testkit::data(&format!("brdfs/retro/{name}.dat")) else { return };
            let brdf = parse_with(&format!("alta:{}", path.display()), Files::Any).expect("valid");
            check_measured(&*brdf);
            assert!(matches!(brdf.peak(), Peak::Anywhere { .. }), "{name}: {:?}", brdf.peak());
            let tilt = 30f64.to_radians();
            let wo = spherical(tilt, 0.3);
            let (back, aside) =
                (brdf.eval(wo, wo)[0], brdf.eval(spherical(tilt, 0.3 + std::f64::consts::FRAC_PI_2), wo)[0]);
            assert!(back > 5.0 * aside, "{name}: {back} {aside}");
            let a = albedo::directional(&*brdf, wo, 1e-3);
            assert!((0.05..1.2).contains(&a[0]), "{name}: {a:?}");
        }
    }

    #[test]
    fn a_slice_of_pink_felt() {
        let Some(path) = steradian_testkit::data("brdfs/merl_reduced/pink-felt-1d.alta") else { return };
        let brdf = parse_with(&format!("alta:{}", path.display()), Files::Any).expect("valid");
        check_measured(&*brdf);
        let f = brdf.eval(DVec3::Z, DVec3::Z);
        assert!((f[0] / 0.1097 - 1.0).abs() < 0.03 && (f[2] / 0.0616 - 1.0).abs() < 0.03, "{f:?}");
    }
}
