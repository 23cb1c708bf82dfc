// h·l, θ_h and φ_h over π/2.
fn local_half(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let v = wi + wo;
    let size = max(sqrt(dot(v, v)), 1e-18);
    let side = sqrt(dot(v.xy, v.xy));
    let theta = 0.63661977 * local_angle(min(side / size, 1.0), min(v.z / size, 1.0));
    var phi = 0.0;
    if side > 0.0 {
        phi = 0.63661977 * local_angle(min(abs(v.y) / side, 1.0), min(abs(v.x) / side, 1.0));
    }
    return vec3<f32>(min(0.5 * size, 1.0), theta, phi);
}
