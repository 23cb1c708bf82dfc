// The twin of ashikhmin_shirley.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // w: nu
    rs: vec4<f32>,
    // w: nv
    rd: vec4<f32>,
}

fn brdf_lobe(wi: vec3<f32>, wo: vec3<f32>, h: vec3<f32>) -> f32 {
    let n = vec2<f32>(brdf.rs.w, brdf.rd.w);
    let s2 = clamp(dot(h.xy, h.xy), 1e-30, 0.9999999);
    let power = exp(0.5 * brdf_ln_1p(-s2) / s2 * dot(n, h.xy * h.xy));
    let norm = sqrt(n.x + 1.0) * sqrt(n.y + 1.0) / (8.0 * BRDF_PI);
    return norm * power / max(brdf_half_cosine(wi, wo) * max(wi.z, wo.z), 1e-37);
}

fn brdf_side(z: f32) -> f32 {
    return 1.0 - brdf_pow5(1.0 - 0.5 * z);
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let lobe = brdf_lobe(wi, wo, brdf_half(wi, wo));
    let fresnel = brdf_schlick(brdf.rs.rgb, brdf_half_cosine(wi, wo));
    let diffuse = 28.0 / (23.0 * BRDF_PI) * brdf_side(wi.z) * brdf_side(wo.z);
    return lobe * fresnel + diffuse * brdf.rd.rgb * (1.0 - brdf.rs.rgb);
}
