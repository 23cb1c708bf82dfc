struct LocalTexel {
    a: array<vec3<f32>, 6>,
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    var x: LocalTexel;
    for (var k = 0u; k < 6u; k++) {
        x.a[k] = fetch_local_polynomials(uv, footprint, k).rgb;
    }
    return x;
}

fn local_f_cos(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let u = wi.x;
    let v = wi.y;
    let sum = u * u * x.a[0] + v * v * x.a[1] + u * v * x.a[2] + u * x.a[3] + v * x.a[4] + x.a[5];
    return 0.31830987 * max(sum, vec3<f32>(0.0));
}
