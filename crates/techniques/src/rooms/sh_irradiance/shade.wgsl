// n^T M n, M symmetric (Ramamoorthi & Hanrahan 2001, eq. 12).
fn quadric(m: mat4x4<f32>, n: vec3<f32>) -> f32 {
    let square = m[0].x * n.x * n.x + m[1].y * n.y * n.y + m[2].z * n.z * n.z;
    let cross_terms = m[0].y * n.x * n.y + m[0].z * n.x * n.z + m[1].z * n.y * n.z;
    let linear = m[0].w * n.x + m[1].w * n.y + m[2].w * n.z;
    return square + 2.0 * (cross_terms + linear) + m[3].w;
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let l = vec3<f32>(quadric(technique.red, n), quadric(technique.green, n), quadric(technique.blue, n));
    return select(vec3<f32>(0.0), l, dot(n, wo) > 0.0);
}
