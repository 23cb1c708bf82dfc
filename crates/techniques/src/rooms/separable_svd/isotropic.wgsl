fn local_places(wi: vec3<f32>, wo: vec3<f32>) -> vec4<f32> {
    let codes = technique.local_maps;
    let sum = wi + wo;
    let size = max(length(sum), 1e-18);
    let h = sum / size;
    let up = min(0.5 * size, 1.0);
    let sine = length(h.xy);
    let c = select(vec2<f32>(1.0, 0.0), h.xy / max(sine, 1e-12), sine > 1e-12);
    let d = vec3<f32>(h.z * dot(c, wi.xy) - sine * wi.z, c.x * wi.y - c.y * wi.x, up);
    return vec4<f32>(local_from_pole(codes.x, h), local_from_horizon(codes.y, d));
}
