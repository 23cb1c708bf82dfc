
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
    let f0 = select(technique.f0.rgb, lobe.f0, lobe.f0.x >= 0.0);
    let base = select(technique.base.rgb, lobe.albedo, lobe.albedo.x >= 0.0);
    let taps = lobe_taps(n, t, wo, lobe, technique.widths.x, technique.widths.y);
    let level = sqrt(taps.alpha) * technique.widths.z;
    var l = vec3<f32>(0.0);
    for (var k = -taps.side; k <= taps.side; k++) {
        let tap = lobe_tap(taps, n, wo, k);
        let ab = albedo_at(tap.cos_o, lobe);
        l += tap.weight * (f0 * ab.x + ab.y) * fetch_chain(technique.turn * tap.r, level);
    }
    let ab = albedo_at(cos_o, lobe);
    let e = vec3<f32>(quadric(technique.red, n), quadric(technique.green, n), quadric(technique.blue, n));
    return technique.scale.rgb * (l + diffuse(f0, base, ab.x, ab.y) * e);
}
