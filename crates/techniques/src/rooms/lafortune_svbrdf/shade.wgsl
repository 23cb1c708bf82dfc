struct LocalTexel {
    all: LocalCosineLobes,
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    return LocalTexel(local_cosine_lobes(uv, footprint));
}

fn local_f_cos(texel: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    var x = texel;
    let v = wi * wo;
    var f = x.all.rho_d * 0.31830987;
    for (var k = 0u; k < local_cosine_count(); k++) {
        let lobe = x.all.lobes[k];
        let cosine = lobe.x * v.x + lobe.y * v.y + lobe.z * v.z;
        f += select(vec3<f32>(0.0), lobe.rho * pow(max(cosine, vec3<f32>(1e-37)), lobe.n), cosine > vec3<f32>(0.0));
    }
    return min(f * wi.z, vec3<f32>(3.4028234e38));
}
