alias GpuCounts = texture_2d<f32>;
const GPU_QUAD: u32 = 2u;

fn gpu_count(at: vec2<u32>, k: u32) -> f32 {
    return textureLoad(gpu_counts, 2u * at + vec2<u32>(k % 2u, k / 2u), 0).x;
}
