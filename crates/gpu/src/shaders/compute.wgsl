// Shading of the visibility buffer, one thread a pixel.
@group(3) @binding(0) var gpu_ids: texture_2d<u32>;
@group(3) @binding(1) var gpu_colour: texture_storage_2d<FORMAT, write>;

const GPU_GRID: u32 = GRIDu;
const GPU_SAMPLES: u32 = SAMPLESu;
// Is a triangle shaded once in a pixel, or at each of its samples?
const GPU_SHARE: bool = SHARE;

fn gpu_sample(pixel: vec2<u32>, k: u32) -> vec2<u32> {
    return pixel * GPU_GRID + vec2<u32>(k % GPU_GRID, k / GPU_GRID);
}
