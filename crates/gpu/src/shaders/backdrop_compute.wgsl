@compute @workgroup_size(8, 8)
fn gpu_sky_shade(@builtin(global_invocation_id) at: vec3<u32>) {
    let film = vec2<u32>(gpu_camera.film.xy);
    if at.x >= film.x || at.y >= film.y {
        return;
    }
    var some = false;
    for (var k = 0u; k < GPU_SAMPLES; k++) {
        some = some || textureLoad(gpu_ids, gpu_sample(at.xy, k), 0).x == 0u;
    }
    if !some {
        return;
    }
    let l = vec4<f32>(gpu_background(gpu_ray(vec2<f32>(at.xy) + 0.5)), 0.0);
    for (var k = 0u; k < GPU_SAMPLES; k++) {
        if textureLoad(gpu_ids, gpu_sample(at.xy, k), 0).x == 0u {
            textureStore(gpu_colour, gpu_sample(at.xy, k), l);
        }
    }
}
