// n^T M n, M symmetric.
fn quadric(m: mat4x4<f32>, n: vec3<f32>) -> f32 {
    let square = m[0].x * n.x * n.x + m[1].y * n.y * n.y + m[2].z * n.z * n.z;
    let cross_terms = m[0].y * n.x * n.y + m[0].z * n.x * n.z + m[1].z * n.y * n.z;
    let linear = m[0].w * n.x + m[1].w * n.y + m[2].w * n.z;
    return square + 2.0 * (cross_terms + linear) + m[3].w;
}

// Fdez-Aguera 2019: F_ms E_ms.
fn multiscatter(f0: vec3<f32>, a: f32, b: f32) -> vec3<f32> {
    let e_ms = 1.0 - (a + b);
    let f_avg = f0 + (vec3<f32>(1.0) - f0) / 21.0;
    return technique.scale.w * (f0 * a + b) * f_avg / (vec3<f32>(1.0) - f_avg * e_ms) * e_ms;
}

// Factor of the irradiance over pi: energy returned by multiple scattering, and the diffuse base attenuated
// by the energy that the specular layer reflects.
fn diffuse(f0: vec3<f32>, base: vec3<f32>, a: f32, b: f32) -> vec3<f32> {
    return multiscatter(f0, a, b) + base * (vec3<f32>(1.0) - f0 * a - b);
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let l = fetch_chain(technique.turn * (2.0 * cos_o * n - wo), technique.f0.w);
    let ab = fetch_albedo(sqrt(min(cos_o, 1.0)));
    let e = vec3<f32>(quadric(technique.red, n), quadric(technique.green, n), quadric(technique.blue, n));
    let d = diffuse(technique.f0.rgb, technique.base.rgb, ab.x, ab.y);
    return technique.scale.rgb * ((technique.f0.rgb * ab.x + ab.y) * l + d * e);
}
