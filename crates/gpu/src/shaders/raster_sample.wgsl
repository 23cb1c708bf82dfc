// Devices differ in whether the mask of a fragment that is one sample's has all samples of the pixel.
@fragment
fn gpu_fragment(v: GpuVarying, @builtin(front_facing) front: bool, @builtin(sample_index) k: u32) -> @location(0) vec4<f32> {
    return gpu_shown(v, front, 1u << k);
}
