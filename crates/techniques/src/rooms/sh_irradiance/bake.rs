//! Nine coefficients of the light, the albedo, and the matrix that they give.

use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Part};
use glam::{DVec3, Mat4};
use std::f64::consts::PI;
use steradian_base::{Certificate, Known};
use steradian_brdf::Brdf;
use steradian_light::Lights;
use steradian_sphere::sh::{self, ShRgb};

/// Highest band of the spectrum that the certificate looks at.
const SPECTRUM: usize = 12;

/// A_l of the clamped cosine, ⟨n·w⟩₊ = Σ A_l √((2l+1)/4π) Y_l0 (R&H 2001, eqs 7–9), as k_l of Funk–Hecke.
fn cosine(l: usize) -> f64 {
    match l {
        0 => PI,
        1 => 2.0 * PI / 3.0,
        _ if l % 2 == 1 => 0.0,
        // A_l = 2π (−1)^{l/2−1} / ((l+2)(l−1)) · l! / (2^l (l/2)!²)
        _ => {
            let ratio: f64 = (1..=l / 2).map(|k| (2.0 * k as f64 - 1.0) / (2.0 * k as f64)).product();
            let sign = if (l / 2) % 2 == 1 { 1.0 } else { -1.0 };
            2.0 * PI * sign * ratio / ((l as f64 + 2.0) * (l as f64 - 1.0))
        }
    }
}

/// The light's spectrum.
pub struct Light(ShRgb);

impl Light {
    pub(super) fn bake(lights: &Lights) -> Result<Self, BakeError> {
        if !lights.points.is_empty() {
            let why = "takes distant light only, not point lights".into();
            return Err(BakeError::Light { slug: "sh_irradiance", why });
        }
        let spectrum = match &lights.environment {
            Some(e) => sh::project(&e.image, SPECTRUM),
            None => ShRgb::zero(SPECTRUM),
        };
        Ok(Self(spectrum))
    }

    pub(super) fn certificate(&self) -> Certificate {
        let energy = |bands: std::ops::RangeInclusive<usize>| -> f64 {
            let band = |l: usize| -> f64 {
                self.0.c.iter().flat_map(|c| &c[l * l..(l + 1) * (l + 1)]).map(|x| x * x).sum()
            };
            bands.map(|l| cosine(l).powi(2) * band(l)).sum()
        };
        let (all, lost) = (energy(0..=SPECTRUM), energy(3..=SPECTRUM));
        Certificate::new(if all > 0.0 { (lost / all).sqrt() } else { 0.0 }, Known::Estimated)
    }
}

impl Part for Light {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f64(to, format!("{prefix}.radiance_sh"), vec![3, sh::count(SPECTRUM)], self.0.c.concat());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.radiance_sh");
        let (shape, v) = get_f64(from, &name, 2)?;
        if shape != [3, sh::count(SPECTRUM)] {
            return Err(PartError::Unexpected(name));
        }
        let mut rows = v.chunks(sh::count(SPECTRUM)).map(<[f64]>::to_vec);
        Ok(Self(ShRgb { order: SPECTRUM, c: std::array::from_fn(|_| rows.next().unwrap_or_default()) }))
    }

    fn bytes(&self) -> usize {
        self.0.c.iter().map(|c| 8 * c.len()).sum()
    }
}

/// Lambert's albedo.
pub struct Albedo([f64; 3]);

impl Albedo {
    pub(super) fn of(brdf: &dyn Brdf) -> Self {
        Self(brdf.eval(DVec3::Z, DVec3::Z).map(|f| f * PI))
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
        12
    }
}

/// L_o(n) = nᵀ M n of homogeneous n = (x, y, z, 1), per channel.
pub struct Quadric(pub(super) [Mat4; 3]);

impl Quadric {
    pub(super) fn link(light: &Light, albedo: &Albedo) -> Self {
        Self(std::array::from_fn(|k| matrix(&light.0.c[k], albedo.0[k] / PI)))
    }
}

/// R&H 2001, eqs 11–12, with the basis's constants instead of their rounded c1 … c5.
fn matrix(c: &[f64], scale: f64) -> Mat4 {
    let e = |l: usize, m: isize| scale * cosine(l) * c[sh::index(l, m)];
    let (y0, y1) = ((0.25 / PI).sqrt(), (0.75 / PI).sqrt());
    let (y2, y20) = ((15.0 / (4.0 * PI)).sqrt(), (5.0 / (16.0 * PI)).sqrt());
    let xx = 0.5 * y2 * e(2, 2) - y20 * e(2, 0);
    let yy = -0.5 * y2 * e(2, 2) - y20 * e(2, 0);
    let zz = 2.0 * y20 * e(2, 0);
    let (xy, yz, xz) = (0.5 * y2 * e(2, -2), 0.5 * y2 * e(2, -1), 0.5 * y2 * e(2, 1));
    let (x, y, z) = (0.5 * y1 * e(1, 1), 0.5 * y1 * e(1, -1), 0.5 * y1 * e(1, 0));
    let m = [[xx, xy, xz, x], [xy, yy, yz, y], [xz, yz, zz, z], [x, y, z, y0 * e(0, 0)]];
    Mat4::from_cols_array_2d(&m.map(|r| r.map(|v| v as f32)))
}

impl Part for Quadric {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let data = self.0.iter().flat_map(|m| m.to_cols_array().map(f64::from)).collect();
        put_f64(to, format!("{prefix}.quadric"), vec![3, 4, 4], data);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.quadric");
        let (shape, v) = get_f64(from, &name, 3)?;
        if shape != [3, 4, 4] {
            return Err(PartError::Unexpected(name));
        }
        let m = |k: usize| Mat4::from_cols_array(&std::array::from_fn(|i| v[16 * k + i] as f32));
        Ok(Self(std::array::from_fn(m)))
    }

    fn bytes(&self) -> usize {
        3 * 64
    }
}
