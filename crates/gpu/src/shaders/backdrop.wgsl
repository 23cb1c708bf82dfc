// Background of the objects: a lat-long image, looked up as on the CPU, and disks in front of it.
struct GpuBackdrop {
    colour: vec4<f32>,
    // Disks, 1 where there is an image.
    counts: vec4<u32>,
}
@group(0) @binding(0) var<uniform> gpu_backdrop: GpuBackdrop;
// The image with two more texels on each side: those beyond its seam and its poles.
@group(0) @binding(1) var gpu_sky: texture_2d<f32>;

// Catmull & Rom 1974: weights of the texels at -1, 0, 1, 2.
fn gpu_catmull_rom(t: f32) -> vec4<f32> {
    let t2 = t * t;
    let t3 = t2 * t;
    return 0.5 * vec4<f32>(2.0 * t2 - t3 - t, 3.0 * t3 - 5.0 * t2 + 2.0, 4.0 * t2 - 3.0 * t3 + t, t3 - t2);
}

// The cubic through four values, clamped to the range of the two in the middle: its negative lobes would draw
// rims along sharp edges. Limited row by row and then between the rows, the lookup is continuous.
fn gpu_limited(w: vec4<f32>, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, d: vec3<f32>) -> vec3<f32> {
    return clamp(w.x * a + w.y * b + w.z * c + w.w * d, min(b, c), max(b, c));
}

// Four texels of a row from `at`.
fn gpu_sky_row(at: vec2<i32>, w: vec4<f32>) -> vec3<f32> {
    let a = textureLoad(gpu_sky, at, 0).rgb;
    let b = textureLoad(gpu_sky, at + vec2<i32>(1, 0), 0).rgb;
    let c = textureLoad(gpu_sky, at + vec2<i32>(2, 0), 0).rgb;
    let d = textureLoad(gpu_sky, at + vec2<i32>(3, 0), 0).rgb;
    return gpu_limited(w, a, b, c, d);
}

fn gpu_image(d: vec3<f32>) -> vec3<f32> {
    let size = vec2<f32>(vec2<i32>(textureDimensions(gpu_sky)) - 4);
    let u = 0.5 + atan2(d.z, d.x) / 6.28318530718;
    let v = atan2(length(d.xz), d.y) / 3.14159265359;
    let at = vec2<f32>(u, v) * size - 0.5;
    let first = floor(at);
    let x = gpu_catmull_rom(at.x - first.x);
    let y = gpu_catmull_rom(at.y - first.y);
    // One texel before `first`, two of border.
    let k = vec2<i32>(first) + 1;
    let a = gpu_sky_row(k, x);
    let b = gpu_sky_row(k + vec2<i32>(0, 1), x);
    let c = gpu_sky_row(k + vec2<i32>(0, 2), x);
    let e = gpu_sky_row(k + vec2<i32>(0, 3), x);
    return max(gpu_limited(y, a, b, c, e), vec3<f32>(0.0));
}

fn gpu_background(ray: GpuRay) -> vec3<f32> {
    var sum = gpu_backdrop.colour.rgb;
    let d = gpu_camera.turn * ray.direction;
    if gpu_backdrop.counts.y > 0u {
        sum += gpu_image(d);
    }
    for (var k = 0u; k < gpu_backdrop.counts.x; k++) {
        let disk = gpu_disk_row(2u * k);
        let angle = 2.0 * asin(min(0.5 * distance(disk.xyz, d), 1.0));
        // The share of a pixel inside the rim, taken as straight.
        let inside = 0.5 + (disk.w - angle) / max(gpu_camera.forward.w, 1e-6);
        sum += clamp(inside, 0.0, 1.0) * gpu_disk_row(2u * k + 1u).rgb;
    }
    return sum;
}
