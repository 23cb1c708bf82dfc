struct GpuVarying {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(perspective, centroid) p: vec3<f32>,
    @location(1) @interpolate(perspective, centroid) n: vec3<f32>,
    @location(2) @interpolate(perspective, centroid) t: vec3<f32>,
    @location(3) @interpolate(perspective, centroid) uv: vec2<f32>,
    @location(4) @interpolate(flat) plane: vec4<f32>,
}

@vertex
fn gpu_vertex(@builtin(vertex_index) i: u32) -> GpuVarying {
    let v = gpu_indices[i];
    let p = gpu_position(v);
    var out: GpuVarying;
    out.position = gpu_camera.view_projection * vec4<f32>(p, 1.0);
    out.p = p;
    out.n = gpu_object.normals * gpu_vertices[3u * v + 1u].xyz;
    out.t = (gpu_object.model * vec4<f32>(gpu_vertices[3u * v + 2u].xyz, 0.0)).xyz;
    out.uv = gpu_uv(v);
    // Only textures and meshes without normals need it.
    if gpu_object.counts.z > 0u || all(out.n == vec3<f32>(0.0)) {
        out.plane = gpu_plane(gpu_corners(i / 3u));
    }
    return out;
}

@fragment
fn gpu_fragment(v: GpuVarying, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let outside = front != (gpu_object.counts.w > 0u);
    let side = select(-1.0, 1.0, outside);
    return vec4<f32>(gpu_radiance(GpuPoint(v.p, v.n, v.t, v.uv, v.plane, side)), 1.0);
}
