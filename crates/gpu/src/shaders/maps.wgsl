
// Normal, tangent and lobe of a point of an object with maps; the CPU's `picture/look.rs`.
const GPU_MAPPED: bool = true;
// Smallest z of a mean normal that covariances are projected with.
const GPU_LEAST_Z: f32 = 0.1;

struct GpuLook {
    n: vec3<f32>,
    t: vec3<f32>,
    lobe: Lobe,
}

// J S J^T, J from the axes x and y to the components along t and b.
fn gpu_turned(s: vec3<f32>, x: vec3<f32>, y: vec3<f32>, t: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    let u = vec2<f32>(dot(x, t), dot(y, t));
    let v = vec2<f32>(dot(x, b), dot(y, b));
    return vec3<f32>(
        u.x * u.x * s.x + 2.0 * u.x * u.y * s.y + u.y * u.y * s.z,
        u.x * v.x * s.x + (u.x * v.y + u.y * v.x) * s.y + u.y * v.y * s.z,
        v.x * v.x * s.x + 2.0 * v.x * v.y * s.y + v.y * v.y * s.z,
    );
}

fn gpu_look(s: GpuPoint, outward: vec3<f32>, wo: vec3<f32>, footprint: f32) -> GpuLook {
    let side = footprint * s.plane.w;
    let t = gpu_tangent(outward, s.t.xyz);
    // A model that mirrors turns the bitangent over.
    let b = cross(outward, t) * select(1.0, -1.0, (s.t.w < 0.0) != (gpu_object.counts.w > 0u));
    var mean = vec3<f32>(0.0, 0.0, 1.0);
    var spread = vec3<f32>(0.0);
    let filtering = gpu_object.counts.z & 3u;
    let normals = gpu_object.images[GPU_MEAN_NORMALS];
    if normals.levels > 0u {
        let m = gpu_sample(gpu_mean_normals, s.uv, side, normals);
        if dot(m, m) > 0.0 {
            mean = normalize(m);
        }
        if filtering > 0u {
            spread = gpu_sample(gpu_normal_spread, s.uv, side, gpu_object.images[GPU_NORMAL_SPREAD]);
        }
    }
    let n = gpu_facing(s.side * normalize(mean.x * t + mean.y * b + mean.z * outward), wo);
    let tangent = gpu_tangent(n, s.t.xyz);
    var lobe = Lobe(-1.0, 0.0, 0.0, vec3<f32>(0.0), vec3<f32>(-1.0), vec3<f32>(-1.0));
    let widths = gpu_object.images[GPU_ALPHA2];
    if widths.levels > 0u {
        lobe.alpha = sqrt(max(gpu_sample(gpu_alpha2, s.uv, side, widths).x, 0.0));
    }
    let coloured = gpu_object.images[GPU_ALBEDO].levels > 0u;
    if coloured {
        lobe.albedo = max(gpu_sample(gpu_albedo, s.uv, side, gpu_object.images[GPU_ALBEDO]), vec3<f32>(0.0));
        lobe.f0 = max(gpu_sample(gpu_f0, s.uv, side, gpu_object.images[GPU_F0]), vec3<f32>(0.0));
    }
    // A surface with vertex colours alone is shaded as one without maps.
    if filtering > 0u && (coloured || normals.levels + widths.levels > 0u) {
        let z = max(mean.z, GPU_LEAST_Z);
        let x = t - outward * (mean.x / z);
        let y = b - outward * (mean.y / z);
        spread = gpu_turned(spread, x, y, tangent, cross(n, tangent));
        let angle = gpu_camera.film.w * gpu_camera.forward.w;
        lobe.least = min((2.0 * s.extra.w * footprint + angle) / sqrt(24.0), 1.0);
        if filtering == 1u {
            lobe.widen = spread.x + spread.z;
        } else {
            lobe.spread = spread;
        }
    }
    return GpuLook(n, tangent, lobe);
}

fn gpu_vertex_colour(v: u32) -> vec3<f32> {
    if gpu_object.counts.z < 4u {
        return vec3<f32>(1.0);
    }
    return vec3<f32>(gpu_colour_value(3u * v), gpu_colour_value(3u * v + 1u), gpu_colour_value(3u * v + 2u));
}

fn gpu_normal(v: u32) -> vec3<f32> {
    let n = gpu_object.normals * gpu_vertex_row(3u * v + 1u).xyz;
    return n / max(length(n), 1e-30);
}

// Frobenius norm of the normal's gradient over sqrt(2), by the Gram matrices of the edges and of the normals'
// differences.
fn gpu_bend(c: vec3<u32>) -> f32 {
    let a = gpu_position(c.x);
    let e = gpu_position(c.y) - a;
    let f = gpu_position(c.z) - a;
    let n = gpu_normal(c.x);
    let d = gpu_normal(c.y) - n;
    let h = gpu_normal(c.z) - n;
    let det = dot(e, e) * dot(f, f) - dot(e, f) * dot(e, f);
    let trace = dot(d, d) * dot(f, f) - 2.0 * dot(d, h) * dot(e, f) + dot(h, h) * dot(e, e);
    if !(det > 0.0) {
        return 0.0;
    }
    return sqrt(0.5 * max(trace, 0.0) / det);
}
