struct GpuSkyVarying {
    @builtin(position) position: vec4<f32>,
    @location(0) at: vec2<f32>,
}

@vertex
fn gpu_page_sky_vertex(@builtin(vertex_index) i: u32) -> GpuSkyVarying {
    // One triangle over the whole film.
    let p = vec4<f32>(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
    // Pixels from the top left corner: what the builtin position counts from differs between the APIs.
    return GpuSkyVarying(p, vec2<f32>(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y) * gpu_camera.film.xy);
}

@fragment
fn gpu_page_sky_fragment(v: GpuSkyVarying) -> @location(0) vec4<f32> {
    if gpu_shown.gain.z > 0.0 {
        return vec4<f32>(GPU_NO_HEAT, 1.0);
    }
    return vec4<f32>(gpu_picture(gpu_background(gpu_ray(v.at))), 1.0);
}
