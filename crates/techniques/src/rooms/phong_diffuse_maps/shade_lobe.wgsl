fn integral(alpha: f32, own: f32, n: f32) -> f32 {
    let m = select(0.5 / max(alpha * alpha, 1e-8), n, alpha == own);
    return 6.2831855 / (m + 1.0);
}

fn shade_lobe(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, lobe: Lobe) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let fs = vec2<f32>(technique.k_s.w, technique.k_d_over_pi.w);
    let own = technique.widths.x;
    let first = technique.widths.y;
    let taps = lobe_taps(n, t, wo, lobe, own, min(own, first * first));
    let factor = technique.k_s.rgb * integral(lobe_alpha_of(lobe, own), own, technique.widths.w);
    let level = (sqrt(taps.alpha) - first) * technique.widths.z;
    var specular = vec3<f32>(0.0);
    for (var k = -taps.side; k <= taps.side; k++) {
        let tap = lobe_tap(taps, n, wo, k);
        specular += tap.weight * fresnel(fs, tap.cos_o) * factor * fetch_lobes(technique.turn * tap.r, level);
    }
    var diffuse = vec3<f32>(0.0);
    for (var k = 0; k < 4; k++) {
        diffuse += 0.25 * fetch_irradiance(technique.turn * lobe_normal(n, t, lobe, k));
    }
    return (1.0 - fresnel(fs, min(cos_o, 1.0))) * technique.k_d_over_pi.rgb * diffuse + specular;
}
