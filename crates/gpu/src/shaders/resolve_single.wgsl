// Targets with one sample a texel.
alias GpuSource = texture_2d<f32>;
const GPU_SAMPLES: i32 = 1;
const GPU_POSITIONS = array<vec2<f32>, 1>(vec2<f32>(0.5, 0.5));

fn gpu_load(at: vec2<i32>, k: i32) -> vec4<f32> {
    return textureLoad(gpu_source, at, 0);
}
