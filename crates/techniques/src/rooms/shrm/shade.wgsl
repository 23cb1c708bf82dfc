// Sum over p, q of the maps times y_pq(d).
fn sum(uv: vec2<f32>, d: vec3<f32>) -> vec3<f32> {
    var out = vec3<f32>(0.0);
    var k = 0u;
    var a_q = vec2<f32>(1.0, 0.0);
    var start = 0.28209479177387814;
    for (var q = 0.0; q <= room.orders.y; q += 1.0) {
        var now = start;
        var before = 0.0;
        var a_before = 0.0;
        for (var p = q; p <= room.orders.x; p += 1.0) {
            if p > q {
                let a = sqrt((4.0 * p * p - 1.0) / (p * p - q * q));
                let b = select(a / a_before, 0.0, p == q + 1.0);
                let next = a * d.z * now - b * before;
                before = now;
                now = next;
                a_before = a;
            }
            out += now * a_q.x * fetch_maps(uv, k).rgb;
            k++;
            if q > 0.0 {
                out += now * a_q.y * fetch_maps(uv, k).rgb;
                k++;
            }
        }
        a_q = vec2<f32>(a_q.x * d.x - a_q.y * d.y, a_q.x * d.y + a_q.y * d.x);
        start *= sqrt((2.0 * q + 3.0) / (2.0 * q + 2.0)) * select(1.0, 1.4142135623730951, q == 0.0);
    }
    return out;
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let c = room.turn * central(n, t, 2.0 * cos_o * n - wo);
    // Harmonics of the view, or of the normal.
    let b = sum(globe_uv(c), globe_local(c, room.turn * select(wo, n, room.orders.w == 1.0)));
    let a = fetch_scale((angle(min(cos_o, 1.0)) - room.range.x) * room.range.y).rgb;
    return a * b + diffuse(room.turn * n) + exact_radiance(n, tangent(n, t), wo);
}
