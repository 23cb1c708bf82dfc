// The twin of minnaert.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // w: k
    albedo: vec4<f32>,
}

fn brdf_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let k = brdf.albedo.w;
    return brdf.albedo.rgb * (BRDF_INV_PI * pow(wi.z, k) * pow(wo.z, k - 1.0));
}
