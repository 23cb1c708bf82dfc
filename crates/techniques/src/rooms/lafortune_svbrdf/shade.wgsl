struct LocalTexel {
    rho_d: vec3<f32>,
    lobes: array<LocalCosineLobe, 4>,
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    var out: LocalTexel;
    out.rho_d = fetch_local_lobes(uv, footprint, 0u).rgb * 0.31830987;
    for (var k = 0u; k < u32(technique.local_lobe_count); k++) {
        let first = 1u + 6u * k;
        out.lobes[k] = local_cosine_lobe(
            fetch_local_lobes(uv, footprint, first).rgb,
            fetch_local_lobes(uv, footprint, first + 1u).rgb,
            fetch_local_lobes(uv, footprint, first + 2u).rgb,
            fetch_local_lobes(uv, footprint, first + 3u).rgb,
            fetch_local_lobes(uv, footprint, first + 4u).rgb,
            fetch_local_lobes(uv, footprint, first + 5u).rgb,
        );
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
