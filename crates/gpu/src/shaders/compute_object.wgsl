// The triangle under a ray: weights of its second and third corner (Moller & Trumbore 1997).
fn gpu_hit(ray: GpuRay, c: vec3<u32>) -> vec2<f32> {
    let a = gpu_position(c.x);
    let e = gpu_position(c.y) - a;
    let f = gpu_position(c.z) - a;
    let s = ray.origin - a;
    let h = cross(ray.direction, f);
    let q = cross(s, e);
    let d = dot(e, h);
    // The ray hits the triangle for certain; rounding must not lead out of it.
    let u = clamp(dot(s, h) / d, 0.0, 1.0);
    return vec2<f32>(u, clamp(dot(ray.direction, q) / d, 0.0, 1.0 - u));
}

fn gpu_at(triangle: u32, ray: GpuRay) -> GpuPoint {
    let c = gpu_corners(triangle);
    let h = gpu_hit(ray, c);
    let w = vec3<f32>(1.0 - h.x - h.y, h);
    let p = mat3x3<f32>(gpu_position(c.x), gpu_position(c.y), gpu_position(c.z)) * w;
    let n = mat3x3<f32>(gpu_vertex_row(3u * c.x + 1u).xyz, gpu_vertex_row(3u * c.y + 1u).xyz, gpu_vertex_row(3u * c.z + 1u).xyz) * w;
    let t = mat3x4<f32>(gpu_vertex_row(3u * c.x + 2u), gpu_vertex_row(3u * c.y + 2u), gpu_vertex_row(3u * c.z + 2u)) * w;
    let uv = mat3x2<f32>(gpu_uv(c.x), gpu_uv(c.y), gpu_uv(c.z)) * w;
    let plane = gpu_plane(c);
    let side = select(1.0, -1.0, dot(plane.xyz, ray.direction) > 0.0);
    let along = vec4<f32>((gpu_object.model * vec4<f32>(t.xyz, 0.0)).xyz, t.w);
    let colours = mat3x3<f32>(gpu_vertex_colour(c.x), gpu_vertex_colour(c.y), gpu_vertex_colour(c.z));
    let extra = vec4<f32>(colours * w, gpu_bend(c));
    return GpuPoint(p, gpu_object.normals * n, along, uv, plane, side, c, w, extra);
}

@compute @workgroup_size(64)
fn gpu_shade(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let job = gpu_job(group, thread);
    if job.samples == 0u {
        return;
    }
    let triangle = gpu_job_id(job) - 1u - gpu_object.counts.x;
    // The mean of a triangle's samples lies inside it.
    let ray = gpu_ray(gpu_job_centre(job) / gpu_camera.film.z);
    gpu_shadows(job.corner / 2u, textureDimensions(gpu_ids) / 2u, job.samples);
    gpu_job_keep(job, vec4<f32>(gpu_radiance(gpu_at(triangle, ray)), 1.0));
}
