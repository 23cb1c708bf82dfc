//! MERL's anisotropic materials (Ngan, Durand & Matusik 2005, "Experimental Analysis of BRDF Models"): tables
//! in the polar angles of light and view, the difference of their azimuths and the light's azimuth, linear
//! between the centres of cells and constant beyond the outermost. A cell with a negative channel was not
//! measured: it takes the nearest cell at a smaller polar angle of the view, else at a greater one, else
//! along the light's.

use super::grid::{Coordinates, Grid};
use super::table::{Counts, Table};
use super::tabulated::make as made;
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Info, SharedBrdf, SpecError};
use std::path::Path;
use steradian_base::ParamInfo;
use steradian_formats::{Limits, MerlAnisotropic, decode_merl_anisotropic};

/// The page.
pub static INFO: Info = Info {
    name: "merl-aniso",
    source: "Ngan, Durand & Matusik 2005",
    formula: "f linear between measured cells in θ_i, θ_o, φ_o − φ_i and φ_i; missing cells take the nearest at smaller θ_o",
    units: "sr⁻¹, as the file has them",
    parameters: &[ParamInfo::file("file", "path of an anisotropic .binary file").positional()],
    reciprocity: "as measured",
    energy: "as measured",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// 45 × 45 × 180 × 90 cells take 376 MiB.
const MAX_BYTES: u64 = 1 << 29;

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &Path| {
        let bytes = a.bytes(path, MAX_BYTES, "an anisotropic MERL table")?;
        let table = decode_merl_anisotropic(path, &bytes, &Limits::default())?;
        of(&table).ok_or_else(|| SpecError::File {
            file: path.display().to_string(),
            what: "every cell is negative: nothing was measured".into(),
        })
    };
    made(a, "merl-aniso:brushed.binary", read, |n| Table::of_numbers(&INFO, notes, n))
}

fn of(table: &MerlAnisotropic) -> Option<Table> {
    let [r, g, b] = &table.channels;
    let mut counts = Counts { all: r.len(), ..Counts::default() };
    let cell = |i: usize| {
        let v = [r[i], g[i], b[i]];
        let measured = v.iter().all(|v| (0.0..=1e30).contains(v));
        counts.missing += usize::from(!measured);
        if measured { v } else { [f32::NAN; 3] }
    };
    let cells = (0..r.len()).map(cell).collect();
    let grid = Grid::filled(Coordinates::Differences, table.dimensions, cells, &[1, 0])?;
    Some(Table { info: &INFO, notes, counts, grid })
}

fn notes(table: &Table) -> Vec<String> {
    let Counts { all, missing, .. } = table.counts;
    vec![
        format!("{missing} of {all} cells are negative: missing, filled from smaller θ_o"),
        format!("the brightest cell is {:.4} sr⁻¹", table.brightest()),
    ]
}

#[cfg(test)]
mod tests {
    use crate::conformance::check_measured;
    use crate::math::spherical;
    use crate::{Files, parse, parse_with};
    use std::f64::consts::{FRAC_PI_2, TAU};

    #[test]
    fn a_small_table_of_a_known_model() {
        let model = parse("ward:ax=0.3,ay=0.6,rd=0.3").expect("spec");
        let path = std::env::temp_dir().join(format!("steradian-aniso-{}.binary", std::process::id()));
        let [nt, nd, ni] = [15usize, 36, 24];
        let mut head = [0i32; 16];
        head[..4].copy_from_slice(&[nt, nt, nd, ni].map(|n| n as i32));
        head[10] = 3;
        let mut bytes: Vec<u8> = head.iter().flat_map(|v| v.to_le_bytes()).collect();
        for c in 0..3 {
            for cell in 0..nt * nt * nd * ni {
                let at = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
                let (i, o) = (cell / (ni * nd * nt), cell / (ni * nd) % nt);
                let phi_i = TAU * at(cell % ni, ni);
                let phi_o = phi_i + TAU * at(cell / ni % nd, nd);
                let wi = spherical(FRAC_PI_2 * at(i, nt), phi_i);
                let wo = spherical(FRAC_PI_2 * at(o, nt), phi_o);
                let f = if o == nt - 1 { -1.0 } else { model.eval(wi, wo)[c] };
                bytes.extend((f as f32).to_le_bytes());
            }
        }
        std::fs::write(&path, &bytes).expect("written");
        let spec = format!("merl-aniso:{}", path.display());
        let brdf = parse_with(&spec, Files::Any).expect("valid");
        check_measured(&*brdf);
        assert!(!brdf.is_isotropic());
        assert!(brdf.notes()[0].starts_with(&format!("{} of ", nt * nd * ni)), "{:?}", brdf.notes());
        let mut off: Vec<f64> = crate::measured::nbrdf::pairs(300)
            .map(|(i, o)| (model.eval(i, o)[0] / brdf.eval(i, o)[0]).ln().abs())
            .collect();
        off.sort_by(f64::total_cmp);
        assert!(off[270] < 0.15, "{}", off[270]);
        std::fs::remove_file(&path).expect("removed");
    }
}
