fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let f = fresnel(vec2<f32>(technique.k_s.w, technique.k_d_over_pi.w), min(cos_o, 1.0));
    let diffuse = fetch_irradiance(technique.turn * n);
    let phong = fetch_phong(technique.turn * (2.0 * cos_o * n - wo));
    return (1.0 - f) * technique.k_d_over_pi.rgb * diffuse + f * technique.k_s.rgb * phong;
}
