// The twin of strand.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // n; sign of the ridge's cosine; 1 for Banks's f, else f_cos over the sphere
    lobe: vec4<f32>,
}

fn brdf_power(wi: vec3<f32>, wo: vec3<f32>) -> f32 {
    let x = wi.x;
    let y = -brdf.lobe.y * wo.x;
    let cx = length(wi.yz);
    let cy = length(wo.yz);
    let s = x * cy + y * cx;
    return brdf_cosine_pow(cx * cy - x * y, s * s, brdf.lobe.x);
}

fn brdf_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let is_f = brdf.lobe.z > 0.0;
    if wo.z <= 0.0 || (is_f && wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    return vec3<f32>(brdf_power(wi, wo) * select(1.0, wi.z, is_f));
}
