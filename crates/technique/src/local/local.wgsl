
// The loop over directional and point lights.
fn local_radiance(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let frame = transpose(mat3x3<f32>(t, cross(n, t), n));
    let o = frame * wo;
    if !(o.z > 0.0) {
        return vec3<f32>(0.0);
    }
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < u32(technique.local_count); k++) {
        let light = local_light(k, p);
        if light.there {
            let f = local_f_cos(frame * light.d, o);
            let seen = light_arriving(p, n, light.d, light.distance);
            sum = clamp(sum + seen * f * light.e, vec3<f32>(-3.4028234e38), vec3<f32>(3.4028234e38));
        }
    }
    return sum;
}
