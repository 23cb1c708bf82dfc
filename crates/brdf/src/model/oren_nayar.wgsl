// The twin of oren_nayar.rs. Tangents of angles come from the vectors themselves.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    albedo: vec4<f32>,
    // sigma; variant: 0 qualitative, 1 full, 2 Fujii
    rough: vec4<f32>,
}

fn brdf_qualitative(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let s2 = brdf.rough.x * brdf.rough.x;
    let a = 1.0 - 0.5 * s2 / (s2 + 0.33);
    let b = 0.45 * s2 / (s2 + 0.09);
    let c = max(dot(wi.xy, wo.xy), 0.0);
    return brdf.albedo.rgb * (BRDF_INV_PI * (a + b * c / max(wi.z, wo.z)));
}

fn brdf_fujii(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let sigma = brdf.rough.x;
    let a = 1.0 / (BRDF_PI + (0.5 * BRDF_PI - 2.0 / 3.0) * sigma);
    let c = dot(wi.xy, wo.xy);
    let t = select(max(wi.z, wo.z), 1.0, c <= 0.0);
    return brdf.albedo.rgb * (a * (1.0 + sigma * c / t));
}

fn brdf_full(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let s2 = brdf.rough.x * brdf.rough.x;
    let ti = brdf_polar_angle(wi);
    let to = brdf_polar_angle(wo);
    let alpha = max(ti, to);
    let beta = min(ti, to);
    let si = length(wi.xy);
    let so = length(wo.xy);
    let cos_phi = select(1.0, dot(wi.xy, wo.xy) / max(si * so, BRDF_TINY), si * so > 0.0);
    let c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
    let x = 2.0 * beta * BRDF_INV_PI;
    // `behind` is sin alpha - x^3, for azimuths behind, with x = 1 - e, where e is 2/pi times the elevation
    // of beta: in this form nothing cancels.
    let sine = max(si, so);
    let z = min(wi.z, wo.z);
    let e = brdf_atan2(max(wi.z, wo.z), min(si, so)) * (2.0 * BRDF_INV_PI);
    let behind = e * (3.0 - e * (3.0 - e)) - z * z / (1.0 + sine);
    let c2 = 0.45 * s2 / (s2 + 0.09) * select(behind, sine, cos_phi >= 0.0);
    let y = 4.0 * alpha * beta * (BRDF_INV_PI * BRDF_INV_PI);
    let c3 = 0.125 * s2 / (s2 + 0.09) * y * y;
    let tan_beta = min(si, so) / max(wi.z, wo.z);
    let tan_mean = (si + so) / (wi.z + wo.z);
    // 1 - |cos| = sin^2/(1 + |cos|), which does not cancel where the tangent grows.
    let sin_phi = (wi.x * wo.y - wi.y * wo.x) / max(si * so, BRDF_TINY);
    let turned = select(0.0, sin_phi * sin_phi / (1.0 + abs(cos_phi)), si * so > 0.0);
    let direct = c1 + cos_phi * c2 * tan_beta + turned * c3 * tan_mean;
    let between = 0.17 * s2 / (s2 + 0.13) * (1.0 - cos_phi * x * x);
    return brdf.albedo.rgb * BRDF_INV_PI * max(direct + brdf.albedo.rgb * between, vec3<f32>(0.0));
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    if brdf.rough.y == 1.0 {
        return brdf_full(wi, wo);
    }
    if brdf.rough.y == 2.0 {
        return brdf_fujii(wi, wo);
    }
    return brdf_qualitative(wi, wo);
}
