//! Bakes in 16-bit floats, where the error allows.

use super::Baked;

use crate::{Error, Session};
use glam::{DVec3, Vec3};
use steradian_formats::{Tensor, TensorData, TensorFile};
use steradian_prefilter::probe;
use steradian_sphere::Frame;
use steradian_techniques::tensors::put_certificate;
use steradian_techniques::{AnyBake, AnyTechnique, PointsBuf, Radiance};

/// Tensors with fewer numbers than this hold orders, factors and sizes, and stay in single precision.
const SMALLEST: usize = 256;
/// A tensor whose rounding has a larger relative RMS error stays in single precision: halves have 5e-4 at
/// most unless they underflow.
const ROUNDING: f64 = 1e-3;
/// Without a tolerance, 16-bit floats may add this part of a bake's error, or [`NEGLIGIBLE`].
const SHARE: f64 = 0.1;
/// An error too small to matter in any case.
const NEGLIGIBLE: f64 = 1e-3;
/// Number of points at which the radiance of both is compared.
const PROBES: usize = 1024;

/// The bake as tensors, as 16-bit floats where the request says so and the error allows it; the certificate
/// includes the error that they add.
pub fn tensors(
    done: &mut Baked,
    technique: &'static dyn AnyTechnique,
    half: bool,
    session: &Session,
) -> Result<TensorFile, Error> {
    let whole = done.bake.save();
    if !half {
        return Ok(whole);
    }
    let slug = technique.card().slug;
    if technique.needs_sites(&done.bake.params()) {
        session.say(format_args!("{slug}: halves are not measured on a mesh; stored as 32-bit floats"));
        return Ok(whole);
    }
    let mut halved =
        TensorFile { tensors: whole.tensors.iter().map(one).collect(), metadata: whole.metadata.clone() };
    let loaded = technique.load(&halved)?;
    let added = difference(&*loaded, &*done.bake);
    let error = done.certificate.error;
    let allowed = match done.accuracy.tolerance() {
        Some(t) => t - error,
        None => (SHARE * error).max(NEGLIGIBLE),
    };
    if added.is_nan() || added > allowed {
        session.say(format_args!(
            "halves would add {added:.1e} to the error of {error:.1e}: stored as 32-bit floats"
        ));
        return Ok(whole);
    }
    done.certificate.error += added;
    done.certificate = done.certificate.clone().detail("half", added);
    done.bake = loaded;
    put_certificate(&mut halved, &done.certificate);
    Ok(halved)
}

/// A tensor in halves, unless it is small, no f32, or would lose too much.
fn one((name, t): (&String, &Tensor)) -> (String, Tensor) {
    let data = match &t.data {
        TensorData::F32(v) if v.len() >= SMALLEST => {
            let halved = t.data.halved();
            if rounding(v, &halved.to_f32()) <= ROUNDING { halved } else { t.data.clone() }
        }
        other => other.clone(),
    };
    (name.clone(), Tensor { shape: t.shape.clone(), data })
}

/// Relative RMS difference; infinite where one is.
fn rounding(a: &[f32], b: &[f32]) -> f64 {
    let (mut d2, mut a2) = (0.0, 0.0);
    for (&x, &y) in a.iter().zip(b) {
        d2 += (f64::from(x) - f64::from(y)).powi(2);
        a2 += f64::from(x).powi(2);
    }
    if d2 == 0.0 { 0.0 } else { (d2 / a2).sqrt() }
}

/// Relative RMS difference between the radiance of two bakes: normals uniform over the sphere, views over the
/// hemispheres.
fn difference(a: &dyn AnyBake, b: &dyn AnyBake) -> f64 {
    let points = points();
    let shade = |bake: &dyn AnyBake| {
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; PROBES]);
        bake.shade(&points.as_points(), &mut Radiance::of(&mut rgb));
        rgb
    };
    let (a, b) = (shade(a), shade(b));
    let at = |x: &[Vec<f32>; 3], k: usize| [x[0][k], x[1][k], x[2][k]].map(f64::from);
    probe::relative_rms((0..PROBES).map(|k| (at(&a, k), at(&b, k))))
}

fn points() -> PointsBuf {
    let mut buf = PointsBuf::with_capacity(PROBES);
    for k in 0..PROBES {
        let frame = Frame::from_normal(probe::direction(k, PROBES));
        // One view in each of as many belts of equal solid angle as there are probes, in an order independent
        // of that of the normals.
        let cosine = ((k * 389 % PROBES) as f64 + 0.5) / PROBES as f64;
        let (s, c) = (2.0 * std::f64::consts::PI * (k as f64 * 0.569_840_291).fract()).sin_cos();
        let sine = (1.0 - cosine * cosine).sqrt();
        let wo = frame.to_world(DVec3::new(sine * c, sine * s, cosine));
        buf.push(frame.n.as_vec3(), frame.t.as_vec3(), wo.as_vec3(), Vec3::ZERO);
    }
    buf
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tensors_that_lose_too_much_stay() {
        let tensor = |v: Vec<f32>| Tensor::f32([v.len()], v);
        let half = |v: Vec<f32>| {
            let name = "a".to_string();
            matches!(one((&name, &tensor(v))).1.data, TensorData::F16(_))
        };
        assert!(half((0..300).map(|i| 0.1 * i as f32).collect()));
        assert!(!half(vec![0.1; 255]));
        assert!(!half((0..300).map(|i| 1e3 * i as f32).collect()));
        assert!(!half(vec![1e-9; 300]));
        assert!(half(vec![0.0; 300]));
    }
}
