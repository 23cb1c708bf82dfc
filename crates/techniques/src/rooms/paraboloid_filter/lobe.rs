//! The reflectances as one lobe about r (or n).

use crate::shared::reflectance::Reflectance;
use glam::DVec3;
use std::f64::consts::PI;

/// factor · (axis·wi)₊^n.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhongLobe {
    /// Exponent.
    pub n: f64,
    /// Everything before the power.
    pub factor: [f64; 3],
    /// Is the axis the normal rather than the mirror direction?
    pub about_normal: bool,
}

impl PhongLobe {
    /// The lobe of a reflectance that the Card takes.
    pub fn new(m: &Reflectance) -> Self {
        let scale = m.scale();
        let number = |key: &str| m.get(key).map_or(1.0, |v| v[0]);
        match m.name() {
            "lambert" => Self { n: 1.0, factor: m.brdf.eval(DVec3::Z, DVec3::Z), about_normal: true },
            "phong-normalized" => {
                let s = number("s");
                let factor = scale.map(|k| k * (s + 1.0) / (2.0 * PI));
                Self { n: s, factor, about_normal: false }
            }
            _ => Self { n: number("n"), factor: scale, about_normal: false },
        }
    }
}
