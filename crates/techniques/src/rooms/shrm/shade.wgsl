fn map_at(uv: vec3<f32>, k: u32) -> vec3<f32> {
    return fetch_maps(uv.xy, k).rgb;
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let c = technique.turn * central(n, t, 2.0 * cos_o * n - wo);
    // Harmonics of the view, or of the normal.
    let b = sum(vec3<f32>(globe_uv(c), 0.0), globe_local(c, technique.turn * select(wo, n, technique.orders.w == 1.0)));
    let a = fetch_scale((angle(min(cos_o, 1.0)) - technique.range.x) * technique.range.y).rgb;
    return a * b + diffuse(technique.turn * n) + exact_radiance(n, tangent(n, t), wo);
}
