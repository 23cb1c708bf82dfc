// The twin of lambert.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    albedo: vec4<f32>,
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return select(vec3<f32>(0.0), brdf.albedo.rgb * BRDF_INV_PI, brdf_above(wi, wo));
}
