fn local_places(wi: vec3<f32>, wo: vec3<f32>) -> vec4<f32> {
    let codes = technique.local_maps;
    return vec4<f32>(local_from_horizon(codes.x, wo), local_from_horizon(codes.y, wi));
}
