// No shadow volumes.
fn gpu_shadows(at: vec2<u32>, size: vec2<u32>, samples: u32) {
}
