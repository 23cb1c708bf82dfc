// Lists the samples of one object that must be shaded, so that threads that shade have neighbours that shade.
@group(0) @binding(0) var gpu_ids: texture_2d<u32>;
@group(0) @binding(1) var<storage, read_write> gpu_jobs: array<u32>;
@group(0) @binding(2) var<storage, read_write> gpu_head: GpuHead;

var<workgroup> gpu_here: atomic<u32>;
var<workgroup> gpu_base: u32;

// The samples of each job of a quad that sees `ids`.
fn gpu_samples(ids: vec4<u32>, mine: vec4<bool>) -> vec4<u32> {
    let bits = select(vec4<u32>(0u), vec4<u32>(1u, 2u, 4u, 8u), mine);
    if !GPU_SHARE {
        return bits;
    }
    let x = select(vec4<u32>(0u), bits, ids == ids.xxxx);
    let y = select(vec4<u32>(0u), bits, ids == ids.yyyy);
    let z = select(vec4<u32>(0u), bits, ids == ids.zzzz);
    let all = vec4<u32>(x.x | x.y | x.z | x.w, y.x | y.y | y.z | y.w, z.x | z.y | z.z | z.w, bits.w);
    // A triangle is its first sample's job.
    let again = vec4<bool>(false, ids.y == ids.x, any(ids.zz == ids.xy), any(ids.www == ids.xyz));
    return select(all, vec4<u32>(0u), again | !mine);
}

@compute @workgroup_size(8, 8)
fn gpu_list(@builtin(global_invocation_id) at: vec3<u32>, @builtin(local_invocation_index) me: u32) {
    let quads = textureDimensions(gpu_ids) / 2u;
    let corner = 2u * at.xy;
    let ids = vec4<u32>(
        textureLoad(gpu_ids, corner, 0).x,
        textureLoad(gpu_ids, corner + vec2<u32>(1u, 0u), 0).x,
        textureLoad(gpu_ids, corner + vec2<u32>(0u, 1u), 0).x,
        textureLoad(gpu_ids, corner + vec2<u32>(1u, 1u), 0).x,
    );
    // Ids below `first` wrap round.
    let mine = ids - gpu_head.first < vec4<u32>(gpu_head.number);
    let samples = gpu_samples(ids, mine & vec4<bool>(all(at.xy < quads)));
    let some = select(vec4<u32>(0u), vec4<u32>(1u), samples > vec4<u32>(0u));
    let count = some.x + some.y + some.z + some.w;
    let local = atomicAdd(&gpu_here, count);
    workgroupBarrier();
    if me == 0u {
        let here = atomicLoad(&gpu_here);
        gpu_base = atomicAdd(&gpu_head.jobs, here);
        atomicMax(&gpu_head.rows, (gpu_base + here + 1023u) / 1024u);
    }
    workgroupBarrier();
    let quad = 16u * (at.y * quads.x + at.x);
    var to = gpu_base + local;
    for (var k = 0u; k < 4u; k++) {
        if samples[k] > 0u {
            gpu_jobs[to] = quad + samples[k];
            to += 1u;
        }
    }
}
