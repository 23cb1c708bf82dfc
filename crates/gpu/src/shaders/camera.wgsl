// The camera; the same rays as `steradian_scene::Camera::ray`.
struct GpuCamera {
    view_projection: mat4x4<f32>,
    // w: 1 for parallel rays.
    origin: vec4<f32>,
    // w: width of the film plane's unit height: 2 tan(fov/2), or metres.
    right: vec4<f32>,
    // w: length on a surface that a pixel sees, per metre of distance, or (parallel rays) in metres.
    up: vec4<f32>,
    // w: angle of a pixel, radians.
    forward: vec4<f32>,
    // Film width and height in pixels, target texels per pixel and axis, and the side, in pixels, of the
    // square that a shaded point covers.
    film: vec4<f32>,
    // World → light.
    turn: mat3x3<f32>,
}
@group(2) @binding(0) var<uniform> gpu_camera: GpuCamera;

struct GpuRay {
    origin: vec3<f32>,
    direction: vec3<f32>,
}

// The ray through the film at `at` pixels from its top left corner.
fn gpu_ray(at: vec2<f32>) -> GpuRay {
    let h = gpu_camera.film.y;
    let s = gpu_camera.right.w * vec2<f32>((at.x - 0.5 * gpu_camera.film.x) / h, 0.5 - at.y / h);
    let across = s.x * gpu_camera.right.xyz + s.y * gpu_camera.up.xyz;
    if gpu_camera.origin.w > 0.0 {
        return GpuRay(gpu_camera.origin.xyz + across, gpu_camera.forward.xyz);
    }
    return GpuRay(gpu_camera.origin.xyz, normalize(gpu_camera.forward.xyz + across));
}
