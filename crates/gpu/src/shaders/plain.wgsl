
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

fn gpu_vertex_colour(v: u32) -> vec3<f32> {
    return vec3<f32>(1.0);
}

fn gpu_bend(c: vec3<u32>) -> f32 {
    return 0.0;
}
