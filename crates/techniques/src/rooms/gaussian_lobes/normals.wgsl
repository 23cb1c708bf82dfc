// 1 - the mean cosine under the Gaussian of level i. chain_sigmas holds the width of level 0, that of level
// 1, from which on widths double, the number of levels, and 0.
fn moment(i: f32) -> f32 {
    let s = select(technique.chain_sigmas.x, technique.chain_sigmas.y * exp2(i - 1.0), i > 0.5);
    let s2 = s * s;
    // 2/(exp(2/s2) - 1) is below 1e-17 where it is left out.
    return s2 - select(0.0, 2.0 / (exp(min(2.0 / s2, 60.0)) - 1.0), s2 > 0.05);
}

// The moment of a mixture of levels.
fn moment_at(level: f32) -> f32 {
    let l = clamp(level, 0.0, technique.chain_sigmas.z - 1.0);
    let i = min(floor(l), technique.chain_sigmas.z - 2.0);
    return mix(moment(i), moment(i + 1.0), l - i);
}

// The mixture of levels whose moment is m.
fn level_of(m: f32) -> f32 {
    var i = 0.0;
    while i + 2.0 < technique.chain_sigmas.z && moment(i + 1.0) < m {
        i += 1.0;
    }
    let low = moment(i);
    return i + clamp((m - low) / (moment(i + 1.0) - low), 0.0, 1.0);
}

fn shade_lobe(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, given: Lobe) -> vec3<f32> {
    let cosine = dot(n, wo);
    if !(cosine > 0.0) {
        return vec3<f32>(0.0);
    }
    var lobe = given;
    lobe.alpha = -1.0;
    var sum = vec3<f32>(0.0);
    for (var k = 0; k < 4; k++) {
        sum += 0.25 * technique.diffuse.rgb * fetch_irradiance(technique.turn * lobe_normal(n, t, lobe, k));
    }
    let finest = sqrt(0.5 * moment(0.0));
    let x = elevation(cosine).y;
    for (var i = 0.0; i < technique.counts.x; i += 1.0) {
        let own = moment_at(fetch_means(view(i, x)).y);
        let taps = lobe_taps(n, t, wo, lobe, sqrt(0.5 * own), finest);
        let wider = max(2.0 * taps.alpha * taps.alpha - own, 0.0);
        for (var k = -taps.side; k <= taps.side; k++) {
            let tapped = lobe_tap(taps, n, wo, k);
            let view_at = elevation(tapped.cos_o);
            let at = view(i, view_at.y);
            let means = fetch_means(at);
            let m = moment_at(means.y);
            let level = level_of(m + (1.0 - m) * wider);
            let count = number(means.w);
            let even = spread(count);
            var l = vec3<f32>(0.0);
            for (var j = 0.0; j < count; j += 1.0) {
                let along = place(j, count);
                let d = mean_direction(tapped.n, tapped.r, tapped.cos_o, view_at.x, means.x + means.z * even.y * along);
                l += tap(along) / even.x * fetch_chain(technique.turn * d, level);
            }
            sum += tapped.weight * fetch_weights(at).rgb * l;
        }
    }
    return sum;
}
