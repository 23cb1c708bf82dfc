
fn albedo_at(cos_o: f32, lobe: Lobe) -> vec2<f32> {
    if lobe.alpha < 0.0 {
        return fetch_albedo(sqrt(min(cos_o, 1.0))).xy;
    }
    return fetch_albedo_of(sqrt(vec2<f32>(min(cos_o, 1.0), min(lobe.alpha, 1.0)))).xy;
}

fn shade_lobe(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, lobe: Lobe) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let taps = lobe_taps(n, t, wo, lobe, room.widths.x, room.widths.y);
    let level = sqrt(taps.alpha) * room.widths.z;
    var l = vec3<f32>(0.0);
    for (var k = -taps.side; k <= taps.side; k++) {
        let tap = lobe_tap(taps, n, wo, k);
        let ab = albedo_at(tap.cos_o, lobe);
        l += tap.weight * (room.f0.rgb * ab.x + ab.y) * fetch_chain(room.turn * tap.r, level);
    }
    let ab = albedo_at(cos_o, lobe);
    let e = vec3<f32>(quadric(room.red, n), quadric(room.green, n), quadric(room.blue, n));
    return room.scale.rgb * (l + multiscatter(ab.x, ab.y) * e);
}
