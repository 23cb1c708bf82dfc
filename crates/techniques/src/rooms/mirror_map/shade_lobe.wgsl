fn shade_lobe(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, lobe: Lobe) -> vec3<f32> {
    if !(dot(n, wo) > 0.0) {
        return vec3<f32>(0.0);
    }
    let own = Lobe(-1.0, lobe.widen, lobe.least, lobe.spread);
    let taps = lobe_taps(n, t, wo, own, 0.0, room.f0.w);
    let level = log2(max(sqrt(2.0) * taps.alpha / room.f0.w, 1.0));
    var l = vec3<f32>(0.0);
    for (var k = -taps.side; k <= taps.side; k++) {
        let tap = lobe_tap(taps, n, wo, k);
        l += tap.weight * room.scale.rgb * fresnel(room.f0.rgb, tap.cos_o) * fetch_environment(room.turn * tap.r, level);
    }
    return l;
}
