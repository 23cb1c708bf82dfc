//! The light's mean, the albedo, and ambient occlusion.

use super::Ambient;
use crate::certify::Report;
use crate::shared::geometry::transport::{self, PerSite};
use crate::shared::light::distant::refuse_points;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Geometry, Part, Technique};
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;
use steradian_prefilter::{Cosine, SmallLight, Zonal, source};
use steradian_sphere::sh::{self, ShRgb};
use steradian_transfer::Settings;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Approximate absolute error of ambient occlusion.
        pub precision: f64 = ParamInfo::real("precision", [1e-4, 0.1], 5e-3, "absolute error of ambient occlusion, at most about"),
    }
}

/// Highest band that enters the error estimate.
const ORDER: usize = 12;

/// The mean radiance of all light, and the error of using it.
pub struct Mean {
    pub(super) rgb: [f64; 3],
    /// Relative error where nothing is blocked: √(Σ_{l ≥ 1} A_l² |L_l|² / Σ A_l² |L_l|²).
    error: f64,
}

impl Mean {
    /// Band 0 of the light over √4π.
    pub(super) fn bake(lights: &Lights) -> Result<Self, BakeError> {
        refuse_points(Ambient::CARD.slug, lights)?;
        let image = lights.environment.as_ref();
        let mut all = image.map_or_else(|| ShRgb::zero(ORDER), |e| sh::project(&e.image, ORDER));
        let disks = lights.disks.iter().map(SmallLight::from);
        let small: Vec<SmallLight> = disks.chain(lights.directionals.iter().map(SmallLight::from)).collect();
        source::add_small_lights(&mut all, &small);
        let a = Cosine.coefficients(ORDER);
        let energy = |l: usize| -> f64 {
            let band = all.c.iter().flat_map(|c| &c[l * l..(l + 1) * (l + 1)]);
            a[l] * a[l] * band.map(|x| x * x).sum::<f64>()
        };
        let lost: f64 = (1..=ORDER).map(energy).sum();
        let whole = lost + energy(0);
        let error = if whole > 0.0 { (lost / whole).sqrt() } else { 0.0 };
        Ok(Self { rgb: [0, 1, 2].map(|c| all.c[c][0] / (4.0 * std::f64::consts::PI).sqrt()), error })
    }

    pub(super) fn report(&self) -> Report {
        Report::estimated(self.error, Vec::new())
    }
}

impl Part for Mean {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let [r, g, b] = self.rgb;
        put_f64(to, format!("{prefix}.mean_and_error"), vec![4], vec![r, g, b, self.error]);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.mean_and_error");
        let (_, v) = get_f64(from, &name, 1)?;
        let [r, g, b, error] = v.try_into().map_err(|_| PartError::Unexpected(name))?;
        Ok(Self { rgb: [r, g, b], error })
    }

    fn bytes(&self) -> usize {
        32
    }
}

/// Red, green, blue.
pub struct Colour(pub(super) [f64; 3]);

impl Colour {
    /// Lambert's albedo.
    pub(super) fn albedo(brdf: &dyn Brdf) -> Self {
        let Form::Lambert { albedo } = brdf.form() else { return Self([0.0; 3]) };
        Self(albedo)
    }
}

impl Part for Colour {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f64(to, format!("{prefix}.rgb"), vec![3], self.0.to_vec());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.rgb");
        let (_, v) = get_f64(from, &name, 1)?;
        Ok(Self(v.try_into().map_err(|_| PartError::Unexpected(name))?))
    }

    fn bytes(&self) -> usize {
        24
    }
}

/// Ambient occlusion of all sites.
pub(super) fn transfer(g: &Geometry, p: &Params, task: &Task) -> Result<PerSite, BakeError> {
    let settings = Settings { bands: 1, tolerance: p.precision, ..Settings::default() };
    let t = transport::bake(Ambient::CARD.slug, g, [0.0; 3], settings, task)?;
    Ok(PerSite { stride: 1, data: t.ao })
}
