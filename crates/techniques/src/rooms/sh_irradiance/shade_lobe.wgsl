
fn shade_lobe(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, lobe: Lobe) -> vec3<f32> {
    var l = vec3<f32>(0.0);
    for (var k = 0; k < 4; k++) {
        let m = lobe_normal(n, t, lobe, k);
        l += 0.25 * vec3<f32>(quadric(technique.red, m), quadric(technique.green, m), quadric(technique.blue, m));
    }
    return select(vec3<f32>(0.0), l, dot(n, wo) > 0.0);
}
