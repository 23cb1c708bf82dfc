
// Normal and tangent of a point of an object without maps.
const GPU_MAPPED: bool = false;

struct GpuLook {
    n: vec3<f32>,
    t: vec3<f32>,
}

fn gpu_look(s: GpuPoint, outward: vec3<f32>, wo: vec3<f32>, footprint: f32) -> GpuLook {
    let n = gpu_facing(s.side * outward, wo);
    return GpuLook(n, gpu_tangent(n, s.t.xyz));
}
