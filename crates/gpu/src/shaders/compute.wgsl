// Shading of the visibility buffer, one thread a job.
@group(3) @binding(0) var gpu_ids: texture_2d<u32>;
@group(3) @binding(1) var<storage, read> gpu_jobs: array<u32>;
@group(3) @binding(2) var<storage, read> gpu_head: GpuHead;
@group(3) @binding(3) var gpu_colour: GpuTarget;

struct GpuJob {
    // Texel of the quad's first sample.
    corner: vec2<u32>,
    // A bit for each sample; 0 beyond the end of the list.
    samples: u32,
}

fn gpu_job(group: vec3<u32>, thread: u32) -> GpuJob {
    let k = 64u * (16u * group.y + group.x) + thread;
    if k >= gpu_head.jobs {
        return GpuJob(vec2<u32>(0u), 0u);
    }
    let job = gpu_jobs[k];
    let width = textureDimensions(gpu_ids).x / 2u;
    let quad = job / 16u;
    return GpuJob(2u * vec2<u32>(quad % width, quad / width), job % 16u);
}

// The job's triangle.
fn gpu_job_id(job: GpuJob) -> u32 {
    let k = firstTrailingBit(job.samples);
    return textureLoad(gpu_ids, job.corner + vec2<u32>(k % 2u, k / 2u), 0).x;
}

// The mean place of the job's samples, in texels.
fn gpu_job_centre(job: GpuJob) -> vec2<f32> {
    let right = countOneBits(job.samples & 10u);
    let below = countOneBits(job.samples & 12u);
    let count = f32(max(countOneBits(job.samples), 1u));
    return vec2<f32>(job.corner) + 0.5 + vec2<f32>(vec2<u32>(right, below)) / count;
}

fn gpu_job_keep(job: GpuJob, l: vec4<f32>) {
    for (var k = 0u; k < 4u; k++) {
        if (job.samples >> k) % 2u == 1u {
            textureStore(gpu_colour, job.corner + vec2<u32>(k % 2u, k / 2u), l);
        }
    }
}
