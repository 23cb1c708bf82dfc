//! The models and their tables.

use crate::shared::tables::grid::Grid;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use steradian_brdf::model::{ashikhmin_shirley, cook_torrance, ggx};
use steradian_brdf::{Brdf, Form};

/// A model that is a product of functions of two numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Model {
    /// GGX of one width with height-correlated masking.
    Ggx { alpha: f64, f0: [f64; 3], scale: [f64; 3] },
    /// Beckmann's distribution with Smith's masking of each direction.
    Beckmann { m: f64, f0: [f64; 3], scale: [f64; 3] },
    /// Ashikhmin and Shirley's.
    Power { exponents: [f64; 2], rs: [f64; 3], rd: [f64; 3], scale: [f64; 3] },
}

pub(super) fn model(brdf: &dyn Brdf) -> Result<Model, String> {
    match brdf.form() {
        Form::Ggx { alpha: [alpha, other], f0, scale } if alpha == other => {
            Ok(Model::Ggx { alpha, f0, scale })
        }
        Form::Ggx { .. } => {
            Err("takes ggx of one alpha: with two, D needs the azimuth of h beside n·h and h·l, \
                                 which no table of two numbers has: use vertex_analytic or exact"
                .into())
        }
        Form::CookTorrance { m, f0, smith: true, scale } => Ok(Model::Beckmann { m, f0, scale }),
        Form::CookTorrance { .. } => {
            Err("takes cook-torrance with g=smith: the V-cavity's G needs n·h beside n·l and n·v, which no \
                 table of two numbers has: use g=smith, vertex_analytic or exact"
                .into())
        }
        Form::AshikhminShirley { exponents, rs, rd, scale } => Ok(Model::Power { exponents, rs, rd, scale }),
        _ => Err(format!(
            "takes ggx, cook-torrance with g=smith and ashikhmin-shirley, not {}: use vertex_analytic or exact",
            brdf.info().name
        )),
    }
}

pub(super) fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    model(brdf).map(|_| ())
}

/// Schlick 1994, eq. 15.
fn schlick(f0: [f64; 3], u: f64) -> [f64; 3] {
    f0.map(|f| f + (1.0 - f) * (1.0 - u).powi(5))
}

/// A half vector θ from the normal, at azimuth φ.
fn half(theta: f64, phi: f64) -> DVec3 {
    let ((s, c), (y, x)) = (theta.sin_cos(), phi.sin_cos());
    DVec3::new(s * x, s * y, c)
}

fn with(v: [f64; 3], w: f64) -> [f64; 4] {
    [v[0], v[1], v[2], w]
}

impl Model {
    /// T1 = F D/4 of h·l and θ_h.
    pub(super) fn facets(&self, hl: f64, theta: f64) -> [f64; 3] {
        let (d, f0, scale) = match *self {
            Self::Ggx { alpha, f0, scale } => (ggx::distribution(half(theta, 0.0), alpha), f0, scale),
            Self::Beckmann { m, f0, scale } => {
                // At the horizon exp(−tan²) is 0.
                let d = if theta < FRAC_PI_2 { cook_torrance::beckmann(half(theta, 0.0), m) } else { 0.0 };
                (d, f0, scale)
            }
            Self::Power { .. } => return [0.0; 3],
        };
        let f = schlick(f0, hl);
        std::array::from_fn(|c| 0.25 * scale[c] * f[c] * d)
    }

    /// (n·l)(n·v)/G.
    pub(super) fn cosines_over_masking(&self, nl: f64, nv: f64) -> f64 {
        match *self {
            Self::Ggx { alpha, .. } => ggx::cosines_over_masking(alpha, nl, nv),
            Self::Beckmann { m, .. } => {
                let over = |c: f64| {
                    1.0 / cook_torrance::smith_over_cosine(
                        DVec3::new((1.0 - c * c).max(0.0).sqrt(), 0.0, c),
                        m,
                    )
                };
                over(nl) * over(nv)
            }
            Self::Power { .. } => nl.max(nv),
        }
    }
}

/// The tables of a model.
#[derive(Debug, Clone, PartialEq)]
pub enum Tables {
    /// T1 and (n·l)(n·v)/G.
    Two {
        /// F D/4 over h·l and θ_h/(π/2).
        facets: Grid<4>,
        /// (n·l)(n·v)/G over n·l and n·v, in the first number.
        masking: Grid<2>,
        /// Entries a side.
        resolution: usize,
    },
    /// Steigleder's.
    Three {
        /// The power of n·h over φ_h and θ_h, both over π/2, in the first number.
        power: Grid<2>,
        /// scale · F over h·l.
        fresnel: Grid<4>,
        /// Over the smaller and the larger of n·l and n·v: scale · the diffuse part, and the larger one.
        base: Grid<4>,
        /// Entries a side.
        resolution: usize,
    },
}

impl Tables {
    pub(super) fn new(model: &Model, resolution: usize) -> Self {
        let n = resolution;
        if let Model::Power { exponents: [nu, nv], rs, rd, scale } = *model {
            let power = |u: f64, v: f64| {
                let h = half(FRAC_PI_2 * v, FRAC_PI_2 * u);
                [ashikhmin_shirley::power(h, nu, nv), 0.0]
            };
            let fresnel = |u: f64, _: f64| {
                let f = schlick(rs, u);
                with(std::array::from_fn(|c| scale[c] * f[c]), 0.0)
            };
            let base = |u: f64, v: f64| {
                let d = ashikhmin_shirley::base(u, v);
                // v is the larger cosine; entries beyond the diagonal continue the formula.
                with(std::array::from_fn(|c| scale[c] * rd[c] * (1.0 - rs[c]) * d), v)
            };
            return Self::Three {
                power: Grid::new(n, n, power),
                fresnel: Grid::new(n, 1, fresnel),
                base: Grid::new(n, n, base),
                resolution,
            };
        }
        Self::Two {
            facets: Grid::new(n, n, |u, v| with(model.facets(u, FRAC_PI_2 * v), 0.0)),
            masking: Grid::new(n, n, |u, v| [model.cosines_over_masking(u, v), 0.0]),
            resolution,
        }
    }

    pub(super) fn resolution(&self) -> usize {
        let (Self::Two { resolution, .. } | Self::Three { resolution, .. }) = self;
        *resolution
    }

    pub(super) fn count(&self) -> usize {
        if matches!(self, Self::Two { .. }) { 2 } else { 3 }
    }

    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Two { facets, masking, .. } => facets.bytes() + masking.bytes(),
            Self::Three { power, fresnel, base, .. } => power.bytes() + fresnel.bytes() + base.bytes(),
        }
    }
}
