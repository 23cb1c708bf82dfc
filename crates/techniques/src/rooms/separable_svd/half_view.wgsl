fn local_places(wi: vec3<f32>, wo: vec3<f32>) -> vec4<f32> {
    let codes = technique.local_maps;
    let sum = wi + wo;
    let h = sum / max(length(sum), 1e-18);
    return vec4<f32>(local_from_pole(codes.x, h), local_from_horizon(codes.y, wo));
}
