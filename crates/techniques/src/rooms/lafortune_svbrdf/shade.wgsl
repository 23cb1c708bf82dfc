struct LocalLobe {
    rho: vec3<f32>,
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
    n: vec3<f32>,
}

struct LocalTexel {
    rho_d: vec3<f32>,
    lobes: array<LocalLobe, 4>,
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    var out: LocalTexel;
    out.rho_d = fetch_local_lobes(uv, footprint, 0u).rgb * 0.31830987;
    for (var k = 0u; k < u32(technique.local_lobe_count); k++) {
        let first = 1u + 6u * k;
        let rho = fetch_local_lobes(uv, footprint, first).rgb;
        let weight = 1.0 / max(rho, vec3<f32>(1e-30));
        let x = weight * fetch_local_lobes(uv, footprint, first + 1u).rgb;
        let y = weight * fetch_local_lobes(uv, footprint, first + 2u).rgb;
        let z = weight * fetch_local_lobes(uv, footprint, first + 3u).rgb;
        let s = max(weight * fetch_local_lobes(uv, footprint, first + 4u).rgb, vec3<f32>(1e-30));
        let q = weight * fetch_local_lobes(uv, footprint, first + 5u).rgb;
        let square = x * x + y * y + z * z;
        let scatter = vec3<f32>(1.0) - square / max(q, vec3<f32>(1e-30));
        let scattered = scatter > vec3<f32>(1e-5);
        let wide = select(s, s + 0.5 * scatter, scattered);
        let longer = select(vec3<f32>(1.0), sqrt(q / max(square, vec3<f32>(1e-30))), scattered);
        let scale = select(vec3<f32>(1.0), s * (1.0 + wide) / (wide * (1.0 + s)), scattered);
        out.lobes[k] = LocalLobe(rho * scale, x * longer, y * longer, z * longer, 1.0 / wide);
    }
    return out;
}

fn local_f_cos(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let v = wi * wo;
    var f = x.rho_d;
    for (var k = 0u; k < u32(technique.local_lobe_count); k++) {
        let lobe = x.lobes[k];
        let cosine = lobe.x * v.x + lobe.y * v.y + lobe.z * v.z;
        f += select(vec3<f32>(0.0), lobe.rho * pow(max(cosine, vec3<f32>(1e-37)), lobe.n), cosine > vec3<f32>(0.0));
    }
    return min(f * wi.z, vec3<f32>(3.4028234e38));
}
