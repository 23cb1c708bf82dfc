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

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let b = cross(n, t);
    let local = vec3<f32>(dot(wo, t), dot(wo, b), cos_o);
    var sum = technique.factors.rgb * fetch_irradiance(technique.turn * n);
    for (var i = 0u; i < u32(technique.counts.x); i++) {
        let c = vec3<f32>(fetch_terms(i, 0u), fetch_terms(i, 1u), fetch_terms(i, 2u)) * local;
        let k = vec3<f32>(fetch_terms(i, 5u), fetch_terms(i, 6u), fetch_terms(i, 7u));
        let length = sqrt(dot(c, c));
        if length > 0.0 {
            let level = fetch_terms(i, 4u);
            let axis = c / length;
            let r = axis.x * t + axis.y * b + axis.z * n;
            let factor = foreshortening(axis.z, cos_o, level) * pow(length, fetch_terms(i, 3u));
            sum += factor * k * fetch_phong(technique.turn * r, level);
        }
    }
    return sum;
}
