fn position(d: vec3<f32>) -> vec2<f32> {
    let scale = 0.5 / (technique.extent * (1.0 + abs(d.z)));
    return d.xy * scale + vec2<f32>(0.5);
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let d = technique.turn * select(2.0 * cos_o * n - wo, n, technique.factor.w > 0.5);
    let at = position(d);
    if d.z < 0.0 {
        return technique.factor.rgb * fetch_back(at).rgb;
    }
    return technique.factor.rgb * fetch_front(at).rgb;
}
