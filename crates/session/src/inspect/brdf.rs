//! Facts of a reflectance.

use crate::{Error, Method, Session};
use glam::DVec3;
use steradian_brdf::{Brdf, Info, SharedBrdf, albedo};

/// View angles of the albedo table, degrees.
const ANGLES: [f64; 6] = [0.0, 30.0, 60.0, 75.0, 85.0, 89.0];
/// Relative tolerance of the directional albedos, and of the hemispherical one.
const TOLERANCES: [f64; 2] = [1e-5, 1e-4];
/// Those of reflectances from files, which are measured or fitted to a hundredth at best: interpolation
/// between their values has creases, at which more digits of a table of MERL's size take 3.5 seconds.
const OF_FILES: [f64; 2] = [1e-3, 1e-3];

/// Facts of a reflectance, in addition to its model's own description.
#[derive(Debug, Clone)]
pub struct BrdfFacts {
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// Albedo by the angle of view, degrees.
    pub directional: Vec<(f64, [f64; 3])>,
    /// Albedo under uniform light from the whole hemisphere.
    pub hemispherical: [f64; 3],
    /// Deviation from reciprocity ([`super::reciprocity_error`]).
    pub reciprocity_error: f64,
    /// Slugs of the techniques that accept it, and of the methods that need none.
    pub techniques: Vec<&'static str>,
}

/// All models: formulas, then measurements.
pub fn brdf_models() -> Vec<&'static Info> {
    steradian_brdf::models().iter().chain(steradian_brdf::measured_models()).copied().collect()
}

impl BrdfFacts {
    /// The largest albedo of any channel, and the angle of view: above 1 energy is made.
    pub fn largest_albedo(&self) -> (f64, f64) {
        let channels = self.directional.iter().flat_map(|(a, v)| v.map(|x| (*a, x)));
        channels.fold((0.0, 0.0), |most, x| if x.1 > most.1 { x } else { most })
    }
}

impl Session {
    /// Facts of the reflectance of a spec.
    pub fn inspect_brdf(&mut self, spec: &str) -> Result<BrdfFacts, Error> {
        let brdf = self.brdf(spec)?;
        let [directional, hemispherical] = if brdf.held().is_some() { OF_FILES } else { TOLERANCES };
        let of = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            albedo::directional(&*brdf, DVec3::new(sin, 0.0, cos), directional)
        };
        Ok(BrdfFacts {
            directional: ANGLES.iter().map(|a| (*a, of(*a))).collect(),
            hemispherical: albedo::hemispherical(&*brdf, hemispherical),
            reciprocity_error: super::reciprocity_error(&*brdf),
            techniques: techniques(&*brdf),
            brdf,
        })
    }
}

fn techniques(brdf: &dyn Brdf) -> Vec<&'static str> {
    let takes = |m: &Method| match m {
        Method::Technique(t) => (t.card().materials)(brdf).is_ok(),
        _ => true,
    };
    Method::slugs().into_iter().filter(|slug| Method::find(slug).is_ok_and(|m| takes(&m))).collect()
}
