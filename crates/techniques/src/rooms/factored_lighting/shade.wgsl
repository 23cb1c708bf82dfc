fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    var log = vec3<f32>(0.0);
    if room.used.x > 0.0 {
        log += fetch_normal(room.turn * n);
    }
    if room.used.y > 0.0 {
        log += fetch_mirror(room.turn * (2.0 * cos_o * n - wo));
    }
    if room.used.z > 0.0 {
        log += fetch_viewer(room.turn * wo);
    }
    if room.used.w > 0.0 {
        log += fetch_elevation(sqrt(min(cos_o, 1.0))).rgb;
    }
    return room.scale.rgb * exp(log);
}
