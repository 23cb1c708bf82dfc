// Place of lobe i at x = theta_o/89 degrees in the tables of views; counts = (lobes, views, all views - 1,
// 1/89 degrees).
fn view(i: f32, x: f32) -> f32 {
    return (i * technique.counts.y + clamp(x, 0.0, 1.0) * (technique.counts.y - 1.0)) / technique.counts.z;
}

// r turned by `angle` away from n in the plane of both: cos a r + sin a (cos theta r - n)/sin theta.
fn mean_direction(n: vec3<f32>, r: vec3<f32>, cosine: f32, sine: f32, angle: f32) -> vec3<f32> {
    let s = sin(angle) / max(sine, 1e-4);
    return (cos(angle) + s * cosine) * r - s * n;
}

// The sine of theta_o, and theta_o over 89 degrees.
fn elevation(cos_o: f32) -> vec2<f32> {
    let cosine = min(cos_o, 1.0);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    return vec2<f32>(sine, atan2(sine, cosine) * technique.counts.w);
}

// The sum over lobes of each lookup times its visibility.
fn lobes(n: vec3<f32>, r: vec3<f32>, cosine: f32, b: Blocked) -> vec3<f32> {
    let view_at = elevation(cosine);
    var sum = vec3<f32>(0.0);
    for (var i = 0.0; i < technique.counts.x; i += 1.0) {
        let at = view(i, view_at.y);
        let lobe = fetch_means(at);
        let weight = fetch_weights(at).rgb;
        let zonal = zonal_at(at);
        let taps = number(lobe.w);
        let even = spread(taps);
        for (var k = 0.0; k < taps; k += 1.0) {
            let along = place(k, taps);
            let d = mean_direction(n, r, cosine, view_at.x, lobe.x + lobe.z * even.y * along);
            let share = tap(along) / even.x * visible(b, n, zonal, d);
            sum += share * weight * fetch_chain(technique.turn * d, lobe.y);
        }
    }
    return sum;
}

fn lobes_of(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, d: f32, b: Blocked) -> vec3<f32> {
    return lobes(n, 2.0 * d * n - wo, min(d, 1.0), b);
}
