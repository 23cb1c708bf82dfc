// The twin of abc.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    kd: vec4<f32>,
    a: vec4<f32>,
    // b, c, ior
    shape: vec4<f32>,
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let h = brdf_half(wi, wo);
    let u = brdf_half_cosine(wi, wo);
    let versine = dot(h.xy, h.xy) / (1.0 + h.z);
    let d = pow(1.0 + brdf.shape.x * versine, -brdf.shape.y);
    let low = min(wi.z, wo.z);
    let high = max(wi.z, wo.z);
    let masking = min(1.0 / max(low * high, 1e-37), 2.0 * h.z / max(u * high, 1e-37));
    let s = brdf_dielectric(u, brdf.shape.z) * d * masking;
    return BRDF_INV_PI * (brdf.kd.rgb + brdf.a.rgb * s);
}
