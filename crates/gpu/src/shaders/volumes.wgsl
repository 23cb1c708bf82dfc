// The shadow volume of a light.
struct GpuVolume {
    // Unit direction or position of the light; w: 1 for a position.
    light: vec4<f32>,
    // Caps, sides, number of the light, unused.
    counts: vec4<u32>,
    // x: w of points at infinity under parallel rays, for which w = 0 would not be visible.
    far: vec4<f32>,
}
