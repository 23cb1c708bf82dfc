//! The light's coefficients, the albedo, and transfer vectors.

use super::PrtDiffuse;
use crate::certify::Report;
use crate::shared::distant::refuse_points;
use crate::shared::transport::{self, PerSite};
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Geometry, Part, Technique};
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;
use steradian_prefilter::{Cosine, SmallLight, Zonal, source};
use steradian_sphere::sh::{self, ShRgb, Window};
use steradian_transfer::Settings;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Bands of light and transfer.
        pub bands: usize = ParamInfo::whole("bands", [1.0, 6.0], 5.0, "bands of spherical harmonics"),
        /// Scattering events.
        pub bounces: usize = ParamInfo::whole("bounces", [1.0, 64.0], 1.0, "scattering events at surfaces: 1 is direct light alone"),
        /// Absolute error of the coefficients of transfer.
        pub precision: f64 = ParamInfo::real("precision", [1e-4, 0.1], 5e-3, "absolute error of the coefficients of transfer"),
        /// Where the window ends; 0 for none.
        pub window: f64 = ParamInfo::real("window", [0.0, 32.0], 0.0, "band at which a window of Hann ends that takes ringing off the light; 0: none"),
        /// 16-bit transfer.
        pub halves: bool = ParamInfo::switch("halves", false, "transfer of 16-bit floats"),
    }
}

/// Highest band that the estimate of the error looks at.
const ORDER: usize = 24;

/// The light's spectrum up to `ORDER`; shading uses its first bands.
pub struct Light(ShRgb);

impl Light {
    pub(super) fn bake(lights: &Lights, p: &Params) -> Result<Self, BakeError> {
        refuse_points(PrtDiffuse::CARD.slug, lights)?;
        let mut all = match &lights.environment {
            Some(e) => sh::project(&e.image, ORDER),
            None => ShRgb::zero(ORDER),
        };
        let disks = lights.disks.iter().map(SmallLight::from);
        let small_lights: Vec<SmallLight> =
            disks.chain(lights.directionals.iter().map(SmallLight::from)).collect();
        source::add_small_lights(&mut all, &small_lights);
        if p.window > 0.0 {
            all.window(Window::Hanning { width: p.window });
        }
        Ok(Self(all))
    }

    /// The first bands.
    pub(super) fn bands(&self, bands: usize) -> ShRgb {
        let n = bands * bands;
        ShRgb { order: bands - 1, c: self.0.c.each_ref().map(|c| c[..n].to_vec()) }
    }

    /// What is left out where nothing is blocked, by Parseval: √(Σ_{l ≥ bands} A_l² |L_l|² / Σ A_l² |L_l|²).
    pub(super) fn report(&self, p: &Params) -> Report {
        let a = Cosine.coefficients(ORDER);
        let energy = |l: usize| -> f64 {
            let band = self.0.c.iter().flat_map(|c| &c[l * l..(l + 1) * (l + 1)]);
            a[l] * a[l] * band.map(|x| x * x).sum::<f64>()
        };
        let all: f64 = (0..=ORDER).map(energy).sum();
        let lost: f64 = (p.bands..=ORDER).map(energy).sum();
        let error = if all > 0.0 { (lost / all).sqrt() } else { 0.0 };
        Report::estimated(error, Vec::new())
    }
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

/// Transfer vectors of all sites, one or three each.
pub(super) fn transfer(g: &Geometry, m: &Albedo, p: &Params, task: &Task) -> Result<PerSite, BakeError> {
    let settings =
        Settings { bands: p.bands, tolerance: p.precision, bounces: p.bounces as u32, ..Settings::default() };
    let t = transport::bake(PrtDiffuse::CARD.slug, g, m.0, settings, task)?;
    let all = PerSite { stride: t.channels * p.bands * p.bands, data: t.t };
    Ok(if p.halves { all.rounded() } else { all })
}
