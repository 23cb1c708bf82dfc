fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    var log = vec3<f32>(0.0);
    if technique.used.x > 0.0 {
        log += fetch_normal(technique.turn * n);
    }
    if technique.used.y > 0.0 {
        log += fetch_mirror(technique.turn * (2.0 * cos_o * n - wo));
    }
    if technique.used.z > 0.0 {
        log += fetch_viewer(technique.turn * wo);
    }
    if technique.used.w > 0.0 {
        log += fetch_elevation(sqrt(min(cos_o, 1.0))).rgb;
    }
    return technique.scale.rgb * exp(log);
}
