//! The reflectances that are round about the tangent, as kernels.

use crate::shared::material::reflectance::Reflectance;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_brdf::Form;
use steradian_brdf::model::strand::Kind;
use steradian_prefilter::FibreKernel;

/// Intervals over α of the table of `outside`.
const TABLE: usize = 256;

/// cosᴺ(∠(d, wi) − α)₊ with d = ±t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fibre {
    /// Exponent.
    pub n: f64,
    /// +1 where the highlight is at θ_i = θ_o (Kajiya & Kay), −1 at π − θ_o (Banks).
    pub sign: f64,
    /// Factor of the model.
    pub scale: [f64; 3],
    /// Is a mean cosine kept in place of ⟨n·wi⟩₊?
    pub mean_cosine: bool,
}

impl Fibre {
    /// The kernel of a reflectance that the Card takes.
    pub fn new(m: &Reflectance, mean_cosine: bool) -> Self {
        let (kind, n, scale) = match m.form() {
            Form::Strand { kind, n, scale } => (kind, n, scale),
            _ => (Kind::BanksMap, 1.0, [1.0; 3]),
        };
        let sign = if kind == Kind::KajiyaKay { 1.0 } else { -1.0 };
        Self { n, sign, scale, mean_cosine: kind == Kind::Banks && mean_cosine }
    }

    fn cone(&self, alpha: f64) -> FibreKernel {
        FibreKernel { n: self.n, alpha }
    }

    /// The factor that the cosine is replaced with outside the integral: ∫ K ⟨n·wi⟩₊ / ∫ K, where ∫ ⟨n·wi⟩₊
    /// dφ = 2 sin θ_i about the tangent and ∫ dφ = 2π.
    fn outside(&self, alpha: f64) -> f64 {
        if !self.mean_cosine {
            return 1.0;
        }
        let cone = self.cone(alpha);
        cone.integral(|theta| theta.sin().powi(2)) / (PI * cone.integral(f64::sin))
    }

    /// Zonal coefficients of the kernel at α, times `outside`.
    pub fn coefficients(&self, alpha: f64, order: usize) -> Vec<f64> {
        let outside = self.outside(alpha);
        self.cone(alpha).coefficients(order).into_iter().map(|k| k * outside).collect()
    }

    /// The function that the maps integrate, in the local frame with t = x: f_cos(wi, wo) without n·wi.
    pub fn f_map(&self) -> impl Fn(DVec3, DVec3) -> [f64; 3] + Sync + use<> {
        let fibre = *self;
        let outside: Vec<f64> =
            (0..=TABLE).map(|j| fibre.outside(FRAC_PI_2 * j as f64 / TABLE as f64)).collect();
        move |wi, wo| {
            let alpha = wo.x.abs().min(1.0).acos();
            let d = fibre.sign * wo.x.signum();
            let theta = (wi.y.hypot(wi.z)).atan2(d * wi.x);
            let x = alpha / FRAC_PI_2 * TABLE as f64;
            let j = (x as usize).min(TABLE - 1);
            let f = outside[j] + (outside[j + 1] - outside[j]) * (x - j as f64);
            let f = f * fibre.cone(alpha).value(theta);
            fibre.scale.map(|s| s * f)
        }
    }
}
