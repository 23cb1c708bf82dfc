
fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let d = dot(n, wo);
    if !(d > 0.0) {
        return vec3<f32>(0.0);
    }
    return technique.diffuse.rgb * fetch_irradiance(technique.turn * n) + lobes_of(n, t, wo, d, 0.0);
}
