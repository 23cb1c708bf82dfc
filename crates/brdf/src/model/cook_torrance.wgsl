// The twin of cook_torrance.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // w: m
    f0: vec4<f32>,
    // 1 for Smith's masking
    kind: vec4<f32>,
}

fn brdf_beckmann(h: vec3<f32>, m: f32) -> f32 {
    let c2 = h.z * h.z;
    let e = exp(-dot(h.xy, h.xy) / max(c2 * m * m, 1e-37));
    return select(0.0, e / (BRDF_PI * m * m * max(c2 * c2, 1e-30)), e > 0.0);
}

fn brdf_smith_over_cosine(w: vec3<f32>, m: f32) -> f32 {
    let sine = length(w.xy);
    if sine <= 0.0 {
        return 1.0 / w.z;
    }
    let a = min(w.z / max(m * sine, BRDF_TINY), 1e4);
    return 2.0 / (w.z * (1.0 + brdf_erf(a)) + m * sine * exp(-a * a) * 0.564189583547756);
}

// G/(4 n.wi n.wo).
fn brdf_masking(wi: vec3<f32>, wo: vec3<f32>, h: vec3<f32>) -> f32 {
    if brdf.kind.x > 0.0 {
        return 0.25 * brdf_smith_over_cosine(wi, brdf.f0.w) * brdf_smith_over_cosine(wo, brdf.f0.w);
    }
    let low = min(wi.z, wo.z);
    let high = max(wi.z, wo.z);
    let open = 0.25 / max(low * high, 1e-37);
    return min(open, h.z / max(2.0 * brdf_half_cosine(wi, wo) * high, 1e-37));
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let h = brdf_half(wi, wo);
    let d = brdf_beckmann(h, brdf.f0.w);
    if d <= 0.0 {
        return vec3<f32>(0.0);
    }
    return brdf_schlick(brdf.f0.rgb, brdf_half_cosine(wi, wo)) * (d * brdf_masking(wi, wo, h));
}
