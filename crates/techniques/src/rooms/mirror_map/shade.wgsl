fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let r = 2.0 * cos_o * n - wo;
    return technique.scale.rgb * fresnel(technique.f0.rgb, min(cos_o, 1.0)) * fetch_environment(technique.turn * r);
}
