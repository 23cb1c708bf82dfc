// Do the channels of a lobe have one axis and one exponent, up to single-precision rounding?
fn lobe_alike(lobe: CosineLobe) -> bool {
    let size = vec3<f32>(1e-5 * (abs(lobe.x.x) + abs(lobe.y.x) + abs(lobe.z.x)));
    return all(abs(lobe.n - lobe.n.xxx) <= 1e-5 * lobe.n.xxx)
        && all(abs(lobe.x - lobe.x.xxx) <= size)
        && all(abs(lobe.y - lobe.y.xxx) <= size)
        && all(abs(lobe.z - lobe.z.xxx) <= size);
}

// A channel's axis and exponent, with the factors of all three.
fn lobe_of(axes: mat3x3<f32>, c: vec3<f32>, exponent: f32, cos_o: f32, rho: vec3<f32>) -> vec3<f32> {
    let level = clamp((technique.ladder.x - log(exponent + 1.0)) * technique.ladder.y, 0.0, technique.ladder.z);
    return lobe_lit(axes, c, exponent, level, cos_o, rho * (6.2831853 / (exponent + 1.0)));
}

fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let axes = mat3x3<f32>(t, cross(n, t), n);
    let local = vec3<f32>(dot(wo, axes[0]), dot(wo, axes[1]), cos_o);
    var texel = cosine_lobes(site.uv, site.footprint);
    var sum = texel.rho_d * 0.31830987 * fetch_irradiance(technique.turn * n);
    for (var k = 0u; k < cosine_count(); k++) {
        let lobe = texel.lobes[k];
        if lobe_alike(lobe) {
            let c = vec3<f32>(lobe.x.x, lobe.y.x, lobe.z.x) * local;
            sum += lobe_of(axes, c, lobe.n.x, cos_o, lobe.rho);
            continue;
        }
        for (var i = 0u; i < 3u; i++) {
            if lobe.rho[i] > 0.0 {
                let c = vec3<f32>(lobe.x[i], lobe.y[i], lobe.z[i]) * local;
                var channel = vec3<f32>(0.0);
                channel[i] = lobe.rho[i];
                sum += lobe_of(axes, c, lobe.n[i], cos_o, channel);
            }
        }
    }
    return sum;
}
