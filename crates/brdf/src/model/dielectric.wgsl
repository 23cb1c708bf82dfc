// The twin of dielectric.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // w: alpha
    f0: vec4<f32>,
    // albedo/(π (1 − Ē))
    base: vec4<f32>,
    // A and B of two neighbours each, at √μ = i/31
    nodes: array<vec4<f32>, BRDF_NODES>,
}

fn brdf_node(i: u32) -> vec2<f32> {
    let pair = brdf.nodes[i / 2u];
    return select(pair.xy, pair.zw, i % 2u == 1u);
}

// 1 − E(μ).
fn brdf_through(mu: f32) -> vec3<f32> {
    let x = sqrt(clamp(mu, 0.0, 1.0)) * 31.0;
    let i = min(u32(x), 30u);
    let ab = mix(brdf_node(i), brdf_node(i + 1u), x - f32(i));
    return max(vec3<f32>(1.0) - brdf.f0.rgb * ab.x - ab.y, vec3<f32>(0.0));
}

fn brdf_stretched_length(w: vec3<f32>) -> f32 {
    return length(vec3<f32>(brdf.f0.w * w.xy, w.z));
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let h = brdf_half(wi, wo);
    let x = h.xy / brdf.f0.w;
    let q = dot(x, x) + h.z * h.z;
    let d = 1.0 / (BRDF_PI * brdf.f0.w * brdf.f0.w * q * q);
    let s = brdf_stretched_length(wi) * wo.z + brdf_stretched_length(wo) * wi.z;
    let layer = brdf_schlick(brdf.f0.rgb, brdf_half_cosine(wi, wo)) * (0.5 * d / max(s, BRDF_TINY));
    return layer + brdf.base.rgb * brdf_through(wi.z) * brdf_through(wo.z);
}
