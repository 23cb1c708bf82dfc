// The point's place among the sites of a bake, and how texture coordinates lie there.
fn gpu_site_of(s: GpuPoint, wo: vec3<f32>, footprint: f32) -> Site {
    let index = vec3<u32>(gpu_site(s.corners.x), gpu_site(s.corners.y), gpu_site(s.corners.z));
    let n = gpu_facing(s.side * gpu_outward(s), wo);
    // A model that mirrors turns the bitangent over, and so does the back.
    let side = s.side * select(1.0, -1.0, (s.t.w < 0.0) != (gpu_object.counts.w > 0u));
    return Site(index, s.weights, s.uv, n, vec4<f32>(gpu_tangent(n, s.t.xyz), side), footprint);
}
