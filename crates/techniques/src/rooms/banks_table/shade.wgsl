fn local_coordinate(w: vec3<f32>) -> f32 {
    if technique.local_diffuse.w == 0.0 {
        return 0.5 + 0.5 * w.x;
    }
    let a = local_angle(min(abs(w.x), 1.0), min(length(w.yz), 1.0));
    return 0.5 + 0.31830987 * select(a, -a, w.x < 0.0);
}

fn local_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let parts = fetch_local_banks(vec2<f32>(local_coordinate(wi), local_coordinate(wo)));
    return wi.z * (technique.local_diffuse.rgb * parts.x + technique.local_specular.rgb * parts.y);
}
