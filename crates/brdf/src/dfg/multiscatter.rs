//! The energy that single scattering loses, and three methods of compensating for it.
//!
//! E(μ) = A + B is the albedo of f0 = 1; 1 − E is lost. E_avg = 2∫E(μ) μ dμ.
//!
//! - Kulla & Conty 2017, Revisiting Physically Based Shading at Imageworks: a second lobe f_ms = (1 −
//!   E(μ_o))(1 − E(μ_i)) / (π (1 − E_avg)) · F_ms, with F_ms = F_avg² E_avg / (1 − F_avg (1 − E_avg)).
//! - Fdez-Agüera 2019, A Multiple-Scattering Microfacet Model for Real-Time Image-based Lighting, eqs 3,
//!   8–10: from A and B alone, F_ss = f0 A + B, and F_ms E_ms = F_ss F_avg / (1 − F_avg (1 − E)) · (1 − E) of
//!   the diffuse light.
//! - Turquin 2019, Practical Multiple Scattering Compensation for Microfacet Models, eq. 16: the single lobe,
//!   times 1 + f0 (1 − E)/E.
//!
//! All three return exactly the light that falls on a white mirror: albedo 1 for f0 = 1.

use super::{Dfg, ggx};
use std::f64::consts::PI;
use steradian_sphere::quadrature::gauss_legendre;

/// E_avg = 2∫E(μ) μ dμ of GGX of width `alpha`; absolute error below 1e-6.
pub fn average_albedo(alpha: f64) -> f64 {
    // μ = t² evens out the steep end at grazing angles.
    let (x, w) = gauss_legendre(24);
    let term = |(x, w): (&f64, &f64)| {
        let t = 0.5 * (1.0 + x);
        2.0 * w * t * t * t * ggx(t * t, alpha).albedo()
    };
    x.iter().zip(&w).map(term).sum()
}

/// The mean of Schlick's F over the hemisphere, 2∫F(μ) μ dμ = f0 + (1 − f0)/21.
pub fn average_fresnel(f0: f64) -> f64 {
    f0 + (1.0 - f0) / 21.0
}

/// F_ms of Kulla & Conty: how much of the light that scatters more than once comes out.
pub fn kulla_conty_fresnel(f0: f64, average_albedo: f64) -> f64 {
    let f = average_fresnel(f0);
    f * f * average_albedo / (1.0 - f * (1.0 - average_albedo))
}

/// f_ms of Kulla & Conty for a white surface, sr⁻¹: `e_o` and `e_i` are E at n·wo and n·wi. Of a coloured
/// surface [`kulla_conty_fresnel`] multiplies it.
pub fn kulla_conty(e_o: f64, e_i: f64, average_albedo: f64) -> f64 {
    (1.0 - e_o) * (1.0 - e_i) / (PI * (1.0 - average_albedo).max(1e-12))
}

impl Dfg {
    /// E = A + B: the albedo of a white surface.
    pub fn albedo(self) -> f64 {
        self.scale + self.bias
    }

    /// F_ss = f0 A + B: the albedo of single scattering.
    pub fn single(self, f0: f64) -> f64 {
        f0 * self.scale + self.bias
    }

    /// F_ms E_ms of Fdez-Agüera: albedo of multiple scattering, to be multiplied by diffuse light E/π.
    pub fn multiple(self, f0: f64) -> f64 {
        let (f, e) = (average_fresnel(f0), self.albedo());
        self.single(f0) * f / (1.0 - f * (1.0 - e)) * (1.0 - e)
    }

    /// The factor of Turquin on the single lobe.
    pub fn compensation(self, f0: f64) -> f64 {
        let e = self.albedo();
        1.0 + f0 * (1.0 - e) / e.max(1e-6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALPHAS: [f64; 4] = [0.02, 0.2, 0.6, 1.0];

    #[test]
    fn a_white_furnace_stays_white() {
        let (x, w) = gauss_legendre(64);
        for alpha in ALPHAS {
            let average = average_albedo(alpha);
            assert!((kulla_conty_fresnel(1.0, average) - 1.0).abs() < 1e-12);
            for mu in [0.05, 0.3, 0.7, 1.0] {
                let d = ggx(mu, alpha);
                assert!((d.single(1.0) + d.multiple(1.0) - 1.0).abs() < 1e-12, "Fdez-Agüera {alpha} {mu}");
                assert!((d.single(1.0) * d.compensation(1.0) - 1.0).abs() < 1e-12, "Turquin {alpha} {mu}");
                // ∫ f_ms μ_i dwi over the hemisphere, μ = t².
                let lobe = |(x, w): (&f64, &f64)| {
                    let t = 0.5 * (1.0 + x);
                    let f = kulla_conty(d.albedo(), ggx(t * t, alpha).albedo(), average);
                    2.0 * PI * 0.5 * w * f * t * t * 2.0 * t
                };
                let ms: f64 = x.iter().zip(&w).map(lobe).sum();
                assert!(
                    (d.albedo() + ms - 1.0).abs() < 2e-6,
                    "Kulla & Conty {alpha} {mu}: {}",
                    d.albedo() + ms
                );
            }
        }
    }

    #[test]
    fn nothing_is_added_to_a_mirror_and_nothing_above_one() {
        assert!((average_albedo(1e-4) - 1.0).abs() < 1e-4);
        for alpha in ALPHAS {
            for mu in [0.05, 0.5, 1.0] {
                let d = ggx(mu, alpha);
                for f0 in [0.0, 0.04, 0.5, 1.0] {
                    let all = d.single(f0) + d.multiple(f0);
                    assert!(all <= 1.0 + 1e-12 && all >= d.single(f0), "{alpha} {mu} {f0}: {all}");
                }
            }
        }
        // α = 1 has D = 1/π and E(1) = ∫ z/(1 + z) dz = 1 − ln 2.
        let e = ggx(1.0, 1.0).albedo();
        assert!((e - (1.0 - 2f64.ln())).abs() < 1e-6, "{e}");
    }
}
