// Place of lobe i at x = theta_o/89 degrees in the tables of views; counts = (lobes, views, all views - 1, 1/89 degrees).
fn view(i: f32, x: f32) -> f32 {
    return (i * technique.counts.y + clamp(x, 0.0, 1.0) * (technique.counts.y - 1.0)) / technique.counts.z;
}

// r turned by `angle` away from n in the plane of both: cos a r + sin a (cos theta r - n)/sin theta.
fn mean_direction(n: vec3<f32>, r: vec3<f32>, cosine: f32, sine: f32, angle: f32) -> vec3<f32> {
    let s = sin(angle) / max(sine, 1e-4);
    return (cos(angle) + s * cosine) * r - s * n;
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let d = dot(n, wo);
    if !(d > 0.0) {
        return vec3<f32>(0.0);
    }
    let r = 2.0 * d * n - wo;
    let cosine = min(d, 1.0);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let x = atan2(sine, cosine) * technique.counts.w;
    var sum = technique.diffuse.rgb * fetch_irradiance(technique.turn * n);
    for (var i = 0.0; i < technique.counts.x; i += 1.0) {
        let at = view(i, x);
        let lobe = fetch_means(at);
        let o = technique.turn * mean_direction(n, r, cosine, sine, lobe.x);
        sum += fetch_weights(at).rgb * fetch_chain(o, lobe.y);
    }
    return sum;
}
