// The twin of lobes.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    diffuse: vec4<f32>,
    // Elevations, lobes, polar angle of the last view, azimuths.
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

// A swept Gaussian (Swept::value in swept.rs) of these widths about m; y is the component of d across the sweep.
fn brdf_swept(d: vec3<f32>, m: vec3<f32>, y: f32, sigma: f32, sweep: f32) -> f32 {
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
    let short = lambda * (lambda * y * y + 2.0 * kappa * below);
    let r = sqrt(max(whole * whole - short, 0.0));
    let e = -short / (r + whole);
    return select(0.0, peak * exp(e) * brdf_bessel0(r) / brdf_bessel0(kappa), e > -40.0);
}

// Cells of the two azimuths, and of the elevation after, mixed.
fn brdf_lobe_cell(at: vec2<u32>, t: vec2<f32>) -> vec3<f32> {
    let next = 3u * u32(brdf.counts.y) * u32(brdf.counts.w);
    let a = mix(brdf_cell(at.x), brdf_cell(at.x + next), t.x);
    return mix(a, mix(brdf_cell(at.y), brdf_cell(at.y + next), t.x), t.y);
}

// Cosine and sine of half the angle with this cosine and sine.
fn brdf_half_angle(d: vec2<f32>) -> vec2<f32> {
    if d.x >= 0.0 {
        let c = sqrt(0.5 * (1.0 + d.x));
        return vec2<f32>(c, 0.5 * d.y / c);
    }
    let s = sqrt(0.5 * (1.0 - d.x));
    return vec2<f32>(0.5 * d.y / s, s);
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
    let azimuths = u32(brdf.counts.w);
    // 0 ... M, shifted by half a step.
    var phi = brdf_atan2(u.y, u.x) * 0.5 * BRDF_INV_PI - 0.5 / brdf.counts.w;
    phi = select((phi - floor(phi)) * brdf.counts.w, 0.0, azimuths == 1u);
    let j = u32(phi);
    let here = azimuths * u32(i);
    let at = vec2<u32>(here + j % azimuths, here + (j + 1u) % azimuths) * 3u * count;
    let t = vec2<f32>(x - i, phi - floor(phi));
    var sum = brdf.diffuse.rgb * (BRDF_INV_PI * max(wi.z, 0.0));
    for (var k = 0u; k < count; k++) {
        // Angles of the mean from the mirror direction; logarithm of the widths as a matrix; weights.
        let place = brdf_lobe_cell(at + 3u * k, t).xy;
        let spread = brdf_lobe_cell(at + 3u * k + 1u, t);
        let weight = brdf_lobe_cell(at + 3u * k + 2u, t);
        let off = vec2<f32>(0.5 * (spread.x - spread.z), spread.y);
        let radius = length(off);
        let sigma = exp(0.5 * (spread.x + spread.z) - radius);
        let along = exp(0.5 * (spread.x + spread.z) + radius);
        let sweep = sqrt(max((along - sigma) * (along + sigma), 0.0));
        let turn = brdf_half_angle(select(vec2<f32>(1.0, 0.0), off / max(radius, 1e-30), radius > 1e-30));
        let c = cos(place.x);
        let s = sin(place.x);
        // The mean's direction in the plane of n and wo, that in which its angle grows, and the one out of the plane.
        let plane = vec3<f32>(-(sine * c + wo.z * s), 0.0, wo.z * c - sine * s);
        let up = vec3<f32>(-plane.z, 0.0, plane.x);
        let m = plane * cos(place.y) + vec3<f32>(0.0, sin(place.y), 0.0);
        let side = vec3<f32>(0.0, cos(place.y), 0.0) - plane * sin(place.y);
        let across = side * turn.x - up * turn.y;
        sum += weight * brdf_swept(d, m, dot(d, across), sigma, sweep);
    }
    return sum;
}
