// The twin of blinn_phong.rs, both models: f_cos = (kd/pi + kn (n.h)^n) n.wi + ks (n.h)^n.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // w: n
    kd: vec4<f32>,
    // w: kn
    ks: vec4<f32>,
}

fn brdf_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let power = brdf_power_cosine(vec3<f32>(0.0, 0.0, 1.0), brdf_half(wi, wo), brdf.kd.w);
    return (brdf.kd.rgb * BRDF_INV_PI + brdf.ks.w * power) * wi.z + brdf.ks.rgb * power;
}
