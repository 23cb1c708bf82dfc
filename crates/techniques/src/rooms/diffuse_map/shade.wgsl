fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    if !(dot(n, wo) > 0.0) {
        return vec3<f32>(0.0);
    }
    return technique.albedo.rgb * fetch_irradiance_over_pi(technique.turn * n);
}
