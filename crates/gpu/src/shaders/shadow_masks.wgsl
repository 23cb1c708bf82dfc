// Masks of shadow volumes: the visibility of each light, for the samples of a pixel or quad that are shaded
// together.
@group(2) @binding(4) var<storage, read> gpu_masks: array<u32>;

fn gpu_shadows(at: vec2<u32>, size: vec2<u32>, samples: u32) {
    for (var k = 0u; 8u * k < u32(technique.shadow_lights); k++) {
        shadow_blocked[k] = gpu_masks[(k * size.y + at.y) * size.x + at.x];
    }
    shadow_samples = samples;
}
