// Tabulated factors: the twin of npf.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
}

const BRDF_BINS: u32 = 90u;

// Linear between the centres of the bins of the factor that begins at cell `begin`.
fn brdf_factor(begin: u32, x: f32) -> vec3<f32> {
    let t = clamp(x - 0.5, 0.0, f32(BRDF_BINS - 1u));
    let i = min(u32(t), BRDF_BINS - 2u);
    return mix(brdf_cell(begin + i), brdf_cell(begin + i + 1u), t - f32(i));
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let h = brdf_halved(wi, wo);
    let bins = f32(BRDF_BINS);
    let bin = bins / (0.5 * BRDF_PI);
    let d = brdf_factor(2u, bins * sqrt(brdf_theta_h(h) / (0.5 * BRDF_PI)));
    let gi = brdf_factor(2u + BRDF_BINS, bin * brdf_polar_angle(wi));
    let go = brdf_factor(2u + BRDF_BINS, bin * brdf_polar_angle(wo));
    let f = brdf_factor(2u + 2u * BRDF_BINS, bin * brdf_theta_d(h));
    let cosines = max(wi.z * wo.z, 1e-30);
    return BRDF_INV_PI * (brdf_cell(0u) + brdf_cell(1u) * d * f * gi * go / cosines);
}
