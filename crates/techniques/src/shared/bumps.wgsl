struct LocalFrame {
    t: vec3<f32>,
    b: vec3<f32>,
}

// Tangent and bitangent across a bumped normal, in the frame of the surface itself.
fn local_frame(n: vec3<f32>) -> LocalFrame {
    let along = vec3<f32>(1.0 - n.x * n.x, -n.x * n.y, -n.x * n.z);
    let square = dot(along, along);
    var t = vec3<f32>(0.0, 0.0, -1.0);
    if square > 1e-12 {
        t = along / sqrt(square);
    }
    return LocalFrame(t, cross(n, t));
}
