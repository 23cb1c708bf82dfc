// Columns t, b and n of a point's frame; a point without a tangent has the one of surfaces without tangents.
fn views_frame(n: vec3<f32>, along: vec3<f32>) -> mat3x3<f32> {
    var t = along - n * dot(n, along);
    if !(dot(t, t) > 1e-12) {
        let a = select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), abs(n.y) < 0.99);
        t = cross(a, n);
    }
    t = normalize(t);
    return mat3x3<f32>(t, cross(n, t), n);
}

// cos and sin of gamma and of -beta; of alpha: R = R_z(alpha) R_y(beta) R_z(gamma).
fn views_angles(frame: mat3x3<f32>) -> mat2x4<f32> {
    let n = frame[2];
    let h = length(n.xy);
    var a = vec2<f32>(1.0, 0.0);
    if h > 1e-30 {
        a = n.xy / h;
    }
    let cosine = a.x * frame[1].y - a.y * frame[1].x;
    let sine = a.x * frame[0].y - a.y * frame[0].x;
    return mat2x4<f32>(vec4<f32>(cosine, sine, n.z, -h), vec4<f32>(a, 0.0, 0.0));
}

// Four texels around a local view and their weights, times the power of n·wo.
struct ViewsPlace {
    texel: u32,
    weights: vec4<f32>,
}

fn views_place(v: vec3<f32>, size: u32, reach: f32, inverse: f32, pole: f32) -> ViewsPlace {
    let p = clamp((v.xy / (1.0 + v.z) + reach) * inverse, vec2<f32>(0.0), vec2<f32>(f32(size - 1u)));
    let c = min(floor(p), vec2<f32>(f32(size - 2u)));
    let w = p - c;
    let m = vec2<f32>(1.0) - w;
    var weights = vec4<f32>(m.x * m.y, w.x * m.y, m.x * w.y, w.x * w.y);
    if pole != 0.0 {
        weights *= pow(max(v.z, 1e-3), pole);
    }
    return ViewsPlace(u32(c.y) * size + u32(c.x), weights);
}
