// The visibility buffer: which triangle each sample sees, 0 for none.
struct GpuSeen {
    // The position is invariant: shadow volumes are drawn to the same depths.
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) @interpolate(flat) id: u32,
}

@vertex
fn gpu_seen_vertex(@builtin(vertex_index) i: u32) -> GpuSeen {
    let p = gpu_position(gpu_index(i));
    let id = 1u + gpu_object.counts.x + i / 3u;
    return GpuSeen(gpu_camera.view_projection * vec4<f32>(p, 1.0), id);
}

@fragment
fn gpu_seen_fragment(v: GpuSeen) -> @location(0) u32 {
    return v.id;
}
