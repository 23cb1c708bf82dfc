// The three views around one, and its barycentric weights; the CPU's icosahedron.rs, where the derivation is.
const PHI: f32 = 1.618034;
const SHORT: f32 = 0.5257311;
const LONG: f32 = 0.8506508;

struct Around {
    index: vec3<u32>,
    weight: vec3<f32>,
}

fn mirrored(third: f32, long: f32, short: f32) -> vec3<f32> {
    let w = third / LONG;
    let sum = (long - SHORT * w) / LONG;
    let gap = short / SHORT;
    return vec3<f32>(0.5 * (sum + gap), 0.5 * (sum - gap), w);
}

fn around(w: vec3<f32>) -> Around {
    let s = select(vec3<u32>(0u), vec3<u32>(1u), w < vec3<f32>(0.0));
    let v = abs(w);
    let a = s.y + 2u * s.z;
    let b = 4u + s.x + 2u * s.y;
    let c = 8u + s.z + 2u * s.x;
    let inside = v.zyx * (PHI * PHI) + v.yxz - PHI * v.xzy;
    var index = vec3<u32>(a, b, c);
    var weight = inside;
    if inside.y < 0.0 {
        index = vec3<u32>(a, a ^ 1u, c);
        weight = mirrored(v.x, v.z, v.y);
    } else if inside.z < 0.0 {
        index = vec3<u32>(b, b ^ 1u, a);
        weight = mirrored(v.z, v.y, v.x);
    } else if inside.x < 0.0 {
        index = vec3<u32>(c, c ^ 1u, b);
        weight = mirrored(v.y, v.x, v.z);
    }
    return Around(index, max(weight, vec3<f32>(0.0)) / (weight.x + weight.y + weight.z));
}

fn view(k: u32) -> vec3<f32> {
    let short = select(SHORT, -SHORT, (k & 1u) == 1u);
    let long = select(LONG, -LONG, (k & 2u) == 2u);
    if k < 4u {
        return vec3<f32>(0.0, short, long);
    }
    if k < 8u {
        return vec3<f32>(short, long, 0.0);
    }
    return vec3<f32>(long, 0.0, short);
}

const SEEN: f32 = 0.1;

// Where the map of view k shows the normal n; w: the share of its weight that counts.
fn same_normal(k: u32, n: vec3<f32>) -> vec4<f32> {
    let v = view(k);
    let c = dot(n, v);
    return vec4<f32>(2.0 * c * n - v, clamp(c / SEEN, 0.0, 1.0));
}

fn by_normal(index: vec3<u32>, weight: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let a = same_normal(index.x, n);
    let b = same_normal(index.y, n);
    let c = same_normal(index.z, n);
    let w = weight * vec3<f32>(a.w, b.w, c.w);
    let all = w.x + w.y + w.z;
    let sum = w.x * fetch_views_layer(a.xyz, index.x) + w.y * fetch_views_layer(b.xyz, index.y)
        + w.z * fetch_views_layer(c.xyz, index.z);
    return select(vec3<f32>(0.0), sum / max(all, 1e-30), all > 0.0);
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let r = technique.turn * (2.0 * cos_o * n - wo);
    let near = around(technique.turn * wo);
    if technique.diffuse.w < 0.5 {
        let m = technique.turn * n;
        return by_normal(near.index, near.weight, m) + technique.diffuse.rgb * fetch_irradiance(m);
    }
    let a = fetch_views_layer(r, near.index.x);
    let b = fetch_views_layer(r, near.index.y);
    let c = fetch_views_layer(r, near.index.z);
    let e = fetch_irradiance(technique.turn * n);
    return near.weight.x * a + near.weight.y * b + near.weight.z * c + technique.diffuse.rgb * e;
}
