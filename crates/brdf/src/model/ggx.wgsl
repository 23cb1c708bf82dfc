// The twin of ggx.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    f0: vec4<f32>,
    // ax, ay
    width: vec4<f32>,
}

fn brdf_stretched_length(w: vec3<f32>) -> f32 {
    return length(vec3<f32>(brdf.width.xy * w.xy, w.z));
}

fn brdf_ggx_d(h: vec3<f32>) -> f32 {
    let x = h.xy / brdf.width.xy;
    let q = dot(x, x) + h.z * h.z;
    return 1.0 / (BRDF_PI * brdf.width.x * brdf.width.y * q * q);
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let s = brdf_stretched_length(wi) * wo.z + brdf_stretched_length(wo) * wi.z;
    let shape = 0.5 * brdf_ggx_d(brdf_half(wi, wo)) / max(s, BRDF_TINY);
    return brdf_schlick(brdf.f0.rgb, brdf_half_cosine(wi, wo)) * shape;
}
