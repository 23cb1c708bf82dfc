
fn shade_lobe(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, lobe: Lobe) -> vec3<f32> {
    if !(dot(n, wo) > 0.0) {
        return vec3<f32>(0.0);
    }
    var e = vec3<f32>(0.0);
    for (var k = 0; k < 4; k++) {
        e += 0.25 * fetch_irradiance_over_pi(technique.turn * lobe_normal(n, t, lobe, k));
    }
    return technique.albedo.rgb * e;
}
