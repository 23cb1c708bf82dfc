// The triangle under a ray: weights of its second and third corner (Moller & Trumbore 1997).
fn gpu_hit(ray: GpuRay, c: vec3<u32>) -> vec2<f32> {
    let a = gpu_position(c.x);
    let e = gpu_position(c.y) - a;
    let f = gpu_position(c.z) - a;
    let s = ray.origin - a;
    let h = cross(ray.direction, f);
    let q = cross(s, e);
    let d = dot(e, h);
    // The hit is known; rounding must not lead out of the triangle.
    let u = clamp(dot(s, h) / d, 0.0, 1.0);
    return vec2<f32>(u, clamp(dot(ray.direction, q) / d, 0.0, 1.0 - u));
}

fn gpu_at(triangle: u32, ray: GpuRay) -> GpuPoint {
    let c = gpu_corners(triangle);
    let h = gpu_hit(ray, c);
    let w = vec3<f32>(1.0 - h.x - h.y, h);
    let p = mat3x3<f32>(gpu_position(c.x), gpu_position(c.y), gpu_position(c.z)) * w;
    let n = mat3x3<f32>(gpu_vertices[3u * c.x + 1u].xyz, gpu_vertices[3u * c.y + 1u].xyz, gpu_vertices[3u * c.z + 1u].xyz) * w;
    let t = mat3x3<f32>(gpu_vertices[3u * c.x + 2u].xyz, gpu_vertices[3u * c.y + 2u].xyz, gpu_vertices[3u * c.z + 2u].xyz) * w;
    let uv = mat3x2<f32>(gpu_uv(c.x), gpu_uv(c.y), gpu_uv(c.z)) * w;
    let plane = gpu_plane(c);
    let side = select(1.0, -1.0, dot(plane.xyz, ray.direction) > 0.0);
    return GpuPoint(p, gpu_object.normals * n, (gpu_object.model * vec4<f32>(t, 0.0)).xyz, uv, plane, side);
}

@compute @workgroup_size(8, 8)
fn gpu_shade(@builtin(global_invocation_id) at: vec3<u32>) {
    let film = vec2<u32>(gpu_camera.film.xy);
    if at.x >= film.x || at.y >= film.y {
        return;
    }
    var ids: array<u32, GPU_SAMPLES>;
    for (var k = 0u; k < GPU_SAMPLES; k++) {
        ids[k] = textureLoad(gpu_ids, gpu_sample(at.xy, k), 0).x;
    }
    let first = 1u + gpu_object.counts.x;
    for (var k = 0u; k < GPU_SAMPLES; k++) {
        let id = ids[k];
        // The id wraps round below `first`.
        if id == 0u || id - first >= gpu_object.counts.y {
            continue;
        }
        // The mean of a triangle's samples lies inside it.
        var centre = vec2<f32>(0.0);
        var count = 0.0;
        var seen = false;
        for (var j = 0u; j < GPU_SAMPLES; j++) {
            if j == k || (GPU_SHARE && ids[j] == id) {
                seen = seen || j < k;
                centre += vec2<f32>(gpu_sample(at.xy, j)) + 0.5;
                count += 1.0;
            }
        }
        if seen {
            continue;
        }
        let ray = gpu_ray(centre / (count * gpu_camera.film.z));
        let l = vec4<f32>(gpu_radiance(gpu_at(id - first, ray)), 1.0);
        for (var j = k; j < GPU_SAMPLES; j++) {
            if j == k || (GPU_SHARE && ids[j] == id) {
                textureStore(gpu_colour, gpu_sample(at.xy, j), l);
            }
        }
    }
}
