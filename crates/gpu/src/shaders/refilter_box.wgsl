// Box-filtered mips on an ordinary cube with texels inside its faces, as graphics hardware makes them, and
// the dual-paraboloid filter that reads them.

// Texel k of six faces of n x n: face, i, j.
fn texel(k: u32, n: u32) -> vec3<u32> {
    let face = k / (n * n);
    let r = k - face * n * n;
    return vec3<u32>(face, r % n, r / n);
}

fn box_position(at: vec2<u32>, n: u32) -> vec2<f32> {
    return (2.0 * vec2<f32>(at) + 1.0) / f32(n) - 1.0;
}

// Texels of the finest box: their cells' means.
@compute @workgroup_size(64)
fn refilter_box(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let n = job.span.z;
    let at = texel(k, n);
    let m = 2 * points_of(n);
    var sum = vec4<f32>(0.0);
    for (var j = 0; j < m; j++) {
        for (var i = 0; i < m; i++) {
            let p = (vec2<f32>(at.yz) + (vec2<f32>(vec2<i32>(i, j)) + 0.5) / f32(m)) * (2.0 / f32(n)) - 1.0;
            let inverse = inverseSqrt(1.0 + dot(p, p));
            let w = inverse * inverse * inverse;
            sum += vec4<f32>(w * light_at(from_face(at.x, vec3<f32>(p, 1.0)) * inverse), w);
        }
    }
    maps[job.at.x + k] = vec4<f32>(sum.xyz / sum.w, 1.0);
}

// The next box: four texels by their solid angles.
@compute @workgroup_size(64)
fn refilter_halve(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let n = 2u * job.span.z;
    let at = texel(k, job.span.z);
    var sum = vec4<f32>(0.0);
    for (var q = 0u; q < 4u; q++) {
        let c = 2u * at.yz + vec2<u32>(q & 1u, q >> 1u);
        let p = box_position(c, n);
        let inverse = inverseSqrt(1.0 + dot(p, p));
        let w = inverse * inverse * inverse;
        sum += vec4<f32>(w * maps[job.at.y + (at.x * n + c.y) * n + c.x].xyz, w);
    }
    maps[job.at.x + k] = vec4<f32>(sum.xyz / sum.w, 1.0);
}

// Bilinear within a face.
fn box_level(d: vec3<f32>, offset: u32, n: u32) -> vec3<f32> {
    let face = face_of(d);
    let f = to_face(face, d);
    let last = f32(n) - 1.0;
    let p = clamp((0.5 + 0.5 * f.xy / f.z) * f32(n) - 0.5, vec2<f32>(0.0), vec2<f32>(last));
    let first = min(floor(p), vec2<f32>(max(last - 1.0, 0.0)));
    let w = p - first;
    let c = vec2<u32>(first);
    let e = min(c + 1u, vec2<u32>(n - 1u));
    let a = offset + face * n * n;
    let top = mix(maps[a + c.y * n + c.x].xyz, maps[a + c.y * n + e.x].xyz, w.x);
    return mix(top, mix(maps[a + e.y * n + c.x].xyz, maps[a + e.y * n + e.x].xyz, w.x), w.y);
}

// Lookup between two levels, whose offsets and sizes are in `tables` at x.
fn box_between(d: vec3<f32>, level: f32) -> vec3<f32> {
    let last = job.tables.w - 1u;
    let l = clamp(level, 0.0, f32(last));
    let i = min(u32(l), last);
    let a = tables[job.tables.x + i];
    let b = tables[job.tables.x + min(i + 1u, last)];
    return mix(box_level(d, u32(a.x), u32(a.y)), box_level(d, u32(b.x), u32(b.y)), l - f32(i));
}

// A level of the chain from level a.x of the box mips.
@compute @workgroup_size(64)
fn refilter_boxed(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let at = lattice(k, job.span.z);
    let d = chain_direction(at, job.span.z);
    put_chain(at, d, box_between(d, job.a.x));
}

// Position on a paraboloid map of P x P texels that spans -a.y ... a.y; texel k lies on hemisphere k / P^2.
fn parabolic(k: u32) -> vec3<f32> {
    let n = job.span.z;
    let at = texel(k, n);
    return vec3<f32>(job.a.y * box_position(at.yz, n), select(1.0, -1.0, at.x > 0u));
}

// (s, t) -> (2s, 2t, 1 - rho^2)/(1 + rho^2) (Heidrich & Seidel 1998).
fn parabolic_direction(p: vec3<f32>) -> vec3<f32> {
    let rho2 = dot(p.xy, p.xy);
    return vec3<f32>(2.0 * p.xy, p.z * (1.0 - rho2)) / (1.0 + rho2);
}

// The light on a paraboloid map, from the box mip whose texels are as large as the map's there.
@compute @workgroup_size(64)
fn refilter_parabola(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let p = parabolic(k);
    let scale = 2.0 / (1.0 + dot(p.xy, p.xy));
    let angle = scale * 2.0 * job.a.y / f32(job.span.z);
    // A cube's texels span sqrt(4 pi / 6)/n in the mean.
    let level = log2(max(angle * tables[job.tables.x].y / 1.4472025, 1.0));
    maps[job.at.x + k] = vec4<f32>(box_between(parabolic_direction(p), level), 1.0);
}

// Two kernels in the plane, one that fits the centre (where an angle is twice a length) and one that fits the
// rim (where they are equal), blended by the square of the distance (STAR04 7.4.2; Kautz, Vazquez, Heidrich &
// Seidel 2000). at.z: reach in texels.
@compute @workgroup_size(64)
fn refilter_lobes(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let n = job.span.z;
    let at = texel(k, n);
    let p = parabolic(k);
    let rho2 = min(dot(p.xy, p.xy), 1.0);
    let reach = i32(job.at.z);
    let size = i32(n);
    let spacing = 2.0 * job.a.y / f32(n);
    let low = max(vec2<i32>(at.yz) - reach, vec2<i32>(0)) - vec2<i32>(at.yz);
    let high = min(vec2<i32>(at.yz) + reach, vec2<i32>(size - 1)) - vec2<i32>(at.yz);
    var small = vec4<f32>(0.0);
    var large = vec4<f32>(0.0);
    for (var j = low.y; j <= high.y; j++) {
        for (var i = low.x; i <= high.x; i++) {
            let r2 = f32(i * i + j * j);
            if r2 > f32(reach * reach) {
                continue;
            }
            let r = spacing * sqrt(r2);
            let c = vec2<u32>(vec2<i32>(at.yz) + vec2<i32>(i, j));
            let l = vec4<f32>(maps[job.at.y + (at.x * n + c.y) * n + c.x].xyz, 1.0);
            small += kernel_at(1.0 - cos(min(2.0 * r, 3.1415926))) * l;
            large += kernel_at(1.0 - cos(min(r, 3.1415926))) * l;
        }
    }
    maps[job.at.x + k] = vec4<f32>(mix(small.xyz / small.w, large.xyz / large.w, rho2), 1.0);
}

// A level of the chain from a filtered pair of maps at `at.y` of `span.w` texels.
@compute @workgroup_size(64)
fn refilter_unfold(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let at = lattice(k, job.span.z);
    let d = chain_direction(at, job.span.z);
    let n = job.span.w;
    let st = d.xy / (1.0 + abs(d.z));
    let p = clamp((0.5 + 0.5 * st / job.a.y) * f32(n) - 0.5, vec2<f32>(0.0), vec2<f32>(f32(n) - 1.0));
    let first = min(floor(p), vec2<f32>(f32(n) - 2.0));
    let w = p - first;
    let a = job.at.y + (select(0u, n, d.z < 0.0) + u32(first.y)) * n + u32(first.x);
    let top = mix(maps[a].xyz, maps[a + 1u].xyz, w.x);
    put_chain(at, d, mix(top, mix(maps[a + n].xyz, maps[a + n + 1u].xyz, w.x), w.y));
}
