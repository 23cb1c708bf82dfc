// The twin of charlie.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // w: alpha
    color: vec4<f32>,
}

// Estevez and Kulla's fit, between alpha = 1 and alpha = 0.
fn brdf_lambda_fit(x: f32, t: f32) -> f32 {
    let a = mix(21.5473, 25.3245, t);
    let b = mix(3.82987, 3.32435, t);
    let c = mix(0.19823, 0.16801, t);
    let d = mix(-1.97760, -1.27393, t);
    let e = mix(-4.32054, -4.85967, t);
    return a / (1.0 + b * brdf_positive_pow(x, c)) + d * x + e;
}

fn brdf_lambda(mu: f32) -> f32 {
    let t = (1.0 - brdf.color.w) * (1.0 - brdf.color.w);
    if mu < 0.5 {
        return exp(brdf_lambda_fit(mu, t));
    }
    return exp(2.0 * brdf_lambda_fit(0.5, t) - brdf_lambda_fit(1.0 - mu, t));
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let h = brdf_half(wi, wo);
    let power = 1.0 / brdf.color.w;
    let d = (2.0 + power) * brdf_positive_pow(min(length(h.xy), 1.0), power) / (2.0 * BRDF_PI);
    let shadow = 1.0 + brdf_lambda(min(wi.z, 1.0)) + brdf_lambda(min(wo.z, 1.0));
    return brdf.color.rgb * (d / max(4.0 * shadow * wi.z * wo.z, BRDF_TINY));
}
