struct LocalTexel {
    t: vec3<f32>,
    b: vec3<f32>,
    n: vec3<f32>,
    wo: vec3<f32>,
    sigma: vec3<f32>,
    inverse: vec3<f32>,
    root: f32,
    peak: f32,
    lobe: vec2<f32>,
    specular: vec3<f32>,
    albedo: vec3<f32>,
}

fn local_form(m: vec3<f32>, s: vec2<f32>) -> f32 {
    return m.x * s.x * s.x + 2.0 * m.y * s.x * s.y + m.z * s.y * s.y;
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    let slope = fetch_local_varied(uv, footprint, 0u).xy;
    let moments = fetch_local_varied(uv, footprint, 1u).xyz;
    let own = fetch_local_varied(uv, footprint, 2u).xyz;
    let n = local_facing(vec3<f32>(slope, 1.0) / sqrt(dot(slope, slope) + 1.0), wo);
    let f = local_frame(n);
    let scatter = moments - vec3<f32>(slope.x * slope.x, slope.x * slope.y, slope.y * slope.y);
    let real = scatter.x + scatter.z > 1e-5 * (1e-3 + moments.x + moments.z);
    let sigma = select(own, own + scatter, real);
    if technique.local_model.w == 5.0 {
        let along = fetch_local_varied(uv, footprint, 5u).xy;
        let wide = select(along.y, along.y + 2.0 * (scatter.x + scatter.z), real);
        let peak = select(1.0, along.y * (1.0 + wide) / (wide * (1.0 + along.y)), real);
        let o = vec3<f32>(dot(f.t, wo), dot(f.b, wo), dot(n, wo));
        let lobe = vec2<f32>(along.x, 1.0 / max(wide, 1e-30));
        let specular = fetch_local_varied(uv, footprint, 3u).rgb;
        let albedo = fetch_local_varied(uv, footprint, 4u).rgb;
        return LocalTexel(f.t, f.b, n, o, own, vec3<f32>(0.0), 1.0, peak, lobe, specular, albedo);
    }
    let det = max(sigma.x * sigma.z - sigma.y * sigma.y, 1e-36);
    let root = sqrt(det);
    let narrow = sqrt(max(own.x * own.z - own.y * own.y, 1e-36));
    let inverse = vec3<f32>(sigma.z, -sigma.y, sigma.x) / det;
    let specular = fetch_local_varied(uv, footprint, 3u).rgb;
    let albedo = fetch_local_varied(uv, footprint, 4u).rgb;
    let o = vec3<f32>(dot(f.t, wo), dot(f.b, wo), dot(n, wo));
    return LocalTexel(f.t, f.b, n, o, sigma, inverse, root, narrow / root, vec2<f32>(0.0), specular, albedo);
}

fn local_long(m: vec3<f32>, w: vec3<f32>) -> f32 {
    return sqrt(2.0 * local_form(m, w.xy) + w.z * w.z);
}

fn local_lobe(x: LocalTexel, wi: vec3<f32>) -> f32 {
    let model = technique.local_model.w;
    let h = wi + x.wo;
    let square = max(dot(h, h), 1e-18);
    if model == 3.0 {
        let s = h / sqrt(square);
        let q = 0.5 * local_form(x.inverse, s.xy) + s.z * s.z;
        let masking = local_long(x.sigma, wi) * x.wo.z + local_long(x.sigma, x.wo) * wi.z;
        return 0.5 * wi.z / ((6.2831853 * x.root * q * q) * max(masking, 1e-18));
    }
    if model == 5.0 {
        let c = x.sigma;
        let axis = vec3<f32>(c.x * x.wo.x + c.y * x.wo.y, c.y * x.wo.x + c.z * x.wo.y, x.lobe.x * x.wo.z);
        let cosine = dot(axis, wi);
        return select(0.0, x.peak * pow(max(cosine, 1e-38), x.lobe.y) * wi.z, cosine > 0.0);
    }
    if model == 4.0 {
        let s = h / sqrt(square);
        let sine = dot(s.xy, s.xy);
        var exponent = x.inverse.x;
        if sine > 1e-12 {
            exponent = local_form(x.inverse, s.xy) / sine;
        }
        return select(0.0, x.peak * exp(0.5 * exponent * local_log_less(min(sine, 1.0))), s.z > 0.0);
    }
    let z = max(h.z, 1e-18);
    let e = exp(-0.5 * local_form(x.inverse, h.xy / z)) / (6.2831853 * x.root);
    if e == 0.0 {
        return 0.0;
    }
    let cosines = max(wi.z * x.wo.z, 1e-37);
    if model == 1.0 {
        return wi.z * 0.25 * e / cosines;
    }
    if model == 2.0 {
        return wi.z * 0.25 * e / sqrt(cosines);
    }
    let z2 = max(z * z, 1e-18);
    return wi.z * e * (square / z2) / z2;
}

fn local_f_cos(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let w = vec3<f32>(dot(x.t, wi), dot(x.b, wi), dot(x.n, wi));
    if !(wi.z > 0.0 && w.z > 0.0 && x.wo.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let away = clamp(1.0 - 0.5 * length(w + x.wo), 0.0, 1.0);
    let fresnel = away * away * away * away * away;
    let schlick = x.specular + (vec3<f32>(1.0) - x.specular) * fresnel;
    let factor = technique.local_model.rgb * select(x.specular, schlick, technique.local_model.w == 3.0);
    return min(factor * local_lobe(x, w) + x.albedo * 0.31830987 * w.z, vec3<f32>(3.4028234e38));
}
