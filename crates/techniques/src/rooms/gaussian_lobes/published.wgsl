
// Sum of A_l o_l P_l(c): the visibility's denominator, that of an open site.
fn open_sum(zonal: vec4<f32>, c: f32) -> f32 {
    return 0.5 + zonal.x * 0.75 * c - zonal.z * THIRD * c * (5.0 * c * c - 3.0);
}

// V in direction d; directions below the horizon take the value at the horizon.
fn visible(b: Blocked, n: vec3<f32>, zonal: vec4<f32>, d: vec3<f32>) -> f32 {
    let c = dot(n, d);
    let up = d - min(c, 0.0) * n;
    let scale = inverseSqrt(max(dot(up, up), 1e-12));
    let seen = 1.0 - hidden(b, zonal, scale * up) / open_sum(zonal, scale * max(c, 0.0));
    return clamp(seen, 0.0, 1.0);
}
