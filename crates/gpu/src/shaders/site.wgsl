// The point's place among the sites of a bake.
fn gpu_site_of(s: GpuPoint) -> Site {
    let index = vec3<u32>(gpu_site(s.corners.x), gpu_site(s.corners.y), gpu_site(s.corners.z));
    return Site(index, s.weights, s.uv);
}
