// What the camera sees beside the objects: a lat-long image, bicubic as on the CPU, and disks in front of it.
struct GpuBackdrop {
    colour: vec4<f32>,
    // Disks, 1 where there is an image.
    counts: vec4<u32>,
}
@group(0) @binding(0) var<uniform> gpu_backdrop: GpuBackdrop;
@group(0) @binding(1) var gpu_sky: texture_2d<f32>;
// Two vec4 a disk: unit direction and angular radius; radiance.
@group(0) @binding(2) var<storage, read> gpu_disks: array<vec4<f32>>;

// Integer remainders are slow, and i lies within one turn of the image unless that is tiny.
fn gpu_wrap(i: i32, w: i32) -> i32 {
    if w < 8 {
        return ((i % w) + w) % w;
    }
    return select(select(i, i - w, i >= w), i + w, i < 0);
}

// A row beyond a pole is the row reflected and turned by half a turn; for odd widths the mean of two columns.
fn gpu_sky_texel(i: i32, j: i32) -> vec3<f32> {
    let size = vec2<i32>(textureDimensions(gpu_sky));
    let w = size.x;
    if j >= 0 && j < size.y {
        return textureLoad(gpu_sky, vec2<i32>(gpu_wrap(i, w), j), 0).rgb;
    }
    let r = clamp(select(2 * size.y - 1 - j, -1 - j, j < 0), 0, size.y - 1);
    let a = textureLoad(gpu_sky, vec2<i32>(gpu_wrap(i + w / 2, w), r), 0).rgb;
    let b = textureLoad(gpu_sky, vec2<i32>(gpu_wrap(i + (w + 1) / 2, w), r), 0).rgb;
    return 0.5 * (a + b);
}

// Catmull & Rom 1974: weights of the texels at -1, 0, 1, 2.
fn gpu_catmull_rom(t: f32) -> vec4<f32> {
    let t2 = t * t;
    let t3 = t2 * t;
    return 0.5 * vec4<f32>(2.0 * t2 - t3 - t, 3.0 * t3 - 5.0 * t2 + 2.0, 4.0 * t2 - 3.0 * t3 + t, t3 - t2);
}

fn gpu_image(d: vec3<f32>) -> vec3<f32> {
    let size = vec2<f32>(textureDimensions(gpu_sky));
    let u = 0.5 + atan2(d.z, d.x) / 6.28318530718;
    let v = atan2(length(d.xz), d.y) / 3.14159265359;
    let at = vec2<f32>(u, v) * size - 0.5;
    let first = floor(at);
    let x = gpu_catmull_rom(at.x - first.x);
    let y = gpu_catmull_rom(at.y - first.y);
    let k = vec2<i32>(first);
    var sum = vec3<f32>(0.0);
    for (var j = 0; j < 4; j++) {
        var row = vec3<f32>(0.0);
        for (var i = 0; i < 4; i++) {
            row += x[i] * gpu_sky_texel(k.x + i - 1, k.y + j - 1);
        }
        sum += y[j] * row;
    }
    return max(sum, vec3<f32>(0.0));
}

fn gpu_background(ray: GpuRay) -> vec3<f32> {
    var sum = gpu_backdrop.colour.rgb;
    let d = gpu_camera.turn * ray.direction;
    if gpu_backdrop.counts.y > 0u {
        sum += gpu_image(d);
    }
    for (var k = 0u; k < gpu_backdrop.counts.x; k++) {
        let disk = gpu_disks[2u * k];
        let angle = 2.0 * asin(min(0.5 * distance(disk.xyz, d), 1.0));
        // The share of a pixel inside the rim, taken as straight.
        let inside = 0.5 + (disk.w - angle) / max(gpu_camera.forward.w, 1e-6);
        sum += clamp(inside, 0.0, 1.0) * gpu_disks[2u * k + 1u].rgb;
    }
    return sum;
}
