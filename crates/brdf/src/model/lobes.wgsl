// The twin of lobes.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    diffuse: vec4<f32>,
    // Views, lobes, polar angle of the last view.
    counts: vec4<f32>,
}

// I0(x) exp(-x), x >= 0 (Abramowitz & Stegun 9.8.1, 9.8.2; beyond 15 the asymptotic series).
fn brdf_bessel0(x: f32) -> f32 {
    if x > 15.0 {
        let t = 1.0 / x;
        let p = 225.0 / 3072.0 + t * (11025.0 / 98304.0 + t * 0.227108);
        return 0.39894228 * (1.0 + t * (0.125 + t * (9.0 / 128.0 + t * p))) * sqrt(t);
    }
    if x < 3.75 {
        let t = (x / 3.75) * (x / 3.75);
        let p = 1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813));
        return (1.0 + t * (3.5156229 + t * (3.0899424 + t * p))) * exp(-x);
    }
    let t = 3.75 / x;
    let p = -0.02057706 + t * (0.02635537 + t * (-0.01647633 + t * 0.00392377));
    let q = 0.00225319 + t * (-0.00157565 + t * (0.00916281 + t * p));
    return (0.39894228 + t * (0.01328592 + t * q)) / sqrt(x);
}

// A swept Gaussian (Swept::value in swept.rs) of these widths about m.
fn brdf_swept(d: vec3<f32>, m: vec3<f32>, sigma: f32, sweep: f32) -> f32 {
    let lambda = 1.0 / (sigma * sigma);
    let off = d - m;
    let below = 0.5 * dot(off, off);
    let peak = lambda / (-2.0 * BRDF_PI * brdf_exp_m1(-2.0 * lambda));
    if sweep <= 0.01 * sigma {
        let e = -lambda * below;
        return select(0.0, peak * exp(e), e > -40.0);
    }
    let kappa = 1.0 / (sweep * sweep);
    let whole = kappa + lambda;
    let short = lambda * (lambda * d.y * d.y + 2.0 * kappa * below);
    let r = sqrt(max(whole * whole - short, 0.0));
    let e = -short / (r + whole);
    return select(0.0, peak * exp(e) * brdf_bessel0(r) / brdf_bessel0(kappa), e > -40.0);
}

fn brdf_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if wo.z <= 0.0 {
        return vec3<f32>(0.0);
    }
    let sine = length(wo.xy);
    let u = select(vec2<f32>(1.0, 0.0), wo.xy / max(sine, 1e-37), sine > 0.0);
    // The light in the frame in which wo has no y.
    let d = vec3<f32>(dot(wi.xy, u), wi.y * u.x - wi.x * u.y, wi.z);
    let last = brdf.counts.x - 1.0;
    let x = clamp(brdf_atan2(sine, wo.z) / brdf.counts.z, 0.0, 1.0) * last;
    let i = min(floor(x), last - 1.0);
    let count = u32(brdf.counts.y);
    let at = 2u * count * u32(i);
    let t = x - i;
    var sum = brdf.diffuse.rgb * (BRDF_INV_PI * max(wi.z, 0.0));
    for (var k = 0u; k < count; k++) {
        // Angle of the mean from the mirror direction, logarithms of the widths across and along; weights.
        let here = at + 2u * k;
        let next = here + 2u * count;
        let lobe = mix(brdf_cell(here), brdf_cell(next), t);
        let weight = mix(brdf_cell(here + 1u), brdf_cell(next + 1u), t);
        let sigma = exp(lobe.y);
        let along = exp(lobe.z);
        let sweep = sqrt(max((along - sigma) * (along + sigma), 0.0));
        let c = cos(lobe.x);
        let s = sin(lobe.x);
        let m = vec3<f32>(-(sine * c + wo.z * s), 0.0, wo.z * c - sine * s);
        sum += weight * brdf_swept(d, m, sigma, sweep);
    }
    return sum;
}
