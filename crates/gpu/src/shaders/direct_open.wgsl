
// Nothing blocks lights.
fn gpu_arriving(p: vec3<f32>, n: vec3<f32>, d: vec3<f32>, distance: f32) -> f32 {
    return 1.0;
}

fn gpu_seen_disk(disk: vec4<f32>, frame: mat3x3<f32>, o: vec3<f32>, n: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    return gpu_disk(frame * disk.xyz, disk.w, o);
}
