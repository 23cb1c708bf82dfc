fn local_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let at = local_places(wi, wo);
    let scale = wi.z * select(1.0, 2.0 / max(1.0 + dot(wi, wo), 1e-6), technique.local_tint.w > 0.5);
    return scale * max(local_sum(at.xy, at.zw), vec3<f32>(0.0));
}
