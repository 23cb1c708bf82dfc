// x' = dC/d(alpha) and y' of the frame at unit C whose pole is +Y; beta = 0 on the poles.
fn globe_local(c: vec3<f32>, v: vec3<f32>) -> vec3<f32> {
    let s = sqrt(c.x * c.x + c.z * c.z);
    var b = vec2<f32>(1.0, 0.0);
    if s > 0.0 {
        b = c.xz / s;
    }
    let x = vec3<f32>(c.y * b.x, -s, c.y * b.y);
    return vec3<f32>(dot(x, v), b.y * v.x - b.x * v.z, dot(c, v));
}

// 0.5 + beta/2pi, alpha/pi.
fn globe_uv(c: vec3<f32>) -> vec2<f32> {
    let s = sqrt(c.x * c.x + c.z * c.z);
    var u = 0.5;
    if s > 0.0 {
        u += brdf_atan2(c.z, c.x) * 0.15915494309189535;
    }
    return vec2<f32>(u, brdf_atan2(s, c.y) * 0.3183098861837907);
}

// The angle of a cosine to rounding: acos may be off by 7e-5 (WGSL allows it, and Mesa takes it).
fn angle(c: f32) -> f32 {
    return brdf_atan2(sqrt((1.0 - c) * (1.0 + c)), c);
}
