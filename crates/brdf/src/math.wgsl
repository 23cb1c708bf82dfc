// The twin of math.rs in single precision. Local frame: t = x, b = y, n = z. `brdf` is the model's uniforms, whose
// first members are `scale` (w: 1 for the whole sphere) and `peak` (kind, narrow, wide).
const BRDF_PI: f32 = 3.14159265358979;
const BRDF_INV_PI: f32 = 0.318309886183791;
// Instead of the 1e-150 of double precision: products of two such numbers stay in range.
const BRDF_TINY: f32 = 1e-18;

fn brdf_value(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return brdf.scale.rgb * brdf_f_cos(wi, wo);
}

fn brdf_is_whole() -> bool {
    return brdf.scale.w > 0.0;
}

// Peak::scale.
fn brdf_scale(wi: vec3<f32>, wo: vec3<f32>, radius: f32) -> f32 {
    let kind = brdf.peak.x;
    let narrow = brdf.peak.y;
    if kind == 0.0 {
        return 0.6;
    }
    if kind == 1.0 {
        let off = wi - brdf_mirror(wo);
        let away = max(vec2<f32>(length(off.xy), abs(off.z)) - (radius + brdf.peak.z), vec2<f32>(0.0));
        let mean = 0.5 * (max(wi.z, 0.0) + wo.z);
        let width = narrow * clamp(min(wo.z, mean), 1e-4, 1.0);
        let tail = max(away.x, clamp(mean, 1e-4, 1.0) * away.y);
        return min(max(width, 0.5 * tail * narrow / brdf.peak.z), 0.6);
    }
    if kind == 4.0 {
        return min(narrow, 0.6);
    }
    let ridge = select(wo.x, -wo.x, kind == 2.0);
    let away = max(abs(brdf_asin(wi.x) - brdf_asin(ridge)) - radius, 0.0);
    return min(max(narrow, 0.5 * away), 0.6);
}

fn brdf_mirror(wo: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(-wo.xy, wo.z);
}

fn brdf_above(wi: vec3<f32>, wo: vec3<f32>) -> bool {
    return wi.z > 0.0 && wo.z > 0.0;
}

fn brdf_half(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let s = wi + wo;
    let l = length(s);
    return select(vec3<f32>(0.0, 0.0, 1.0), s / max(l, BRDF_TINY), l > BRDF_TINY);
}

fn brdf_half_cosine(wi: vec3<f32>, wo: vec3<f32>) -> f32 {
    return clamp(0.5 * length(wi + wo), BRDF_TINY, 1.0);
}

fn brdf_asin(x: f32) -> f32 {
    let c = clamp(x, -1.0, 1.0);
    return brdf_atan2(c, sqrt((1.0 - c) * (1.0 + c)));
}

fn brdf_polar_angle(h: vec3<f32>) -> f32 {
    return brdf_atan2(length(h.xy), h.z);
}

fn brdf_pow5(x: f32) -> f32 {
    let x2 = x * x;
    return x2 * x2 * x;
}

fn brdf_schlick(f0: vec3<f32>, u: f32) -> vec3<f32> {
    return f0 + (1.0 - f0) * brdf_pow5(clamp(1.0 - u, 0.0, 1.0));
}

// ln(1 + x), x > -1; near 0 by 2 atanh(x/(2 + x)).
fn brdf_ln_1p(x: f32) -> f32 {
    if abs(x) > 0.25 {
        return log(1.0 + x);
    }
    let z = x / (2.0 + x);
    let w = z * z;
    return 2.0 * z * (1.0 + w * (1.0 / 3.0 + w * (0.2 + w * (1.0 / 7.0 + w / 9.0))));
}

// exp(x) - 1.
fn brdf_exp_m1(x: f32) -> f32 {
    if abs(x) > 0.1 {
        return exp(x) - 1.0;
    }
    return x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x / 120.0))));
}

fn brdf_positive_pow(x: f32, n: f32) -> f32 {
    return select(0.0, pow(max(x, 1e-37), n), x > 0.0);
}

// c^n of a cosine c whose sine squared is s2.
fn brdf_cosine_pow(c: f32, s2: f32, n: f32) -> f32 {
    if c <= 0.0 {
        return 0.0;
    }
    if c < 0.9 {
        return pow(c, n);
    }
    return exp(0.5 * n * brdf_ln_1p(-min(s2, 1.0)));
}

// The sine from the chord, sin^2 = d^2 (1 - d^2/4): unlike the cross product it has no cancellation in singles.
fn brdf_power_cosine(a: vec3<f32>, b: vec3<f32>, n: f32) -> f32 {
    let d = a - b;
    let d2 = dot(d, d);
    return brdf_cosine_pow(dot(a, b), d2 * (1.0 - 0.25 * d2), n);
}

fn brdf_erf(x: f32) -> f32 {
    let a = abs(x);
    if a >= 4.0 {
        return sign(x);
    }
    var term = a;
    var sum = a;
    var odd = 1.0;
    for (var k = 0; k < 100 && term > 1e-9 * sum; k++) {
        odd += 2.0;
        term *= 2.0 * a * a / odd;
        sum += term;
    }
    return sign(x) * 1.12837916709551 * exp(-a * a) * sum;
}

fn brdf_dielectric(u: f32, ior: f32) -> f32 {
    let g2 = ior * ior - 1.0 + u * u;
    if g2 <= 0.0 {
        return 1.0;
    }
    let g = sqrt(g2);
    let a = (g - u) / (g + u);
    let b = (u * (g + u) - 1.0) / (u * (g - u) + 1.0);
    return 0.5 * a * a * (1.0 + b * b);
}
