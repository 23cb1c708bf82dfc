// From a light's counts to a bit for each of the four samples of a pixel (multisampling) or quad of texels.
// GpuCounts, GPU_QUAD and gpu_count come with the kind of target.
@group(0) @binding(0) var gpu_counts: GpuCounts;
@group(0) @binding(1) var<storage, read_write> gpu_masks: array<u32>;
@group(0) @binding(2) var<uniform> gpu_volume: GpuVolume;

@compute @workgroup_size(8, 8)
fn gpu_keep(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(gpu_counts) / GPU_QUAD;
    if any(id.xy >= size) {
        return;
    }
    var bits = 0u;
    for (var k = 0u; k < 4u; k++) {
        if gpu_count(id.xy, k) > 0.5 {
            bits |= 1u << k;
        }
    }
    // Eight lights a word; the first of them clears it.
    let light = gpu_volume.counts.z;
    let i = (light / 8u * size.y + id.y) * size.x + id.x;
    let others = select(gpu_masks[i], 0u, light % 8u == 0u);
    gpu_masks[i] = others | (bits << (4u * (light % 8u)));
}
