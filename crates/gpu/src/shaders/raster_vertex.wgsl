@vertex
fn gpu_vertex(@builtin(vertex_index) i: u32) -> GpuVarying {
    let v = gpu_index(i);
    let p = gpu_position(v);
    var out: GpuVarying;
    out.position = gpu_camera.view_projection * vec4<f32>(p, 1.0);
    out.p = p;
    out.n = gpu_object.normals * gpu_vertex_row(3u * v + 1u).xyz;
    let t = gpu_vertex_row(3u * v + 2u);
    out.t = vec4<f32>((gpu_object.model * vec4<f32>(t.xyz, 0.0)).xyz, t.w);
    out.uv = gpu_uv(v);
    out.extra = vec4<f32>(gpu_vertex_colour(v), gpu_bend(gpu_corners(i / 3u)));
    // Only textures and meshes without normals need it.
    if GPU_MAPPED || GPU_SITED || GPU_SHADOWED || gpu_object.images[GPU_TINT].levels > 0u || gpu_object.images[GPU_EMISSION].levels > 0u || all(out.n == vec3<f32>(0.0)) {
        out.plane = gpu_plane(gpu_corners(i / 3u));
    }
    if GPU_SITED || GPU_SHADOWED {
        out.corners = gpu_corners(i / 3u);
        out.weights = select(vec3<f32>(0.0), vec3<f32>(1.0), vec3<u32>(i % 3u) == vec3<u32>(0u, 1u, 2u));
    }
    return out;
}
