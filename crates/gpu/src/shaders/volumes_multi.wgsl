alias GpuCounts = texture_multisampled_2d<f32>;
const GPU_QUAD: u32 = 1u;

fn gpu_count(at: vec2<u32>, k: u32) -> f32 {
    return textureLoad(gpu_counts, at, k).x;
}
