// Samples to pixels: the mean of a pixel's own samples, or the CPU renderer's filter, a quadratic B-spline of
// radius 1.25 pixels.
// GpuSource, gpu_load, GPU_SAMPLES and GPU_POSITIONS come with the kind of target, GPU_LARGEST (of its format) and GPU_REACH
// with format and filter.
@group(0) @binding(0) var gpu_source: GpuSource;
@group(0) @binding(1) var<storage, read_write> gpu_film: array<vec4<f32>>;
// Samples at the end of the target's range.
@group(0) @binding(2) var<storage, read_write> gpu_clipped: atomic<u32>;

fn gpu_weight(distance: f32) -> f32 {
    if GPU_REACH < 1.0 {
        return 1.0;
    }
    let x = abs(distance) * 1.2;
    if x < 0.5 {
        return 0.75 - x * x;
    }
    let y = max(1.5 - x, 0.0);
    return 0.5 * y * y;
}

@compute @workgroup_size(8, 8)
fn gpu_resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<u32>(gpu_camera.film.xy);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let scale = gpu_camera.film.z;
    let texels = vec2<i32>(textureDimensions(gpu_source));
    let centre = vec2<f32>(id.xy) + 0.5;
    let first = max(vec2<i32>(floor((centre - GPU_REACH) * scale)), vec2<i32>(0));
    let last = min(vec2<i32>(ceil((centre + GPU_REACH) * scale)), texels);
    var positions = GPU_POSITIONS;
    var sum = vec4<f32>(0.0);
    var total = 0.0;
    var clipped = 0u;
    for (var y = first.y; y < last.y; y++) {
        for (var x = first.x; x < last.x; x++) {
            for (var k = 0; k < GPU_SAMPLES; k++) {
                let at = (vec2<f32>(vec2<i32>(x, y)) + positions[k]) / scale;
                let w = gpu_weight(at.x - centre.x) * gpu_weight(at.y - centre.y);
                if w > 0.0 {
                    let c = gpu_load(vec2<i32>(x, y), k);
                    sum += w * min(c, vec4<f32>(GPU_LARGEST));
                    total += w;
                    let own = all(vec2<u32>(at) == id.xy);
                    clipped += select(0u, 1u, own && max(max(c.r, c.g), c.b) >= GPU_LARGEST);
                }
            }
        }
    }
    gpu_film[id.y * size.x + id.x] = sum / total;
    if clipped > 0u {
        atomicAdd(&gpu_clipped, clipped);
    }
}
