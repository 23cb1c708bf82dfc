// <n.wi> of a lobe whose axis has n.r = cosine; factors.w: 0 the axis, 1 the mirror direction, 2 the mean.
fn foreshortening(cosine: f32, cos_o: f32, level: f32) -> f32 {
    if technique.factors.w == 0.0 {
        return max(cosine, 0.0);
    }
    if technique.factors.w == 1.0 {
        return cos_o;
    }
    return fetch_cosines(vec2<f32>(0.5 + 0.5 * cosine, level / technique.counts.y)).x;
}

// Radiance of a lobe: k times the filtered light about c, at a point with these axes; c need not be unit.
fn lobe_lit(axes: mat3x3<f32>, c: vec3<f32>, exponent: f32, level: f32, cos_o: f32, k: vec3<f32>) -> vec3<f32> {
    let length = sqrt(dot(c, c));
    if !(length > 0.0) {
        return vec3<f32>(0.0);
    }
    let axis = c / length;
    let factor = foreshortening(axis.z, cos_o, level) * pow(length, exponent);
    return factor * k * fetch_phong(technique.turn * (axes * axis), level);
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let axes = mat3x3<f32>(t, cross(n, t), n);
    let local = vec3<f32>(dot(wo, axes[0]), dot(wo, axes[1]), cos_o);
    var sum = technique.factors.rgb * fetch_irradiance(technique.turn * n);
    for (var i = 0u; i < u32(technique.counts.x); i++) {
        let c = vec3<f32>(fetch_terms(i, 0u), fetch_terms(i, 1u), fetch_terms(i, 2u)) * local;
        let k = vec3<f32>(fetch_terms(i, 5u), fetch_terms(i, 6u), fetch_terms(i, 7u));
        sum += lobe_lit(axes, c, fetch_terms(i, 3u), fetch_terms(i, 4u), cos_o, k);
    }
    return sum;
}
