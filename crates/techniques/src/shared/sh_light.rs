//! Light and reflectance of techniques with sites that shade diffuse surfaces by spherical harmonics.

use crate::certify::Report;
use crate::shared::distant::refuse_points;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Part};
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;
use steradian_prefilter::{Cosine, SmallLight, Zonal, source};
use steradian_sphere::sh::{self, ShRgb, Window};

/// Highest band that the estimate of the error looks at.
const ORDER: usize = 24;

/// The light's spectrum up to `ORDER`; shading uses its first bands.
pub struct ShLight {
    /// What arrives straight.
    direct: ShRgb,
    /// What surfaces reflect: with the suns that are shaded exactly.
    reflected: ShRgb,
}

/// Adds disks and directional lights.
fn add_suns(lights: &Lights, to: &mut ShRgb) {
    let disks = lights.disks.iter().map(SmallLight::from);
    let all: Vec<SmallLight> = disks.chain(lights.directionals.iter().map(SmallLight::from)).collect();
    source::add_small_lights(to, &all);
}

impl ShLight {
    /// Analyses `lights`; a window of Hann that ends at band `window` takes ringing off, 0 is none.
    pub(crate) fn bake(slug: &'static str, lights: &Lights, window: f64) -> Result<Self, BakeError> {
        refuse_points(slug, lights)?;
        let mut direct = match &lights.environment {
            Some(e) => sh::project(&e.image, ORDER),
            None => ShRgb::zero(ORDER),
        };
        add_suns(lights, &mut direct);
        let mut reflected = direct.clone();
        if let Some(apart) = &lights.apart {
            add_suns(apart, &mut reflected);
        }
        if window > 0.0 {
            direct.window(Window::Hanning { width: window });
            reflected.window(Window::Hanning { width: window });
        }
        Ok(Self { direct, reflected })
    }

    /// The first bands of what arrives straight, and of what is reflected.
    pub(crate) fn bands(&self, bands: usize) -> [ShRgb; 2] {
        let n = bands * bands;
        [&self.direct, &self.reflected]
            .map(|all| ShRgb { order: bands - 1, c: all.c.each_ref().map(|c| c[..n].to_vec()) })
    }

    /// What is left out where nothing is blocked, by Parseval: √(Σ_{l ≥ bands} A_l² |L_l|² / Σ A_l² |L_l|²).
    pub(crate) fn report(&self, bands: usize) -> Report {
        let a = Cosine.coefficients(ORDER);
        let energy = |l: usize| -> f64 {
            let band = self.direct.c.iter().flat_map(|c| &c[l * l..(l + 1) * (l + 1)]);
            a[l] * a[l] * band.map(|x| x * x).sum::<f64>()
        };
        let all: f64 = (0..=ORDER).map(energy).sum();
        let lost: f64 = (bands..=ORDER).map(energy).sum();
        let error = if all > 0.0 { (lost / all).sqrt() } else { 0.0 };
        Report::estimated(error, Vec::new())
    }
}

impl Part for ShLight {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        for (name, all) in [("radiance_sh", &self.direct), ("reflected_sh", &self.reflected)] {
            put_f64(to, format!("{prefix}.{name}"), vec![3, sh::count(ORDER)], all.c.concat());
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let part = |name: &str| {
            let name = format!("{prefix}.{name}");
            let (shape, v) = get_f64(from, &name, 2)?;
            if shape != [3, sh::count(ORDER)] {
                return Err(PartError::Unexpected(name));
            }
            let mut rows = v.chunks(sh::count(ORDER)).map(<[f64]>::to_vec);
            Ok(ShRgb { order: ORDER, c: std::array::from_fn(|_| rows.next().unwrap_or_default()) })
        };
        Ok(Self { direct: part("radiance_sh")?, reflected: part("reflected_sh")? })
    }

    fn bytes(&self) -> usize {
        2 * 24 * sh::count(ORDER)
    }
}

/// Lambert's albedo.
pub struct Albedo(pub(crate) [f64; 3]);

impl Albedo {
    /// Of other reflectances 0.
    pub(crate) fn of(brdf: &dyn Brdf) -> Self {
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
