// Coordinates of a view in the tables, and its frame: the part of wo perpendicular to n, normalised; n x
// that; and n.
struct Place {
    uv: vec2<f32>,
    x: vec3<f32>,
    y: vec3<f32>,
    n: vec3<f32>,
    polar: vec2<f32>,
}

// counts = (lobes, 1/89 degrees).
fn place_of(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>) -> Place {
    let b = cross(n, t);
    let cosine = min(dot(n, wo), 1.0);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let w = vec2<f32>(dot(wo, t), dot(wo, b));
    let size = length(w);
    let u = select(vec2<f32>(1.0, 0.0), w / max(size, 1e-30), size > 1e-6);
    let turn = atan2(u.y, u.x) * 0.15915494;
    let uv = vec2<f32>(turn - floor(turn), atan2(sine, cosine) * technique.counts.y);
    return Place(uv, u.x * t + u.y * b, u.x * b - u.y * t, n, vec2<f32>(sine, cosine));
}

// Cosine and sine of half the angle with this cosine and sine.
fn half_angle(d: vec2<f32>) -> vec2<f32> {
    if d.x >= 0.0 {
        let c = sqrt(0.5 * (1.0 + d.x));
        return vec2<f32>(c, 0.5 * d.y / c);
    }
    let s = sqrt(0.5 * (1.0 - d.x));
    return vec2<f32>(0.5 * d.y / s, s);
}

// The sum over lobes of each lookup times its visibility.
fn lobes(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, b: Blocked) -> vec3<f32> {
    let at = place_of(n, tangent(n, t), wo);
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < u32(technique.counts.x); i++) {
        let lobe = fetch_means_layer(at.uv, i);
        let weight = fetch_weights_layer(at.uv, i).rgb;
        let q = fetch_sweeps_layer(at.uv, i).xy;
        let zonal = zonal_at(at.uv, i);
        let s = at.polar.x * cos(lobe.x) + at.polar.y * sin(lobe.x);
        let c = at.polar.y * cos(lobe.x) - at.polar.x * sin(lobe.x);
        let plane = c * at.n - s * at.x;
        let side = cos(lobe.y) * at.y - sin(lobe.y) * plane;
        let square = length(q);
        let turn = half_angle(select(vec2<f32>(1.0, 0.0), q / max(square, 1e-30), square > 1e-12));
        let m = cos(lobe.y) * plane + sin(lobe.y) * at.y;
        let along = turn.y * side - turn.x * (c * at.x + s * at.n);
        let taps = number(lobe.w);
        let even = spread(taps);
        for (var k = 0.0; k < taps; k += 1.0) {
            let to = place(k, taps);
            let angle = sqrt(square) * even.y * to;
            let d = cos(angle) * m + sin(angle) * along;
            let share = tap(to) / even.x * visible(b, n, zonal, d);
            sum += share * weight * fetch_chain(technique.turn * d, lobe.z);
        }
    }
    return sum;
}

fn lobes_of(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, d: f32, b: Blocked) -> vec3<f32> {
    return lobes(n, t, wo, b);
}
