//! MERL's tables of isotropic reflectance, and tables made of any other.
//!
//! Matusik, Pfister, Brand & McMillan 2003, A Data-Driven Reflectance Model; coordinates of Rusinkiewicz
//! 1998, A New Change of Variables for Efficient BRDF Representation: the angle θ_h of the half vector, and
//! the light's direction about it (θ_d, φ_d). A file holds 90 × 90 × 180 cells per channel, at
//!
//! i_h + ½ = 90 √(θ_h/(π/2)), i_d + ½ = 90 θ_d/(π/2), i_φ + ½ = 180 φ_d/π,
//!
//! φ_d modulo π because f is reciprocal, in units of 1/1500, 1.15/1500 and 1.66/1500 sr⁻¹ for red, green and
//! blue. Between the centres of cells f is trilinear in these coordinates; beyond the outermost centres it is
//! constant (φ_d wraps).
//!
//! A cell with a negative value in any channel was not measured: it is missing, not black. It takes the value
//! of the nearest cell at smaller θ_d with the same θ_h and φ_d (light and view both away from the horizon);
//! where there is none, of the nearest at greater θ_d; where the whole row is missing, of the same cell of
//! the row with the next smaller θ_h. Cells whose centre has light or view below the horizon mean nothing and
//! are filled alike, for the interpolation.

use super::grid::{Coordinates, Grid, MERL};
use super::table::{Counts, Table};
use super::tabulated::make as made;
use crate::math::above;
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Brdf, Info, SharedBrdf, SpecError};
use steradian_base::{Cancelled, ParamInfo, Task};
use steradian_formats::{Limits, MERL_BYTES, MERL_CELLS, MerlTable, decode_merl};
use steradian_parallel::prelude::*;

/// The page.
pub static INFO: Info = Info {
    name: "merl",
    source: "Matusik, Pfister, Brand & McMillan 2003; coordinates: Rusinkiewicz 1998",
    formula: "f trilinear between 90 × 90 × 180 measured cells in √θ_h, θ_d and φ_d; missing cells take the nearest at smaller θ_d",
    units: "sr⁻¹",
    parameters: &[ParamInfo::file("file", "path of a .binary file").positional()],
    reciprocity: "reciprocal",
    energy: "as measured",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// sr⁻¹ per unit of the file.
const UNITS: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
const SLICE: usize = MERL[2] * MERL[3];

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &std::path::Path| {
        let bytes = a.bytes(path, MERL_BYTES, "a MERL table")?;
        let table = decode_merl(path, &bytes, &Limits::default())?;
        of(&table).ok_or_else(|| SpecError::File {
            file: path.display().to_string(),
            what: "every cell above the horizon is negative: nothing was measured".into(),
        })
    };
    let keep = |numbers: &[f64]| Table::of_numbers(&INFO, notes, numbers);
    made(a, "merl:gold-metallic-paint.binary", read, keep)
}

/// The table that `brdf` would have been measured as; cells below the horizon are −1. The reflectance must be
/// isotropic.
pub fn tabulate(brdf: &dyn Brdf, task: &Task) -> Result<MerlTable, Cancelled> {
    task.begin("tabulating", MERL[0] as u64);
    let slices: Vec<Vec<[f64; 3]>> = (0..MERL[0])
        .into_par_iter()
        .map(|h| {
            if task.is_cancelled() {
                return Vec::new();
            }
            let cell = |i: usize| {
                let (wi, wo) = Grid::centre(MERL, h * SLICE + i);
                if !above(wi, wo) {
                    return [-1.0; 3];
                }
                let f = brdf.eval(wi, wo);
                std::array::from_fn(|c| if f[c].is_finite() { f[c] / UNITS[c] } else { -1.0 })
            };
            let slice = (0..SLICE).map(cell).collect();
            task.advance(1);
            slice
        })
        .collect();
    task.end();
    task.check()?;
    let channel = |c: usize| slices.iter().flatten().map(|v| v[c]).collect();
    Ok(MerlTable { channels: [channel(0), channel(1), channel(2)] })
}

/// The reflectance of a table; `None` where nothing in it was measured.
fn of(table: &MerlTable) -> Option<Table> {
    let [r, g, b] = &table.channels;
    if [r, g, b].iter().any(|c| c.len() != MERL_CELLS) {
        return None;
    }
    let mut counts = Counts::default();
    let cell = |(i, above): (usize, bool)| {
        let v = [r[i] * UNITS[0], g[i] * UNITS[1], b[i] * UNITS[2]].map(|v| v as f32);
        let measured = v.iter().all(|v| v.is_finite() && *v >= 0.0);
        if above {
            counts.all += 1;
            counts.missing += usize::from(!measured);
        }
        if measured && above { v } else { [f32::NAN; 3] }
    };
    let [nh, _, nd, nt] = MERL;
    let cells = Grid::centres_above([nh, nd, nt]).enumerate().map(cell).collect();
    let grid = Grid::filled(Coordinates::Half, MERL, cells, &[2, 0])?;
    Some(Table { info: &INFO, notes, counts, grid })
}

fn notes(table: &Table) -> Vec<String> {
    let Counts { all, missing, .. } = table.counts;
    let share = 100.0 * missing as f64 / all.max(1) as f64;
    vec![
        format!(
            "{missing} of {all} cells above the horizon are negative ({share:.1} %): missing, filled from smaller θ_d"
        ),
        format!("the brightest cell is {:.4} sr⁻¹", table.brightest()),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::tabulated::Measured;
    use super::*;
    use crate::conformance::check_measured;
    use crate::math::spherical;
    use crate::{Files, parse, parse_with};
    use glam::DVec3;
    use std::f64::consts::PI;
    use steradian_formats::write_merl;

    const DIFF: usize = MERL[2];
    const TURN: usize = MERL[3];

    fn centre(h: usize, d: usize, p: usize) -> (DVec3, DVec3) {
        Grid::centre(MERL, (h * DIFF + d) * TURN + p)
    }

    fn merl(table: &MerlTable) -> Measured<Table> {
        Measured::new("merl:a".into(), of(table).expect("measured"))
    }

    fn table(spec: &str) -> MerlTable {
        tabulate(&*parse(spec).expect(spec), &Task::quiet()).expect("not cancelled")
    }

    /// Away from grazing angles a table reproduces its formula; chrome's peak bends between cells.
    #[test]
    fn a_formula_tabulated_and_read_back() {
        for (spec, tolerance) in [
            ("ggx:alpha=0.3,f0=0.9/0.5/0.1", 4e-3),
            ("lambert:albedo=0.8/0.5/0.2", 1e-6),
            ("abc:chrome", 0.12),
        ] {
            let brdf = parse(spec).expect(spec);
            let merl = merl(&table(spec));
            for i in 0..400 {
                let u = |g: f64| (0.5 + g * f64::from(i)).fract();
                let wi = spherical(1.2 * u(0.819_172_5), std::f64::consts::TAU * u(0.671_043_6));
                let wo = spherical(1.2 * u(0.549_700_5), std::f64::consts::TAU * u(0.450_477_3));
                let (a, b) = (brdf.eval(wi, wo), merl.eval(wi, wo));
                for c in 0..3 {
                    assert!((a[c] - b[c]).abs() <= tolerance * a[c], "{spec} {wi} {wo}: {a:?} {b:?}");
                }
            }
            assert!(merl.notes()[0].starts_with("0 of "), "{:?}", merl.notes());
        }
    }

    #[test]
    fn centres_of_cells_hold_the_measurement_and_reciprocity_is_exact() {
        let table = table("sgd:gold-metallic-paint");
        let merl = merl(&table);
        for (h, d, p) in [(0, 0, 0), (3, 7, 179), (40, 20, 90), (10, 60, 33)] {
            let (wi, wo) = centre(h, d, p);
            let i = (h * DIFF + d) * TURN + p;
            for (v, w) in [(wi, wo), (wo, wi)] {
                let f = merl.eval(v, w);
                for c in 0..3 {
                    let want = table.channels[c][i] * UNITS[c];
                    assert!((f[c] - want).abs() < 1e-5 * want, "{h} {d} {p}: {} {want}", f[c]);
                }
            }
        }
    }

    #[test]
    fn missing_cells_are_filled_and_counted() {
        let mut table = table("lambert:albedo=0.5");
        let at = |h: usize, d: usize, p: usize| (h * DIFF + d) * TURN + p;
        for d in 10..20 {
            table.channels[1][at(5, d, 7)] = -0.1;
        }
        let merl = merl(&table);
        let (wi, wo) = centre(5, 15, 7);
        assert!((merl.eval(wi, wo)[1] - 0.5 / PI).abs() < 1e-6);
        assert!(merl.notes()[0].starts_with("10 of "));
        table.channels.iter_mut().flatten().for_each(|v| *v = -1.0);
        assert!(of(&table).is_none());
    }

    #[test]
    fn a_file_is_a_whole_reflectance() {
        let folder = std::env::temp_dir().join(format!("steradian-merl-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("m.binary");
        for spec in ["abc:chrome", "sgd:blue-acrylic", "lambert:albedo=0.5"] {
            write_merl(&path, &table(spec)).expect("written");
            let spec = format!("merl:{}", path.display());
            let brdf = parse_with(&spec, Files::Any).expect("valid");
            check_measured(&*brdf);
            let held = brdf.held().expect("numbers");
            let again = parse_with(&brdf.spec(), Files::Held(&held)).expect("held");
            let (wi, wo) = (spherical(0.4, 1.0), spherical(0.5, 4.0));
            assert_eq!(brdf.eval(wi, wo), again.eval(wi, wo));
            assert!(parse_with(&brdf.spec(), Files::Held(&held[..100])).is_err());
        }
        std::fs::write(&path, [0; 100]).expect("written");
        let e = parse_with(&format!("merl:{}", path.display()), Files::Any).expect_err("short").to_string();
        assert!(e.contains("m.binary: its dimensions are 0 x 0 x 0"), "{e}");
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}
