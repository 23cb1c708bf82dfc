// The twin of phong.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // n, factor, 1 where light from below the horizon counts
    lobe: vec4<f32>,
}

fn brdf_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if wo.z <= 0.0 || (brdf.lobe.z == 0.0 && wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    return vec3<f32>(brdf.lobe.y * brdf_power_cosine(brdf_mirror(wo), wi, brdf.lobe.x));
}
