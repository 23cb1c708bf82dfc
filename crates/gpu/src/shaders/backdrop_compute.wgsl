@compute @workgroup_size(64)
fn gpu_sky_shade(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let job = gpu_job(group, thread);
    if job.samples == 0u {
        return;
    }
    let ray = gpu_ray(gpu_job_centre(job) / gpu_camera.film.z);
    gpu_job_keep(job, vec4<f32>(gpu_background(ray), 0.0));
}
