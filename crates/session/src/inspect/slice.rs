//! Image slice of a reflectance, and its deviation from reciprocity.

use glam::DVec3;
use steradian_brdf::Brdf;
use steradian_formats::Raster;

/// Pixels of a side: four a degree.
const SIDE: usize = 360;
/// Number of pairs of directions at which reciprocity is measured.
const PAIRS: usize = 4096;

/// The image slice (Burley 2012, *Physically Based Shading at Disney*, section 3): f, sr⁻¹, over the half
/// vector's angle from the normal, 0 … 90° from left to right, and the difference angle, 0 … 90° from bottom
/// to top, at φ_d = 90° (Rusinkiewicz 1998). The left edge is the specular peak, the top row grazing
/// retroreflection's opposite (Fresnel's peak), the bottom row retroreflection.
pub fn image_slice(brdf: &dyn Brdf) -> Raster {
    let pixel = |k: usize| {
        let angle = |i: usize| (i as f64 + 0.5) / SIDE as f64 * std::f64::consts::FRAC_PI_2;
        let (half, difference) = (angle(k % SIDE), angle(SIDE - 1 - k / SIDE));
        let (across, along) = difference.sin_cos();
        let wi = DVec3::new(along * half.sin(), across, along * half.cos());
        let wo = DVec3::new(wi.x, -wi.y, wi.z);
        brdf.f_cos(wi, wo).map(|v| (v / wi.z) as f32)
    };
    let pixels: Vec<[f32; 3]> = (0..SIDE * SIDE).map(pixel).collect();
    Raster::rgb(SIDE, SIDE, std::array::from_fn(|c| pixels.iter().map(|p| p[c]).collect()))
}

/// Difference between f(l, v) and f(v, l): RMS over pairs of directions of the hemisphere, relative to that
/// of f, both weighted by the product of the cosines. 0 for a black reflectance.
pub fn reciprocity_error(brdf: &dyn Brdf) -> f64 {
    let (mut apart, mut all) = (0.0, 0.0);
    for k in 0..PAIRS {
        // Four dimensions of a Kronecker sequence: powers of the root of x⁵ = x + 1 (Roberts 2018).
        const STEP: f64 = 1.167_303_978_261_418_7;
        let u = [1, 2, 3, 4].map(|n| (0.5 + (k + 1) as f64 * STEP.powi(-n)).fract());
        let direction = |x: f64, y: f64| {
            let (sin, cos) = (std::f64::consts::TAU * y).sin_cos();
            let r = (1.0 - x * x).sqrt();
            DVec3::new(r * cos, r * sin, x)
        };
        let (a, b) = (direction(u[0], u[1]), direction(u[2], u[3]));
        let (there, back) = (brdf.f_cos(a, b), brdf.f_cos(b, a));
        for c in 0..3 {
            // f times both cosines.
            let (x, y) = (there[c] * b.z, back[c] * a.z);
            apart += (x - y).powi(2);
            all += x * x;
        }
    }
    if all > 0.0 { (apart / all).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brdf(spec: &str) -> steradian_brdf::SharedBrdf {
        steradian_brdf::parse(spec).expect("a model")
    }

    #[test]
    fn reciprocity_is_measured() {
        assert!(reciprocity_error(&*brdf("ggx:alpha=0.3")) < 1e-12);
        // Phong's lobe over the other cosine is not reciprocal.
        assert!(reciprocity_error(&*brdf("blinn-phong-gl:n=20")) > 1e-3);
    }

    #[test]
    fn the_slice_has_the_peak_at_the_left_and_fresnel_at_the_top() {
        let slice = image_slice(&*brdf("ggx:alpha=0.2,f0=0.04"));
        let red = &slice.channels[0].data;
        let at = |x: usize, y: usize| red[y * SIDE + x];
        assert!(at(0, 180) > 10.0 * at(120, 180));
        assert!(at(0, 10) > 2.0 * at(0, 350), "{} {}", at(0, 10), at(0, 350));
        assert!(red.iter().all(|v| v.is_finite() && *v >= 0.0));
    }
}
