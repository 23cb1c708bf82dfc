//! Factors of precomputed transfer: the albedo of diffuse surfaces; the coefficients of the light in its
//! first bands; and its spectrum a little beyond them, from which the error of leaving it out is estimated.

use crate::gpu::{Uniform, Value};
use crate::shared::light::distant::refuse_points;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Part};
use glam::Mat3;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;
use steradian_prefilter::{SmallLight, source};
use steradian_sphere::sh::{self, Rotation, ShRgb, Window};

/// Highest band that enters the error estimate.
pub const ORDER: usize = 24;

/// The light's spectrum up to [`ORDER`]; shading uses its first bands.
pub struct ShLight {
    /// Light that arrives directly.
    direct: ShRgb,
    /// Light that surfaces reflect: `direct` and the suns that are shaded exactly.
    reflected: ShRgb,
}

/// Adds disks and directional lights.
fn add_suns(lights: &Lights, to: &mut ShRgb) {
    let disks = lights.disks.iter().map(SmallLight::from);
    let all: Vec<SmallLight> = disks.chain(lights.directionals.iter().map(SmallLight::from)).collect();
    source::add_small_lights(to, &all);
}

/// The first bands, turned, and multiplied per channel by `factor`.
fn turned(all: &ShRgb, bands: usize, rotation: Mat3, factor: [f64; 3]) -> Vec<[f32; 3]> {
    let n = bands * bands;
    let first = ShRgb { order: bands - 1, c: all.c.each_ref().map(|c| c[..n].to_vec()) };
    let turned = Rotation::new(first.order, rotation.as_dmat3()).apply_rgb(&first);
    (0..n).map(|i| [0, 1, 2].map(|c| (turned.c[c][i] * factor[c]) as f32)).collect()
}

impl ShLight {
    /// All distant light, exactly; refuses point lights. A window of Hann that ends at band `window` takes
    /// ringing off, 0 leaves the light as it is.
    pub fn bake(slug: &'static str, lights: &Lights, window: f64) -> Result<Self, BakeError> {
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

    /// The first bands of direct light, rotated, and multiplied per channel by `factor`.
    pub fn turned(&self, bands: usize, rotation: Mat3, factor: [f64; 3]) -> Vec<[f32; 3]> {
        turned(&self.direct, bands, rotation, factor)
    }

    /// The first bands of the light that surfaces reflect, suns shaded exactly included, rotated, and
    /// multiplied per channel by `factor`.
    pub fn turned_reflected(&self, bands: usize, rotation: Mat3, factor: [f64; 3]) -> Vec<[f32; 3]> {
        turned(&self.reflected, bands, rotation, factor)
    }

    /// Mean square over all frames of a coefficient of direct light, per channel and band up to [`ORDER`].
    pub fn mean_squares(&self) -> [Vec<f64>; 3] {
        let mut out: [Vec<f64>; 3] = Default::default();
        for (out, c) in out.iter_mut().zip(&self.direct.c) {
            let band = |l: usize| c[l * l..(l + 1) * (l + 1)].iter().map(|x| x * x).sum::<f64>();
            out.extend((0..=ORDER).map(|l| band(l) / (2 * l + 1) as f64));
        }
        out
    }

    /// Relative error of cutting the light off after the first bands, where it is convolved with a zonal
    /// kernel of coefficients `k` (up to [`ORDER`]) and nothing is blocked, by Parseval: √(Σ_{l ≥ bands} k_l²
    /// |L_l|² / Σ k_l² |L_l|²).
    pub fn left_out(&self, k: &[f64], bands: usize) -> f64 {
        let energy = |l: usize| -> f64 {
            let band = self.direct.c.iter().flat_map(|c| &c[l * l..(l + 1) * (l + 1)]);
            k[l] * k[l] * band.map(|x| x * x).sum::<f64>()
        };
        let all: f64 = (0..=ORDER).map(energy).sum();
        let lost: f64 = (bands..=ORDER).map(energy).sum();
        if all > 0.0 { (lost / all).sqrt() } else { 0.0 }
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
pub struct Albedo(pub [f64; 3]);

impl Albedo {
    /// The albedo of a Lambertian reflectance, 0 of any other.
    pub fn of(brdf: &dyn Brdf) -> Self {
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

/// Sixty-four names.
macro_rules! names {
    ($p:literal) => {
        [
            concat!($p, "0"),
            concat!($p, "1"),
            concat!($p, "2"),
            concat!($p, "3"),
            concat!($p, "4"),
            concat!($p, "5"),
            concat!($p, "6"),
            concat!($p, "7"),
            concat!($p, "8"),
            concat!($p, "9"),
            concat!($p, "10"),
            concat!($p, "11"),
            concat!($p, "12"),
            concat!($p, "13"),
            concat!($p, "14"),
            concat!($p, "15"),
            concat!($p, "16"),
            concat!($p, "17"),
            concat!($p, "18"),
            concat!($p, "19"),
            concat!($p, "20"),
            concat!($p, "21"),
            concat!($p, "22"),
            concat!($p, "23"),
            concat!($p, "24"),
            concat!($p, "25"),
            concat!($p, "26"),
            concat!($p, "27"),
            concat!($p, "28"),
            concat!($p, "29"),
            concat!($p, "30"),
            concat!($p, "31"),
            concat!($p, "32"),
            concat!($p, "33"),
            concat!($p, "34"),
            concat!($p, "35"),
            concat!($p, "36"),
            concat!($p, "37"),
            concat!($p, "38"),
            concat!($p, "39"),
            concat!($p, "40"),
            concat!($p, "41"),
            concat!($p, "42"),
            concat!($p, "43"),
            concat!($p, "44"),
            concat!($p, "45"),
            concat!($p, "46"),
            concat!($p, "47"),
            concat!($p, "48"),
            concat!($p, "49"),
            concat!($p, "50"),
            concat!($p, "51"),
            concat!($p, "52"),
            concat!($p, "53"),
            concat!($p, "54"),
            concat!($p, "55"),
            concat!($p, "56"),
            concat!($p, "57"),
            concat!($p, "58"),
            concat!($p, "59"),
            concat!($p, "60"),
            concat!($p, "61"),
            concat!($p, "62"),
            concat!($p, "63"),
        ]
    };
}

/// Names of the light's coefficients as uniforms, up to eight bands: of direct light, and of the light that
/// surfaces reflect.
const NAMES: [[&str; 64]; 2] = [names!("light_"), names!("reflected_")];

fn named(names: &[&'static str; 64], light: &[[f32; 3]]) -> Vec<Uniform> {
    let value = |l: &[f32; 3]| Value::Vec4([l[0], l[1], l[2], 0.0]);
    names.iter().zip(light).map(|(name, l)| Uniform { name, value: value(l) }).collect()
}

/// Coefficients of direct light as uniforms `light_0` …; 64 at most.
pub fn uniforms(light: &[[f32; 3]]) -> Vec<Uniform> {
    named(&NAMES[0], light)
}

/// Coefficients of the light that surfaces reflect, as uniforms `reflected_0` …; 64 at most.
pub fn reflected_uniforms(light: &[[f32; 3]]) -> Vec<Uniform> {
    named(&NAMES[1], light)
}

/// Coefficient `i` of [`uniforms`] in WGSL.
pub fn uniform(i: usize) -> String {
    format!("technique.light_{i}.xyz")
}

/// Coefficient `i` of [`reflected_uniforms`] in WGSL.
pub fn reflected_uniform(i: usize) -> String {
    format!("technique.reflected_{i}.xyz")
}
