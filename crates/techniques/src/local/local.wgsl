// The loop over directional and point lights: eight numbers a light, as Light::row has them.
fn local_radiance(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let frame = transpose(mat3x3<f32>(t, cross(n, t), n));
    let o = frame * wo;
    if !(o.z > 0.0) {
        return vec3<f32>(0.0);
    }
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < u32(technique.local_count); k++) {
        var d = vec3<f32>(fetch_local_lights(k, 0u), fetch_local_lights(k, 1u), fetch_local_lights(k, 2u));
        var e = vec3<f32>(fetch_local_lights(k, 4u), fetch_local_lights(k, 5u), fetch_local_lights(k, 6u));
        if fetch_local_lights(k, 3u) > 0.0 {
            let to = d - p;
            let d2 = dot(to, to);
            if !(d2 > 0.0) {
                continue;
            }
            d = to / sqrt(d2);
            e = clamp(e / d2, vec3<f32>(-1e30), vec3<f32>(1e30));
        }
        sum = clamp(sum + local_f_cos(frame * d, o) * e, vec3<f32>(-3.4028234e38), vec3<f32>(3.4028234e38));
    }
    return sum;
}
