// Sum over p, q of the maps times y_pq(d); `map_at(at, k)` is texel `at` of map k.
fn sum(at: vec3<f32>, d: vec3<f32>) -> vec3<f32> {
    var out = vec3<f32>(0.0);
    var k = 0u;
    var a_q = vec2<f32>(1.0, 0.0);
    var start = 0.28209479177387814;
    for (var q = 0.0; q <= technique.orders.y; q += 1.0) {
        var now = start;
        var before = 0.0;
        var a_before = 0.0;
        for (var p = q; p <= technique.orders.x; p += 1.0) {
            if p > q {
                let a = sqrt((4.0 * p * p - 1.0) / (p * p - q * q));
                let b = select(a / a_before, 0.0, p == q + 1.0);
                let next = a * d.z * now - b * before;
                before = now;
                now = next;
                a_before = a;
            }
            out += now * a_q.x * map_at(at, k);
            k++;
            if q > 0.0 {
                out += now * a_q.y * map_at(at, k);
                k++;
            }
        }
        a_q = vec2<f32>(a_q.x * d.x - a_q.y * d.y, a_q.x * d.y + a_q.y * d.x);
        start *= sqrt((2.0 * q + 3.0) / (2.0 * q + 2.0)) * select(1.0, 1.4142135623730951, q == 0.0);
    }
    return out;
}

