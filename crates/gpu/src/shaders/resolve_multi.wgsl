// Four samples a texel, in the standard positions (the same in Vulkan, Direct3D and Metal).
alias GpuSource = texture_multisampled_2d<f32>;
const GPU_SAMPLES: i32 = 4;
const GPU_POSITIONS = array<vec2<f32>, 4>(
    vec2<f32>(0.375, 0.125),
    vec2<f32>(0.875, 0.375),
    vec2<f32>(0.125, 0.625),
    vec2<f32>(0.625, 0.875),
);

fn gpu_load(at: vec2<i32>, k: i32) -> vec4<f32> {
    return textureLoad(gpu_source, at, k);
}
