@fragment
fn gpu_fragment(v: GpuVarying, @builtin(front_facing) front: bool, @builtin(sample_mask) mask: u32) -> @location(0) vec4<f32> {
    return gpu_shown(v, front, mask);
}
