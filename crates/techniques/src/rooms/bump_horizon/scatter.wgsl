
struct LocalLink {
    texel: u32,
    there: bool,
}

// The texel that another one meets along direction k.
fn local_link(texel: u32, k: u32) -> LocalLink {
    let count = u32(technique.local_scatter.y);
    let link = fetch_local_links(6u * count + texel * count + k, 0u);
    return LocalLink(u32(max(link, 0.0)), link >= 0.0);
}

fn local_scatter_number(k: u32, i: u32) -> f32 {
    return fetch_local_links(6u * k + i, 0u);
}

fn local_direction(k: u32) -> vec3<f32> {
    return vec3<f32>(local_scatter_number(k, 0u), local_scatter_number(k, 1u), local_scatter_number(k, 2u));
}

// The texel that a point sees along direction k, by a link of a texel in the square of its footprint.
fn local_meets(x: LocalTexel, k: u32) -> LocalLink {
    let size = technique.local_scatter.zw;
    let o = vec2<f32>(local_scatter_number(k, 4u), local_scatter_number(k, 5u));
    let at = fract(x.uv + o * max(vec2<f32>(x.footprint), 1.0 / size));
    let cell = min(vec2<u32>(at * size), vec2<u32>(size) - 1u);
    return local_link(cell.y * u32(size.x) + cell.x, k);
}

fn local_scattered(d: vec3<f32>, wo: vec3<f32>, weight: f32) -> vec3<f32> {
    return local_brdf_value(normalize(d), wo) * (weight / d.z);
}

// Light from bump to bump.
fn local_bounced(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let bounces = u32(technique.local_scatter.x);
    let count = u32(technique.local_scatter.y);
    let size = technique.local_scatter.zw;
    let frame = mat3x3<f32>(x.t, x.b, x.n);
    let to_viewer = normalize(transpose(frame) * wo);
    var sum = vec3<f32>(0.0);
    for (var first = 0u; first < count; first++) {
        var link = local_meets(x, first);
        if !link.there {
            continue;
        }
        var k = first;
        var through = local_scattered(local_direction(k), to_viewer, 3.14159265 / f32(count));
        var d = frame * local_direction(k);
        for (var bounce = 0u; bounce < bounces; bounce++) {
            let cell = vec2<f32>(vec2<u32>(link.texel % u32(size.x), link.texel / u32(size.x)));
            let uv = (cell + 0.5) / size;
            let n = local_facing_bump(local_unit(fetch_local_normals(uv, 0.0, 0u).xyz), -d);
            let f = local_frame(n);
            let here = mat3x3<f32>(f.t, f.b, n);
            let back = normalize(transpose(here) * -d);
            let v = local_seen(LocalTexel(f.t, f.b, n, uv, 0.0), wi);
            if v > 0.0 {
                sum += through * v * local_brdf_value(normalize(transpose(here) * wi), back);
            }
            if bounce + 1u == bounces {
                break;
            }
            k = u32(local_scatter_number(k, 3u));
            link = local_link(link.texel, k);
            if !link.there {
                break;
            }
            through *= local_scattered(local_direction(k), back, 3.14159265);
            d = here * local_direction(k);
        }
    }
    return sum;
}

fn local_f_cos(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    return local_direct(x, wi, wo) + local_bounced(x, wi, wo);
}
