//! Irradiance as a function of the normal, for normal maps.
//!
//! Sloan (2006), *Normal Mapping for Precomputed Radiance Transfer*: the transfer matrix M of a site gives
//! the light that arrives there, and its convolution with the cosine the irradiance of every normal n' near
//! the site's own,
//!
//! > E(n') = Σ_j A_j y_j(n') (M L)_j,  M_ji = ∫ V y_j y_i dw over n·w > 0
//!
//! Cosines have little energy above their second band, and n' is above the surface: E is fitted with nine
//! harmonics over this hemisphere, by least squares,
//!
//! > **E(n') ≈ Σ_k y_k(n') Σ_i T_ki L_i,  T = R⁻¹ G₃⁻¹ G R diag(A) M**,  G_kj = ∫ y_k y_j over z > 0
//!
//! with R the turn to the site's frame and G₃ its part of three bands. T is about world axes, so that it may
//! be interpolated between sites of other frames.

use super::PrtDiffuse;
use crate::shared::geometry::matrices::{Below, seen};
use crate::shared::geometry::transport;
use crate::{BakeError, Geometry, Sites, Technique};
use glam::DMat3;
use std::f64::consts::TAU;
use steradian_numerics::dense::Cholesky;
use steradian_parallel::prelude::*;
use steradian_prefilter::{Cosine, Zonal};
use steradian_sphere::quadrature::gauss_legendre;
use steradian_sphere::sh::{self, Rotation};
use steradian_transfer::{Products, Site, Transfer};

/// Harmonics of the normal.
pub const HARMONICS: usize = 9;

/// G₃⁻¹ G, row by row: coefficients of the nine harmonics nearest to each of `n` over the upper hemisphere.
fn nearest(n: usize) -> Vec<f64> {
    let order = n.isqrt() - 1;
    // Products of two harmonics have twice the order; half of the sphere has no symmetry to help.
    let (x, w) = gauss_legendre(order + 4);
    let rounds = 2 * order + 4;
    let mut gram = vec![0.0; n * n];
    let mut y = vec![0.0; n];
    for (x, w) in x.iter().zip(&w) {
        let z = 0.5 * (1.0 + x);
        let s = (1.0 - z * z).sqrt();
        for k in 0..rounds {
            let (sin, cos) = (TAU * k as f64 / rounds as f64).sin_cos();
            sh::eval(order, glam::DVec3::new(s * cos, s * sin, z), &mut y);
            for (i, row) in gram.chunks_exact_mut(n).enumerate() {
                let f = 0.5 * w * TAU / rounds as f64 * y[i];
                row.iter_mut().zip(&y).for_each(|(g, y)| *g += f * y);
            }
        }
    }
    let small: Vec<Vec<f64>> = (0..HARMONICS).map(|i| gram[i * n..][..HARMONICS].to_vec()).collect();
    let factor = Cholesky::new(&small).expect("harmonics are independent over a hemisphere");
    let mut out = vec![0.0; HARMONICS * n];
    for j in 0..n {
        let c = factor.solve((0..HARMONICS).map(|i| gram[i * n + j]).collect());
        (0..HARMONICS).for_each(|k| out[k * n + j] = c[k]);
    }
    out
}

/// T of each site, nine rows of as many numbers as light has.
pub fn by_normal(g: &Geometry, t: &Transfer) -> Result<Vec<f32>, BakeError> {
    let sites = match &g.sites {
        // Where light is reflected all vertices have data.
        Sites::Slots(_) if t.bounces > 1 => Site::vertices(&g.mesh),
        _ => transport::sites(PrtDiffuse::CARD.slug, g)?,
    };
    let (bands, n) = (t.bands, t.bands * t.bands);
    let products = Products::new(bands);
    let cosine = Cosine.coefficients(bands - 1);
    let nearest = nearest(n.max(HARMONICS));
    let one = |k: usize| {
        let mut out = vec![0.0f32; HARMONICS * n];
        let site = &sites[k];
        if site.is_absent() {
            return out;
        }
        let m = products.matrix(&seen(site, t.visibility(k), Below::Blocked));
        let f = steradian_sphere::Frame::from_normal(site.n.as_dvec3().normalize());
        let world = DMat3::from_cols(f.t, f.b, f.n);
        let order = (bands - 1).max(2);
        let (into, back) = (Rotation::new(order, world.transpose()), Rotation::new(2, world));
        let wide = (order + 1) * (order + 1);
        let (mut column, mut local) = (vec![0.0; wide], vec![0.0; wide]);
        let (mut few, mut kept) = ([0.0; HARMONICS], [0.0; HARMONICS]);
        for i in 0..n {
            (0..n).for_each(|j| column[j] = cosine[j.isqrt()] * m[j * n + i]);
            into.apply(&column, &mut local);
            for (few, row) in few.iter_mut().zip(nearest.chunks_exact(wide)) {
                *few = row.iter().zip(&local).map(|(a, b)| a * b).sum();
            }
            back.apply(&few, &mut kept);
            (0..HARMONICS).for_each(|k| out[k * n + i] = kept[k] as f32);
        }
        out
    };
    Ok((0..sites.len()).into_par_iter().flat_map_iter(one).collect())
}

/// y(bumped) − y(own), harmonics of the bumped and of the surface's own normal; zeros where `own` is zero.
#[inline(always)]
pub fn difference(bumped: [f32; 3], own: [f32; 3]) -> [f32; HARMONICS] {
    let square = own.iter().map(|x| x * x).sum::<f32>();
    if square < 0.5 {
        return [0.0; HARMONICS];
    }
    let (a, b) = (harmonics(bumped), harmonics(own));
    std::array::from_fn(|k| a[k] - b[k])
}

/// The harmonics of a unit vector; `normals.wgsl` has the same function.
#[inline(always)]
fn harmonics([x, y, z]: [f32; 3]) -> [f32; HARMONICS] {
    [
        0.282_094_8,
        0.488_602_5 * y,
        0.488_602_5 * z,
        0.488_602_5 * x,
        1.092_548_4 * (x * y),
        1.092_548_4 * (y * z),
        0.946_174_7 * (z * z) - 0.315_391_57,
        1.092_548_4 * (x * z),
        0.546_274_2 * (x * x - y * y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn the_harmonics_are_those_of_the_sphere() {
        for d in [DVec3::new(0.3, -0.5, 0.7), DVec3::new(-0.8, 0.1, 0.2), DVec3::Y] {
            let d = d.normalize();
            let mut y = [0.0; HARMONICS];
            sh::eval(2, d, &mut y);
            let own = harmonics(d.as_vec3().to_array());
            assert!(y.iter().zip(own).all(|(a, b)| (a - f64::from(b)).abs() < 1e-6), "{y:?} {own:?}");
        }
    }

    /// Functions of three bands are kept as they are; of higher bands the fit over the hemisphere is closer
    /// than leaving them out.
    #[test]
    fn nine_harmonics_come_near_others_over_the_hemisphere() {
        let n = 25;
        let p = nearest(n);
        for k in 0..HARMONICS {
            for j in 0..HARMONICS {
                let want = f64::from(u8::from(j == k));
                assert!((p[k * n + j] - want).abs() < 1e-9, "{k} {j}: {}", p[k * n + j]);
            }
        }
        // Harmonics of band 3 with at most one wave round the circle; over half a sphere they bend about
        // once.
        let mut y = vec![0.0; n];
        for j in [11, 12, 13] {
            let (mut left, mut all) = (0.0, 0.0);
            for k in 0..4000 {
                let d = steradian_prefilter::probe::direction(k, 4000);
                if d.z > 0.0 {
                    sh::eval(4, d, &mut y);
                    let fit: f64 = (0..HARMONICS).map(|k| p[k * n + j] * y[k]).sum();
                    left += (y[j] - fit).powi(2);
                    all += y[j] * y[j];
                }
            }
            assert!(left < 0.2 * all, "{j}: {left} {all}");
        }
    }
}
