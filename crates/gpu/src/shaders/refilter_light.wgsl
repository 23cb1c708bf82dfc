// From the light's own texels to cubes: means over cells by regular points, bilinear between texels so that every
// texel counts with its whole flux.

fn light_texel(face: i32, x: i32, y: i32, size: vec2<i32>) -> vec3<f32> {
    return light[(face * size.y + y) * size.x + x].xyz;
}

fn light_latlong(d: vec3<f32>, size: vec2<i32>) -> vec3<f32> {
    let u = 0.5 + atan2(d.z, d.x) / 6.28318530717958648;
    let v = atan2(length(d.xz), d.y) / 3.14159265358979324;
    let p = vec2<f32>(u, v) * vec2<f32>(size) - 0.5;
    let first = floor(p);
    let w = p - first;
    let c = vec2<i32>(first);
    let x0 = select(c.x, size.x - 1, c.x < 0);
    let x1 = select(c.x + 1, 0, c.x + 1 >= size.x);
    let y0 = clamp(c.y, 0, size.y - 1);
    let y1 = clamp(c.y + 1, 0, size.y - 1);
    let top = mix(light_texel(0, x0, y0, size), light_texel(0, x1, y0, size), w.x);
    return mix(top, mix(light_texel(0, x0, y1, size), light_texel(0, x1, y1, size), w.x), w.y);
}

// Six pictures taken from inside: a camera's right is a face's left.
fn light_faces(d: vec3<f32>, size: vec2<i32>) -> vec3<f32> {
    let face = face_of(d);
    let f = to_face(face, d);
    let last = vec2<f32>(size) - 1.0;
    let p = clamp(vec2<f32>(0.5 - 0.5 * f.x / f.z, 0.5 + 0.5 * f.y / f.z) * vec2<f32>(size) - 0.5, vec2<f32>(0.0), last);
    let first = min(floor(p), max(last - 1.0, vec2<f32>(0.0)));
    let w = p - first;
    let c = vec2<i32>(first);
    let e = min(c + 1, size - 1);
    let top = mix(light_texel(i32(face), c.x, c.y, size), light_texel(i32(face), e.x, c.y, size), w.x);
    let bottom = mix(light_texel(i32(face), c.x, e.y, size), light_texel(i32(face), e.x, e.y, size), w.x);
    return mix(top, bottom, w.y);
}

fn light_at(d: vec3<f32>) -> vec3<f32> {
    let size = vec2<i32>(extras[1].yz);
    if extras[1].x > 0.5 {
        return light_faces(d, size);
    }
    return light_latlong(d, size);
}

// Points per half cell of a cube of n intervals, so that they lie at most half a texel apart.
fn points_of(n: u32) -> i32 {
    return clamp(i32(ceil(1.5707963 / (f32(n) * extras[1].w))), 1, 8);
}

// The mean over the cell of a lattice sample of n intervals: the quarter cells that meet at it, of two faces on an
// edge and three at a corner. It depends on the point alone, so that faces agree on their edges.
fn cell_mean(at: vec3<u32>, n: u32, even: bool) -> vec3<f32> {
    let p = from_face(at.x, vec3<f32>(along(at.yz, n), 1.0));
    let m = points_of(n);
    let h = 1.0 / f32(n);
    var sum = vec4<f32>(0.0);
    for (var axis = 0u; axis < 3u; axis++) {
        if abs(p[axis]) != 1.0 {
            continue;
        }
        let b = (axis + 1u) % 3u;
        let c = (axis + 2u) % 3u;
        for (var j = -m; j < m; j++) {
            for (var i = -m; i < m; i++) {
                var q = p;
                q[b] += h * (f32(i) + 0.5) / f32(m);
                q[c] += h * (f32(j) + 0.5) / f32(m);
                if abs(q[b]) > 1.0 || abs(q[c]) > 1.0 {
                    continue;
                }
                var st = vec2<f32>(q[b], q[c]);
                var weight = 1.0;
                if even {
                    st = warp2(st);
                    weight = (1.0 + st.x * st.x) * (1.0 + st.y * st.y);
                }
                q[b] = st.x;
                q[c] = st.y;
                let inverse = inverseSqrt(dot(q, q));
                weight *= inverse * inverse * inverse;
                sum += vec4<f32>(weight * light_at(q * inverse), weight);
            }
        }
    }
    return sum.xyz / sum.w;
}

// The equiangular cube that the Gaussians start from.
@compute @workgroup_size(64)
fn refilter_source(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    maps[job.at.x + k] = vec4<f32>(cell_mean(lattice(k, job.span.z), job.span.z, true), 1.0);
}

// A level of the chain that is the light itself.
@compute @workgroup_size(64)
fn refilter_mirror(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let at = lattice(k, job.span.z);
    chain[chain_index(at)] = vec4<f32>(job.kernel.w * cell_mean(at, job.span.z, false), 1.0);
}

// Suns in the mirror: samples that the light lists for cubes of this size, each once.
@compute @workgroup_size(64)
fn refilter_suns(@builtin(global_invocation_id) id: vec3<u32>) {
    let points = u32(extras[0].x);
    let count = u32(extras[0].y);
    for (var k = id.x; k < count; k += 64u) {
        let e = extras[2u + 2u * points + 2u * k];
        let more = extras[3u + 2u * points + 2u * k].xyz;
        if u32(e.x) == job.span.z {
            let to = chain_index(vec3<u32>(u32(e.y), u32(e.z), u32(e.w)));
            chain[to] = vec4<f32>(chain[to].xyz + job.kernel.w * more, 1.0);
        }
    }
}
