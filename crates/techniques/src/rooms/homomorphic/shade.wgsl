fn local_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let code = technique.local_scale.w;
    let form = technique.local_form;
    let sum = (wi + wo) * vec3<f32>(form.xy, 1.0);
    let h = sum / max(length(sum), 1e-18);
    let side = fetch_local_side_layer(local_from_horizon(code, wi), 0u)
        + fetch_local_side_layer(local_from_horizon(code, wo), 0u);
    let sum_of_logs = side + fetch_local_half_layer(local_from_pole(code, h), 0u);
    // Underflow would be a logarithm without bound.
    let risen = form.z * log(max(wi.z * wo.z, 1e-30));
    return wi.z * technique.local_scale.rgb * exp(min(sum_of_logs.rgb - risen, vec3<f32>(60.0)));
}
