// The twin of microfacet.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // sigma
    width: vec4<f32>,
}

fn brdf_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let sigma = brdf.width.x;
    let x = brdf_polar_angle(brdf_half(wi, wo)) / sigma;
    return vec3<f32>(exp(-x * x) / (4.0 * BRDF_PI * sigma * sigma));
}
