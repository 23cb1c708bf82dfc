// The tangent; where there is none, that of surfaces without tangents.
fn tangent(n: vec3<f32>, t: vec3<f32>) -> vec3<f32> {
    if dot(t, t) > 0.25 {
        return normalize(t);
    }
    if abs(n.y) < 0.99 {
        return normalize(vec3<f32>(n.z, 0.0, -n.x));
    }
    return normalize(vec3<f32>(0.0, -n.z, n.y));
}
