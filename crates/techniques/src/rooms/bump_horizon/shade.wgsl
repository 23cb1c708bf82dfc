
struct LocalTexel {
    t: vec3<f32>,
    b: vec3<f32>,
    n: vec3<f32>,
    uv: vec2<f32>,
    footprint: f32,
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    let n = local_facing(local_unit(fetch_local_normals(uv, footprint, 0u).xyz), wo);
    let f = local_frame(n);
    return LocalTexel(f.t, f.b, n, uv, footprint);
}

fn local_elevation(x: LocalTexel, k: u32) -> f32 {
    return fetch_local_horizons(x.uv, x.footprint, k / 3u)[k % 3u];
}

// The part of a disk whose middle stands `above` a straight horizon.
fn local_disk(above: f32, width: f32) -> f32 {
    if abs(above) >= width {
        return select(0.0, 1.0, above > 0.0);
    }
    let x = above / width;
    let acute = local_arccos(abs(x));
    let acos = select(acute, 3.1415927 - acute, x < 0.0);
    return 1.0 - (acos - x * sqrt(1.0 - x * x)) * 0.31830987;
}

fn local_seen(x: LocalTexel, wi: vec3<f32>) -> f32 {
    let shadow = technique.local_shadow;
    if shadow.x == 0.0 {
        return 1.0;
    }
    if shadow.x == 2.0 {
        let q = fetch_local_horizons(x.uv, x.footprint, 0u);
        let r = fetch_local_horizons(x.uv, x.footprint, 1u);
        let value = q.x * wi.x * wi.x + q.y * wi.x * wi.y + q.z * wi.y * wi.y + r.x * wi.x + r.y * wi.y;
        return select(0.0, 1.0, value <= 1.0);
    }
    let count = u32(shadow.y);
    let place = fract(local_brdf_atan2(wi.y, wi.x) * 0.15915494 + 1.0) * shadow.y;
    let k = min(u32(place), count - 1u);
    let e = local_elevation(x, k);
    let f = local_elevation(x, select(0u, k + 1u, k + 1u < count));
    let horizon = e + (place - f32(k)) * (f - e);
    return local_disk(local_angle(min(wi.z, 1.0), min(length(wi.xy), 1.0)) - horizon, shadow.z);
}

fn local_direct(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let v = local_seen(x, wi);
    if v == 0.0 {
        return vec3<f32>(0.0);
    }
    let frame = transpose(mat3x3<f32>(x.t, x.b, x.n));
    return v * local_brdf_value(normalize(frame * wi), normalize(frame * wo));
}
