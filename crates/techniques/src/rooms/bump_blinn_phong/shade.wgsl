struct LocalTexel {
    mean: vec3<f32>,
    n: vec3<f32>,
    t: vec3<f32>,
    b: vec3<f32>,
    lobe: vec3<f32>,
    peak: f32,
}

fn local_turned(s: vec3<f32>, n: vec3<f32>, f: LocalFrame) -> vec3<f32> {
    let tilt = n.xy / max(n.z, 0.1);
    let u = f.t.xy - f.t.z * tilt;
    let v = f.b.xy - f.b.z * tilt;
    return vec3<f32>(
        u.x * u.x * s.x + 2.0 * u.x * u.y * s.y + u.y * u.y * s.z,
        u.x * v.x * s.x + (u.x * v.y + u.y * v.x) * s.y + u.y * v.y * s.z,
        v.x * v.x * s.x + 2.0 * v.x * v.y * s.y + v.y * v.y * s.z,
    );
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    var mean = fetch_local_normals(uv, footprint, 0u).xyz;
    let size = length(mean);
    let n = local_unit(mean);
    let f = local_frame(n);
    let e = technique.local_ks.w;
    var lobe = vec3<f32>(e, 0.0, e);
    var peak = 1.0;
    if technique.local_filter == 1.0 {
        let less = e * size / (size + e * max(1.0 - size, 0.0));
        lobe = vec3<f32>(less, 0.0, less);
        peak = (1.0 + less) / (1.0 + e);
    } else if technique.local_filter == 0.0 {
        let s = e * local_turned(fetch_local_normals(uv, footprint, 1u).xyz, n, f);
        let det = (1.0 + s.x) * (1.0 + s.z) - s.y * s.y;
        lobe = vec3<f32>(1.0 + s.z, -s.y, 1.0 + s.x) * (e / det);
        peak = 1.0 / sqrt(det);
    } else {
        mean = n;
    }
    return LocalTexel(mean, n, f.t, f.b, lobe, peak);
}

fn local_f_cos(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !(wi.z > 0.0 && dot(x.n, wi) > 0.0) {
        return vec3<f32>(0.0);
    }
    let s = select(1.0, min(8.0 * wi.z, 1.0), technique.local_kd.w > 0.0);
    let h = normalize(wi + wo);
    let u = dot(h, x.t);
    let v = dot(h, x.b);
    let square = u * u + v * v;
    var exponent = x.lobe.x;
    if square > 1e-12 {
        exponent = (x.lobe.x * u * u + 2.0 * x.lobe.y * u * v + x.lobe.z * v * v) / square;
    }
    let power = select(0.0, x.peak * exp(0.5 * exponent * local_log_less(min(square, 1.0))), dot(x.n, h) > 0.0);
    let diffuse = 0.31830987 * max(dot(x.mean, wi), 0.0);
    return s * (technique.local_kd.rgb * diffuse + technique.local_ks.rgb * power);
}
