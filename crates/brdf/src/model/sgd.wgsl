// The twin of sgd.rs, all channels at once. Powers of a^k with k in the hundreds go through ln(1 + x).
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    rho_d: vec4<f32>,
    rho_s: vec4<f32>,
    alpha: vec4<f32>,
    p: vec4<f32>,
    f0: vec4<f32>,
    f1: vec4<f32>,
    kappa: vec4<f32>,
    lambda: vec4<f32>,
    // ln c
    ln_c: vec4<f32>,
    k: vec4<f32>,
    // pi/2 - 1 - theta_0 and its rounding error: elevations are exact where angles from the normal round
    rise: vec4<f32>,
    rise_low: vec4<f32>,
}

fn brdf_d(tan2: f32, cos2: f32) -> vec3<f32> {
    let a = brdf.alpha.rgb + tan2 / brdf.alpha.rgb;
    let e = exp(-min(a, vec3<f32>(200.0)));
    return select(vec3<f32>(0.0), brdf.kappa.rgb * e * BRDF_INV_PI / (pow(a, brdf.p.rgb) * cos2 * cos2), e > vec3<f32>(0.0));
}

fn brdf_g1_of(c: i32, elevation: f32) -> f32 {
    // theta - theta_0 - 1.
    let more = (brdf.rise[c] - elevation) + brdf.rise_low[c];
    if more <= -1.0 {
        return 1.0;
    }
    let x = exp(min(brdf.k[c] * brdf_ln_1p(more) + brdf.ln_c[c], 4.0));
    return clamp(1.0 - brdf.lambda[c] * brdf_exp_m1(x), 0.0, 1.0);
}

fn brdf_g1(w: vec3<f32>) -> vec3<f32> {
    let elevation = brdf_atan2(w.z, length(w.xy));
    return vec3<f32>(brdf_g1_of(0, elevation), brdf_g1_of(1, elevation), brdf_g1_of(2, elevation));
}

fn brdf_fresnel(u: f32) -> vec3<f32> {
    return brdf.f0.rgb - brdf.f1.rgb * u + (1.0 - brdf.f0.rgb) * brdf_pow5(1.0 - u);
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let h = brdf_half(wi, wo);
    let cos2 = max(h.z * h.z, BRDF_TINY);
    let d = brdf_d(dot(h.xy, h.xy) / cos2, cos2);
    let g = brdf_g1(wi) * brdf_g1(wo);
    let s = brdf_fresnel(brdf_half_cosine(wi, wo)) * d * g / max(wi.z * wo.z, 1e-37);
    return BRDF_INV_PI * (brdf.rho_d.rgb + brdf.rho_s.rgb * s);
}
