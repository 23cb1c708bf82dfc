@fragment
fn gpu_page_fragment(v: GpuVarying, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let outside = front != (gpu_object.counts.w > 0u);
    let side = select(-1.0, 1.0, outside);
    let l = gpu_radiance(GpuPoint(v.p, v.n, v.t, v.uv, v.plane, side, v.corners, v.weights, v.extra));
    if gpu_shown.gain.z > 0.0 {
        return vec4<f32>(gpu_heat(l, v.p), 1.0);
    }
    return vec4<f32>(gpu_picture(l), 1.0);
}
