//! Lafortune lobes from a CSV file.
//!
//! Lines are `lobe,CHANNEL,cx,cy,cz,n` with an optional seventh field ks (1 where it is missing), or
//! `diffuse,CHANNEL,kd`; CHANNEL is 0, 1, 2 or `*` for all. Blank lines and lines that begin with `#` are
//! skipped. Every lobe line adds a lobe to its channels.

use super::lafortune::{Cosine, Lafortune};
use crate::SpecError;
use crate::spec::Args;
use glam::DVec3;
use std::path::Path;

/// More than any set of lobes needs.
const MAX_BYTES: u64 = 1 << 20;

/// Reads the file; `spec` is the canonical spec of the reflectance.
pub(crate) fn read(file: &Path, spec: String, a: &Args<'_>) -> Result<Lafortune, SpecError> {
    let text = a.read(file, MAX_BYTES, "a file of Lafortune lobes")?;
    parse(&text, spec).map_err(|what| SpecError::File { file: file.display().to_string(), what })
}

/// Parses the text of a file.
pub(crate) fn parse(text: &str, spec: String) -> Result<Lafortune, String> {
    let mut brdf = Lafortune { spec, kd: [0.0; 3], lobes: Vec::new() };
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if !line.is_empty() && !line.starts_with('#') {
            add(&mut brdf, line).map_err(|e| format!("line {}: {e}", i + 1))?;
        }
    }
    if brdf.lobes.is_empty() && brdf.kd == [0.0; 3] {
        return Err("no lobes in it: write lines lobe,CHANNEL,cx,cy,cz,n or diffuse,CHANNEL,kd".into());
    }
    Ok(brdf)
}

fn add(brdf: &mut Lafortune, line: &str) -> Result<(), String> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    let channels = channels(fields.get(1).copied().unwrap_or_default())?;
    let values: Result<Vec<f64>, String> = fields.iter().skip(2).map(|f| number(f)).collect();
    match (fields[0], values?.as_slice()) {
        ("diffuse", &[kd]) if (0.0..=1.0).contains(&kd) => channels.for_each(|c| brdf.kd[c] = kd),
        ("lobe", &[cx, cy, cz, n]) => push(brdf, channels, [cx, cy, cz, n, 1.0])?,
        ("lobe", &[cx, cy, cz, n, ks]) => push(brdf, channels, [cx, cy, cz, n, ks])?,
        _ => return Err(format!("'{line}' is neither lobe,CHANNEL,cx,cy,cz,n[,ks] nor diffuse,CHANNEL,kd")),
    }
    Ok(())
}

fn push(brdf: &mut Lafortune, channels: impl Iterator<Item = usize>, v: [f64; 5]) -> Result<(), String> {
    let [cx, cy, cz, n, ks] = v;
    if !(0.0..=1e8).contains(&n) || ks < 0.0 {
        return Err(format!("n = {n} must be in 0 … 1e8 and ks = {ks} at least 0"));
    }
    let none = Cosine { c: DVec3::Z, n: 0.0, ks: 0.0 };
    let mut lobe = [none; 3];
    channels.for_each(|c| lobe[c] = Cosine { c: DVec3::new(cx, cy, cz), n, ks });
    brdf.lobes.push(lobe);
    Ok(())
}

fn channels(text: &str) -> Result<std::ops::Range<usize>, String> {
    match text {
        "*" => Ok(0..3),
        "0" => Ok(0..1),
        "1" => Ok(1..2),
        "2" => Ok(2..3),
        _ => Err(format!("channel '{text}' is not 0, 1, 2 or *")),
    }
}

fn number(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|x: &f64| x.is_finite())
        .ok_or_else(|| format!("'{text}' is not a finite number"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Brdf;

    #[test]
    fn a_file_of_the_documented_form() {
        let text = "# skin\ndiffuse,*,0.3\ndiffuse,2,0.1\nlobe,*,-1,-1,1,20\nlobe,0,-0.5,-0.5,0.4,3,0.25\n";
        let b = parse(text, String::new()).expect("well formed");
        assert_eq!(b.kd, [0.3, 0.3, 0.1]);
        let wo = DVec3::new(0.6, 0.0, 0.8);
        let f = b.eval(DVec3::new(-0.6, 0.0, 0.8), wo);
        let pi = std::f64::consts::PI;
        assert!((f[0] - (0.3 / pi + 1.0 + 0.25 * (0.5 * 0.36 + 0.4 * 0.64f64).powi(3))).abs() < 1e-12);
        assert!((f[2] - (0.1 / pi + 1.0)).abs() < 1e-12);
    }

    #[test]
    fn faults_name_the_line() {
        for (text, part) in [
            ("lobe,3,1,1,1,1", "line 1: channel '3'"),
            ("\nlobe,*,1,1", "line 2: 'lobe,*,1,1'"),
            ("lobe,*,1,1,1,NaN", "'NaN'"),
            ("lobe,*,1,1,1,-2", "n = -2"),
            ("diffuse,*,2", "neither"),
            ("", "no lobes"),
            ("x", "channel ''"),
        ] {
            let e = parse(text, String::new()).expect_err(text);
            assert!(e.contains(part), "{text}: {e}");
        }
    }
}
