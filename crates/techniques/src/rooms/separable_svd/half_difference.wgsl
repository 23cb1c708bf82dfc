fn local_places(wi: vec3<f32>, wo: vec3<f32>) -> vec4<f32> {
    let codes = technique.local_maps;
    let sum = wi + wo;
    let size = max(length(sum), 1e-18);
    let h = sum / size;
    let up = min(0.5 * size, 1.0);
    var d = vec2<f32>(wi.x - h.x * up, h.z * wi.y - h.y * wi.z) / sqrt(max(1.0 - h.x * h.x, 1e-12));
    // Mirrors that bring h to the first quadrant.
    if codes.x > 3.5 {
        d = select(d, -d, h.xy < vec2<f32>(0.0));
    }
    return vec4<f32>(local_from_pole(codes.x, h), local_from_horizon(codes.y, vec3<f32>(d, up)));
}
