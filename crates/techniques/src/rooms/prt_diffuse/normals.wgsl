// The nine harmonics of a unit vector.
fn normal_harmonics(n: vec3<f32>) -> array<f32, 9> {
    return array<f32, 9>(
        0.2820948,
        0.4886025 * n.y,
        0.4886025 * n.z,
        0.4886025 * n.x,
        1.0925484 * (n.x * n.y),
        1.0925484 * (n.y * n.z),
        0.9461747 * (n.z * n.z) - 0.31539157,
        1.0925484 * (n.x * n.z),
        0.5462742 * (n.x * n.x - n.y * n.y));
}

// Harmonics of the bumped normal minus those of the surface's own.
fn normal_difference(n: vec3<f32>, own: vec3<f32>) -> array<f32, 9> {
    var d = array<f32, 9>(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    if dot(own, own) < 0.5 {
        return d;
    }
    let a = normal_harmonics(n);
    let b = normal_harmonics(own);
    for (var k = 0u; k < 9u; k++) {
        d[k] = a[k] - b[k];
    }
    return d;
}
