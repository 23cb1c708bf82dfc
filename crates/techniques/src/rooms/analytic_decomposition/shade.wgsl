fn local_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let h = local_half(wi, wo);
    let ratio = wi.z / max(fetch_local_masking(vec2<f32>(wi.z, wo.z)).x, 1e-36);
    return fetch_local_facets(h.xy).rgb * ratio;
}
