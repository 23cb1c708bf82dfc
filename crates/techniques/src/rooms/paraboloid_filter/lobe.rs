//! The reflectances as one lobe about r (or n).

use crate::shared::material::reflectance::Reflectance;
use std::f64::consts::PI;
use steradian_brdf::Form;

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
        match m.form() {
            Form::Lambert { albedo } => Self { n: 1.0, factor: albedo.map(|a| a / PI), about_normal: true },
            Form::Phong { n, factor, .. } => Self { n, factor, about_normal: false },
            _ => Self { n: 1.0, factor: [0.0; 3], about_normal: false },
        }
    }
}
