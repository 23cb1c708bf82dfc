// Gaussians of doubling width, each from the one before, and kernels as their sums.

fn even_weight(k: u32) -> vec2<f32> {
    return tables[job.tables.x + k].xy;
}

// One sample of the next Gaussian: all samples of the cube read within its reach, face by face, by their
// solid angles. a: concentration, reach as half the squared chord, sine of the reach (1 beyond a quarter
// turn), value at the reach, which is subtracted: with a step there, rounding would decide which samples
// count.
@compute @workgroup_size(64)
fn refilter_gauss(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let d = even_direction(lattice(k, job.span.z), job.span.z);
    let n = job.span.w;
    let stride = job.at.z;
    let row = n * stride + 1u;
    var sum = vec4<f32>(0.0);
    for (var face = 0u; face < 6u; face++) {
        let c = to_face(face, d);
        let across = window(c.x, c.z);
        let down = window(c.y, c.z);
        let first = vec2<i32>(ceil((0.5 + 0.5 * vec2<f32>(across.x, down.x) / QUARTER_PI) * f32(n) - 1e-3));
        let last = vec2<i32>(floor((0.5 + 0.5 * vec2<f32>(across.y, down.y) / QUARTER_PI) * f32(n) + 1e-3));
        if first.x > last.x || first.y > last.y {
            continue;
        }
        for (var j = first.y; j <= last.y; j++) {
            let t = even_weight(u32(j));
            let base = job.at.y + (face * row + u32(j) * stride) * row;
            for (var i = first.x; i <= last.x; i++) {
                let s = even_weight(u32(i));
                let inverse = inverseSqrt(1.0 + s.x * s.x + t.x * t.x);
                let e = vec3<f32>(s.x, t.x, 1.0) * inverse - c;
                let q = 0.5 * dot(e, e);
                if q <= job.a.y {
                    let w = (exp(-job.a.x * q) - job.a.w) * s.y * t.y * inverse * inverse * inverse;
                    sum += w * vec4<f32>(maps[base + u32(i) * stride].xyz, 1.0);
                }
            }
        }
    }
    maps[job.at.x + k] = vec4<f32>(sum.xyz / sum.w, 1.0);
}

// The angles about a face's other axis whose planes come within reach: sin(distance) = sqrt(u^2 + w^2) sin(A - A_d).
fn window(u: f32, w: f32) -> vec2<f32> {
    let h = sqrt(u * u + w * w);
    if h <= job.a.z {
        return vec2<f32>(-QUARTER_PI, QUARTER_PI);
    }
    let half_width = asin(job.a.z / h);
    let middle = atan2(u, w);
    return vec2<f32>(max(middle - half_width, -QUARTER_PI), min(middle + half_width, QUARTER_PI));
}

// Lagrange's weights of nodes 0 ... 3.
fn lagrange(t: f32) -> vec4<f32> {
    let a = t - 1.0;
    let b = t - 2.0;
    let c = t - 3.0;
    return vec4<f32>(a * b * c / -6.0, 0.5 * t * b * c, -0.5 * t * a * c, t * a * b / 6.0);
}

// Cubic lookup in an equiangular cube; stencils stay on their face, whose outer samples lie on the edges.
fn cubic(d: vec3<f32>, offset: u32, n: u32) -> vec3<f32> {
    let face = face_of(d);
    let f = to_face(face, d);
    let x = (0.5 + 0.5 * atan(f.xy / f.z) / QUARTER_PI) * f32(n);
    let i = clamp(floor(x) - 1.0, vec2<f32>(0.0), vec2<f32>(f32(n) - 3.0));
    let s = lagrange(x.x - i.x);
    let t = lagrange(x.y - i.y);
    let row = n + 1u;
    let first = offset + (face * row + u32(i.y)) * row + u32(i.x);
    var sum = vec3<f32>(0.0);
    for (var j = 0u; j < 4u; j++) {
        let at = first + j * row;
        sum += t[j] * (s.x * maps[at].xyz + s.y * maps[at + 1u].xyz + s.z * maps[at + 2u].xyz + s.w * maps[at + 3u].xyz);
    }
    return sum;
}

// A level of the chain: weighted Gaussians, and spherical harmonics for the error of these in the low bands.
@compute @workgroup_size(64)
fn refilter_mix(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let at = lattice(k, job.span.z);
    let d = chain_direction(at, job.span.z);
    var sum = harmonic_sum(d);
    for (var g = 0u; g < job.at.w; g++) {
        let level = tables[job.tables.x + g];
        if level.z != 0.0 {
            sum += level.z * cubic(d, u32(level.x), u32(level.y));
        }
    }
    put_chain(at, d, sum);
}
