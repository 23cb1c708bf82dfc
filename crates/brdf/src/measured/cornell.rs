//! Spectral measurements of Cornell's Program of Computer Graphics (`.brdf`): isotropic paints, 1439 pairs of
//! directions with 31 wavelengths each (Foo 1997, "A Gonioreflectometer for Measuring the Bidirectional
//! Reflectance of Material for Use in Illumination Computation").
//!
//! Spectra become linear Rec. 709 such that a flat one is grey, negative channels are set to 0; between the
//! measured directions `scattered` interpolates. Single wavelengths that are negative are noise about zero
//! and count as 0.

use super::scattered::{MAX_ROWS, Samples, notes};
use super::spectrum;
use super::table::Table;
use super::tabulated::make as made;
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Info, SharedBrdf, SpecError};
use std::path::Path;
use steradian_base::ParamInfo;
use steradian_formats::{CornellTable, Limits, decode_cornell};

/// The page.
pub static INFO: Info = Info {
    name: "cornell",
    source: "Cornell Program of Computer Graphics; Foo 1997; interpolated as in Kautz, Sloan & Snyder 2002",
    formula: "f between scattered measurements by radial-basis functions of half and difference angles",
    units: "sr⁻¹; spectra as linear Rec. 709, a flat one grey",
    parameters: &[ParamInfo::file("file", "path of a .brdf file").positional()],
    reciprocity: "reciprocal",
    energy: "as measured",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// A published file has 450 KiB.
const MAX_BYTES: u64 = 256 << 20;

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &Path| {
        let bytes = a.bytes(path, MAX_BYTES, "measured spectra")?;
        let table = decode_cornell(path, &bytes, &Limits::default())?;
        of(&table).map_err(|what| SpecError::File { file: path.display().to_string(), what })
    };
    made(a, "cornell:acryl_blue.brdf", read, |n| Table::of_numbers(&INFO, notes, n))
}

fn of(table: &CornellTable) -> Result<Table, String> {
    let weights = spectrum::weights_of(&table.wavelengths)?;
    if table.angles.len() > MAX_ROWS {
        return Err(format!("holds {} measurements; {MAX_ROWS} at most are read", table.angles.len()));
    }
    let mut samples = Samples::default();
    for (angles, spectrum) in table.angles.iter().zip(table.values.chunks_exact(weights.len())) {
        let sum = |c: usize| spectrum.iter().zip(&weights).map(|(v, w)| v.max(0.0) * w[c]).sum::<f64>();
        samples.push(*angles, [0, 1, 2].map(|c| sum(c).max(0.0)));
    }
    samples.note_negative(table.values.iter().filter(|v| **v < 0.0).count());
    let isotropic = samples.one_azimuth();
    samples.table(&INFO, notes, isotropic)
}

#[cfg(test)]
mod tests {
    use crate::conformance::check_measured;
    use crate::{Files, albedo, parse_with};
    use glam::DVec3;

    #[test]
    fn the_published_paints() {
        for (name, bright) in
            [("acryl_blue", 2), ("cayman", 2), ("garnet_red", 0), ("krylon_blue", 2), ("mystique", 2)]
        {
            let Some(path) = steradian_testkit::data(&format!("brdfs/cornell/{name}.brdf")) else { return };
            let brdf = parse_with(&format!("cornell:{}", path.display()), Files::Any).expect("valid");
            check_measured(&*brdf);
            let a = albedo::directional(&*brdf, DVec3::Z, 1e-4);
            assert!(a.iter().all(|v| (0.0..1.0).contains(v)), "{name}: {a:?}");
            let top = (0..3).max_by(|x, y| a[*x].total_cmp(&a[*y])).unwrap_or_default();
            assert!(top == bright || name == "cayman" || name == "mystique", "{name}: {a:?}");
            let held = brdf.held().expect("numbers");
            let again = parse_with(&brdf.spec(), Files::Held(&held)).expect("held");
            assert_eq!(again.notes(), brdf.notes());
        }
    }
}
