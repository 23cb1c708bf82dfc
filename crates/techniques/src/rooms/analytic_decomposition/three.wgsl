fn local_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let h = local_half(wi, wo);
    let base = fetch_local_base(vec2<f32>(min(wi.z, wo.z), max(wi.z, wo.z)));
    let power = fetch_local_power(vec2<f32>(h.z, h.y)).x;
    let ratio = power * (wi.z / max(base.w, 1e-36)) / h.x;
    return fetch_local_fresnel(h.x).rgb * ratio + wi.z * base.rgb;
}
