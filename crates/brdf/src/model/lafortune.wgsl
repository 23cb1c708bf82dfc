// The twin of lafortune.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    kd: vec4<f32>,
    // ks per channel
    factors: array<vec4<f32>, BRDF_LOBES>,
    // (c_x, c_y, c_z, n) of red, green and blue, lobe after lobe
    lobes: array<vec4<f32>, BRDF_LOBE_CHANNELS>,
}

fn brdf_cosine(lobe: vec4<f32>, ks: f32, wi: vec3<f32>, wo: vec3<f32>) -> f32 {
    let o = lobe.xyz * wo;
    let c = dot(o, wi);
    if c <= 0.0 || ks == 0.0 {
        return 0.0;
    }
    if lobe.w < 1e3 {
        return ks * pow(c, lobe.w);
    }
    let l = length(o);
    return ks * exp(lobe.w * log(l)) * brdf_power_cosine(o / l, wi, lobe.w);
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    var sum = brdf.kd.rgb * BRDF_INV_PI;
    for (var i = 0u; i < BRDF_LOBES; i++) {
        let ks = brdf.factors[i];
        sum += vec3<f32>(
            brdf_cosine(brdf.lobes[3u * i], ks.x, wi, wo),
            brdf_cosine(brdf.lobes[3u * i + 1u], ks.y, wi, wo),
            brdf_cosine(brdf.lobes[3u * i + 2u], ks.z, wi, wo),
        );
    }
    return sum;
}
