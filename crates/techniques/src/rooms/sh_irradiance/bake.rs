//! Nine coefficients of the light, the albedo, and the matrix that they give.

use super::ShIrradiance;
use crate::certify::Report;
use crate::shared::light::distant::refuse_points;
use crate::shared::maths::quadric::Quadric;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Part, Technique};
use std::f64::consts::PI;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;
use steradian_prefilter::{Cosine, SmallLight, Zonal, probe, source};
use steradian_sphere::sh::{self, ShRgb};

/// Highest band that enters the error estimate.
const ORDER: usize = 24;

/// The light's spectrum up to `ORDER`; shading uses bands 0 to 2.
pub struct Light(ShRgb);

impl Light {
    pub(super) fn bake(lights: &Lights) -> Result<Self, BakeError> {
        refuse_points(ShIrradiance::CARD.slug, lights)?;
        let mut all = match &lights.environment {
            Some(e) => sh::project(&e.image, ORDER),
            None => ShRgb::zero(ORDER),
        };
        let disks = lights.disks.iter().map(SmallLight::from);
        let small_lights: Vec<SmallLight> =
            disks.chain(lights.directionals.iter().map(SmallLight::from)).collect();
        source::add_small_lights(&mut all, &small_lights);
        Ok(Self(all))
    }

    /// The relative RMS error over normals is the energy of irradiance in the bands left out over that in
    /// all: √(Σ_{l>2} A_l² |L_l|² / Σ A_l² |L_l|²) (Parseval), with bands above `ORDER` left out of both.
    pub(super) fn report(&self, quadric: &Quadric) -> Report {
        let a = Cosine.coefficients(ORDER);
        let energy = |l: usize| -> f64 {
            let band = self.0.c.iter().flat_map(|c| &c[l * l..(l + 1) * (l + 1)]);
            a[l] * a[l] * band.map(|x| x * x).sum::<f64>()
        };
        let all: f64 = (0..=ORDER).map(energy).sum();
        let lost: f64 = (3..=ORDER).map(energy).sum();
        let error = if all > 0.0 { (lost / all).sqrt() } else { 0.0 };
        Report::estimated(error, Vec::new())
            .detail("order", 2.0)
            .detail("lowest radiance over mean", lowest(quadric))
    }
}

/// The most negative value relative to the mean: behind a lone small light nine coefficients fall below zero.
fn lowest(q: &Quadric) -> f64 {
    let values: Vec<_> = (0..512).map(|k| q.value(probe::direction(k, 512).as_vec3().to_array())).collect();
    let all = || values.iter().flatten().map(|&x| f64::from(x));
    let mean = all().sum::<f64>() / 1536.0;
    let low = all().fold(f64::INFINITY, f64::min);
    if mean > 0.0 { low / mean } else { 0.0 }
}

impl Part for Light {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f64(to, format!("{prefix}.radiance_sh"), vec![3, sh::count(ORDER)], self.0.c.concat());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.radiance_sh");
        let (shape, v) = get_f64(from, &name, 2)?;
        if shape != [3, sh::count(ORDER)] {
            return Err(PartError::Unexpected(name));
        }
        let mut rows = v.chunks(sh::count(ORDER)).map(<[f64]>::to_vec);
        Ok(Self(ShRgb { order: ORDER, c: std::array::from_fn(|_| rows.next().unwrap_or_default()) }))
    }

    fn bytes(&self) -> usize {
        24 * sh::count(ORDER)
    }
}

/// Lambert's albedo.
pub struct Albedo(pub(super) [f64; 3]);

impl Albedo {
    pub(super) fn of(brdf: &dyn Brdf) -> Self {
        let Form::Lambert { albedo } = brdf.form() else { return Self([0.0; 3]) };
        Self(albedo)
    }
}

impl Part for Albedo {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f64(to, format!("{prefix}.albedo"), vec![3], self.0.to_vec());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.albedo");
        let (_, v) = get_f64(from, &name, 1)?;
        Ok(Self(v.try_into().map_err(|_| PartError::Unexpected(name))?))
    }

    fn bytes(&self) -> usize {
        24
    }
}

/// L_o(n) = (albedo/π) Σ_{l ≤ 2} A_l L_lm Y_lm(n) as a quadric.
pub(super) fn link(light: &Light, albedo: &Albedo) -> Quadric {
    let a = Cosine.coefficients(2);
    Quadric::new(&light.0, albedo.0.map(|rho| std::array::from_fn(|l| rho / PI * a[l])))
}
