// LOCAL_TERMS, 9 or 16, stands before this text.
struct LocalTexel {
    a: array<vec3<f32>, LOCAL_TERMS>,
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    var x: LocalTexel;
    for (var k = 0u; k < LOCAL_TERMS; k++) {
        x.a[k] = fetch_local_polynomials(uv, footprint, k).rgb;
    }
    return x;
}

fn local_harmonics(d: vec3<f32>) -> array<f32, 16> {
    let s = d * d;
    return array<f32, 16>(
        0.2820948,
        0.48860252 * d.y,
        0.48860252 * d.z,
        0.48860252 * d.x,
        1.0925485 * d.x * d.y,
        1.0925485 * d.y * d.z,
        0.31539157 * (3.0 * s.z - 1.0),
        1.0925485 * d.x * d.z,
        0.54627424 * (s.x - s.y),
        0.5900436 * d.y * (3.0 * s.x - s.y),
        2.8906114 * d.x * d.y * d.z,
        0.4570458 * d.y * (5.0 * s.z - 1.0),
        0.37317634 * d.z * (5.0 * s.z - 3.0),
        0.4570458 * d.x * (5.0 * s.z - 1.0),
        1.4453057 * d.z * (s.x - s.y),
        0.5900436 * d.x * (s.x - 3.0 * s.y),
    );
}

fn local_f_cos(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    var own = x;
    var y = local_harmonics(wi);
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < LOCAL_TERMS; k++) {
        sum += y[k] * own.a[k];
    }
    return 0.31830987 * max(sum, vec3<f32>(0.0));
}
