fn shade_lobe(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, lobe: Lobe) -> vec3<f32> {
    if !(dot(n, wo) > 0.0) {
        return vec3<f32>(0.0);
    }
    var own = lobe;
    own.alpha = -1.0;
    let taps = lobe_taps(n, t, wo, own, 0.0, technique.f0.w);
    let level = log2(max(sqrt(2.0) * taps.alpha / technique.f0.w, 1.0));
    var l = vec3<f32>(0.0);
    for (var k = -taps.side; k <= taps.side; k++) {
        let tap = lobe_tap(taps, n, wo, k);
        l += tap.weight * technique.scale.rgb * fresnel(technique.f0.rgb, tap.cos_o) * fetch_environment(technique.turn * tap.r, level);
    }
    return l;
}
