struct LocalAround {
    corners: vec3<u32>,
    weights: vec3<f32>,
}

struct LocalTap {
    texel: u32,
    weight: f32,
}

// Weights of the corners of triangle `t` at a projection; one is negative outside.
fn local_barycentric(t: u32, p: vec2<f32>) -> vec3<f32> {
    let a = fetch_local_net(t, 6u) * p.x + fetch_local_net(t, 7u) * p.y + fetch_local_net(t, 8u);
    let b = fetch_local_net(t, 9u) * p.x + fetch_local_net(t, 10u) * p.y + fetch_local_net(t, 11u);
    return vec3<f32>(a, b, 1.0 - a - b);
}

// The directions around one of the net whose rows begin at `first`.
fn local_around(d: vec3<f32>, first: u32) -> LocalAround {
    let p = d.xy / (1.0 + d.z);
    let cell = min(vec2<u32>(max(16.0 * (p + vec2<f32>(1.0)), vec2<f32>(0.0))), vec2<u32>(31u));
    var t = first + u32(fetch_local_net(first + cell.y * 32u + cell.x, 12u));
    var w = local_barycentric(t, p);
    for (var step = 0u; step < 64u; step++) {
        var least = 0u;
        var smallest = w.x;
        if w.y < smallest {
            least = 1u;
            smallest = w.y;
        }
        if w.z < smallest {
            least = 2u;
            smallest = w.z;
        }
        let next = first + u32(fetch_local_net(t, 3u + least));
        if smallest >= 0.0 || next == t {
            break;
        }
        t = next;
        w = local_barycentric(t, p);
    }
    w = max(w, vec3<f32>(0.0));
    let corners = vec3<f32>(fetch_local_net(t, 0u), fetch_local_net(t, 1u), fetch_local_net(t, 2u));
    return LocalAround(vec3<u32>(corners), w / (w.x + w.y + w.z));
}

// Texels a row, rows, and the first texel of a level.
fn local_level(level: u32) -> vec3<u32> {
    var size = vec2<u32>(technique.local_patch.xy);
    var first = 0u;
    for (var k = 0u; k < level; k++) {
        first += size.x * size.y;
        size = max(size / 2u, vec2<u32>(1u));
    }
    return vec3<u32>(size, first);
}

fn local_bilinear(level: u32, uv: vec2<f32>, weight: f32) -> array<LocalTap, 4> {
    let l = local_level(level);
    let size = vec2<f32>(l.xy);
    let x = (uv - floor(uv)) * size - 0.5;
    let low = floor(x);
    let f = x - low;
    let a = vec2<u32>(low + size) % l.xy;
    let b = (a + vec2<u32>(1u)) % l.xy;
    return array<LocalTap, 4>(
        LocalTap(l.z + a.y * l.x + a.x, weight * (1.0 - f.x) * (1.0 - f.y)),
        LocalTap(l.z + a.y * l.x + b.x, weight * f.x * (1.0 - f.y)),
        LocalTap(l.z + b.y * l.x + a.x, weight * (1.0 - f.x) * f.y),
        LocalTap(l.z + b.y * l.x + b.x, weight * f.x * f.y),
    );
}

// The texels around a square: bilinear in the two nearest levels.
fn local_taps(uv: vec2<f32>, footprint: f32) -> array<LocalTap, 8> {
    let levels = technique.local_patch.z;
    let side = max(footprint * max(technique.local_patch.x, technique.local_patch.y), 1.0);
    let lod = clamp(log2(side), 0.0, levels - 1.0);
    let low = floor(lod);
    let t = lod - low;
    let a = local_bilinear(u32(low), uv, 1.0 - t);
    let b = local_bilinear(u32(min(low + 1.0, levels - 1.0)), uv, t);
    return array<LocalTap, 8>(a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]);
}

fn local_f_cos(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let lights = local_around(wi, u32(technique.local_patch.w));
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < 3u; k++) {
        let l = lights.corners[k];
        sum += lights.weights[k] * wi.z / fetch_local_cosines(l, 0u) * local_value(x, l);
    }
    return technique.local_shape.w * max(sum, vec3<f32>(0.0));
}
