//! Contents of `inspect brdf:SPEC`.

use crate::spec::parameters;
use crate::{Domain, Info, SharedBrdf, SpecError, albedo, parse};
use glam::DVec3;
use std::fmt;

/// Polar angles of wo at which the directional albedo is given, in degrees.
pub const ALBEDO_DEGREES: [f64; 4] = [0.0, 30.0, 60.0, 80.0];

/// A reflectance in words and numbers; its `Display` is the text of the command.
#[derive(Debug, Clone)]
pub struct Description {
    /// The model's page.
    pub info: &'static Info,
    /// The spec string with every key written out.
    pub spec: String,
    /// Does f depend on the azimuth difference only?
    pub isotropic: bool,
    /// Directions of light for which f_cos may be non-zero.
    pub domain: Domain,
    /// Directional albedo per channel at [`ALBEDO_DEGREES`]; for anisotropic models wo lies in the plane of t
    /// and n.
    pub directional: [[f64; 3]; 4],
    /// Share of uniform light that comes back, per channel.
    pub hemispherical: [f64; 3],
    /// Findings in the measurements ([`crate::Brdf::notes`]).
    pub notes: Vec<String>,
}

/// Parses `spec` and works out its albedos, to a relative 1e-6 (directional) and 1e-4 (hemispherical).
pub fn describe(spec: &str) -> Result<Description, SpecError> {
    Ok(describe_brdf(&parse(spec)?))
}

/// The description of a reflectance that is already loaded.
pub fn describe_brdf(brdf: &SharedBrdf) -> Description {
    let at = |degrees: f64| {
        let (s, c) = degrees.to_radians().sin_cos();
        albedo::directional(&**brdf, DVec3::new(s, 0.0, c), 1e-6)
    };
    Description {
        info: brdf.info(),
        spec: brdf.spec(),
        isotropic: brdf.is_isotropic(),
        domain: brdf.domain(),
        directional: ALBEDO_DEGREES.map(at),
        hemispherical: albedo::hemispherical(&**brdf, 1e-4),
        notes: brdf.notes(),
    }
}

fn rgb(v: [f64; 3]) -> String {
    let one = |x: f64| format!("{x:.6}");
    if v[0] == v[1] && v[1] == v[2] { one(v[0]) } else { v.map(one).join(" ") }
}

impl fmt::Display for Description {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shape = if self.isotropic { "isotropic" } else { "anisotropic" };
        let over = match self.domain {
            Domain::Hemisphere => "above the horizon",
            Domain::Sphere => "over the whole sphere",
        };
        writeln!(f, "BRDF         {}", self.spec)?;
        writeln!(f, "model        {}, {shape}, {over}", self.info.name)?;
        writeln!(f, "formula      {}", self.info.formula)?;
        writeln!(f, "source       {}", self.info.source)?;
        writeln!(f, "units        {}", self.info.units)?;
        for (i, p) in parameters(self.info).iter().enumerate() {
            writeln!(f, "{:12} {}: {p}", if i == 0 { "parameters" } else { "" }, p.label())?;
        }
        writeln!(f, "reciprocity  {}", self.info.reciprocity)?;
        writeln!(f, "energy       {}", self.info.energy)?;
        for (i, note) in self.notes.iter().enumerate() {
            writeln!(f, "{:12} {note}", if i == 0 { "measured" } else { "" })?;
        }
        for (i, (degrees, a)) in ALBEDO_DEGREES.iter().zip(self.directional).enumerate() {
            let label = if i == 0 { "albedo" } else { "" };
            writeln!(f, "{label:12} at {degrees:2}° {}", rgb(a))?;
        }
        write!(f, "{:12} hemispherical {}", "", rgb(self.hemispherical))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lambert_in_words() {
        let d = describe("lambert:albedo=0.5").expect("spec");
        assert!(d.directional.iter().all(|a| (a[0] - 0.5).abs() < 1e-9));
        assert!((d.hemispherical[2] - 0.5).abs() < 1e-6);
        let text = d.to_string();
        for part in ["f = albedo/π", "Lambert 1760", "sr⁻¹", "reciprocal", "at 80° 0.500000", "scale:"] {
            assert!(text.contains(part), "{part} is not in\n{text}");
        }
        assert!(describe("lambret").is_err());
    }
}
