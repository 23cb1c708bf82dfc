
// The fraction of the hemisphere that is not blocked.
fn visible(b: Blocked, n: vec3<f32>, zonal: vec4<f32>, d: vec3<f32>) -> f32 {
    return clamp(1.0 - 2.0 * hidden(b, zonal, d), 0.0, 1.0);
}
