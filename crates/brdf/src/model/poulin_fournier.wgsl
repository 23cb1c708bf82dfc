// The twin of poulin_fournier.rs and cosine_power.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // w: d
    kd: vec4<f32>,
    // w: h
    ks: vec4<f32>,
    // n, the tabulated exponent, step of the table
    power: vec4<f32>,
    // The tail from 0, of cos^n and of cos^n cos 2x
    whole: vec4<f32>,
    // Q, Q', Q'' at the steps, in units of the step
    table: array<vec4<f32>, BRDF_NODES>,
}

const BRDF_HALF_PI: f32 = 1.57079632679490;

fn brdf_tabulated(x: f32) -> f32 {
    let u = x / brdf.power.z;
    let k = u32(u);
    if k >= BRDF_NODES - 1u {
        return 0.0;
    }
    let a = brdf.table[k].xyz;
    let b = brdf.table[k + 1u].xyz;
    let t = u - f32(k);
    let r0 = b.x - a.x - a.y - 0.5 * a.z;
    let r1 = b.y - a.y - a.z;
    let r2 = b.z - a.z;
    let c3 = 10.0 * r0 - 4.0 * r1 + 0.5 * r2;
    let c4 = -15.0 * r0 + 7.0 * r1 - r2;
    let c5 = 6.0 * r0 - 3.0 * r1 + 0.5 * r2;
    return a.x + t * (a.y + t * (0.5 * a.z + t * (c3 + t * (c4 + t * c5))));
}

fn brdf_tail(x: f32) -> vec3<f32> {
    if x >= BRDF_HALF_PI {
        return vec3<f32>(0.0);
    }
    let s = sin(x);
    let c = cos(x);
    let n = brdf.power.x;
    let c1 = brdf_cosine_pow(c, s * s, n + 1.0);
    var even = brdf_tabulated(x);
    var power = brdf.power.y;
    while power > n + 0.5 {
        power -= 2.0;
        even = ((power + 2.0) * even + brdf_cosine_pow(c, s * s, power + 1.0) * s) / (power + 1.0);
    }
    return vec3<f32>(even, (n * even - 2.0 * c1 * s) / (n + 2.0), 2.0 * c1 * c / (n + 2.0));
}

fn brdf_integrals(lo: f32, hi: f32) -> vec3<f32> {
    let a = brdf_tail(abs(lo));
    let b = brdf_tail(abs(hi));
    let whole = brdf.whole.xy;
    var even: vec2<f32>;
    if lo < 0.0 {
        even = select(2.0 * whole - a.xy - b.xy, b.xy - a.xy, hi < 0.0);
    } else {
        even = select(a.xy - b.xy, a.xy + b.xy - 2.0 * whole, hi < 0.0);
    }
    return vec3<f32>(even, a.z - b.z);
}

// Length and tilt across the cylinders.
fn brdf_across(w: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(length(w.yz), brdf_atan2(w.y, w.z));
}

fn brdf_seen(w: vec2<f32>) -> vec2<f32> {
    let h = brdf.ks.w;
    let limit = brdf_atan2(sqrt((1.0 - h) * (1.0 + h)), h);
    let free = brdf_asin(clamp(brdf.kd.w * cos(w.y) - 1.0, -1.0, 1.0));
    if w.y >= 0.0 {
        return vec2<f32>(max(w.y - BRDF_HALF_PI, -limit), min(w.y + free, limit));
    }
    return vec2<f32>(max(w.y - free, -limit), min(w.y + BRDF_HALF_PI, limit));
}

// By sine and cosine of the tilt from the direction itself: those of an angle near the horizon hold no digits
// of 1 - sine.
fn brdf_floor(w: vec3<f32>) -> vec2<f32> {
    let h = brdf.ks.w;
    let edge = sqrt((1.0 - h) * (1.0 + h));
    let size = max(length(w.yz), 1e-37);
    let sine = abs(w.y) / size;
    let cosine = w.z / size;
    var shadow = edge;
    if sine > h {
        shadow = max((1.0 - h + h * cosine * cosine / (1.0 + sine)) / max(cosine, 1e-12), edge);
    }
    if w.y >= 0.0 {
        return vec2<f32>(edge, brdf.kd.w - shadow);
    }
    return vec2<f32>(shadow, brdf.kd.w - edge);
}

fn brdf_diffuse(i: vec2<f32>, o: vec2<f32>, part: vec2<f32>) -> f32 {
    // w cos a + sin w cos b, a and b of which cancel near the horizon: cos a + cos b as a product, sin w less
    // w as a series.
    let w = part.y - part.x;
    let a = i.y - o.y;
    let b = part.y + part.x - i.y - o.y;
    let less = select(w - sin(w), w * w * w * (1.0 / 6.0 - w * w * (1.0 / 120.0 - w * w / 5040.0)), w < 0.5);
    let sum = w * 2.0 * cos(0.5 * (a + b)) * cos(0.5 * (a - b)) - less * cos(b);
    return 0.5 * sum * i.x * o.x;
}

fn brdf_specular(i: vec2<f32>, o: vec2<f32>, m: vec3<f32>, part: vec2<f32>) -> f32 {
    let h = brdf_across(m);
    let v = brdf_integrals(part.x - h.y, part.y - h.y);
    let turn = 2.0 * h.y - i.y - o.y;
    let sum = cos(i.y - o.y) * v.x + cos(turn) * v.y - sin(turn) * v.z;
    return 0.5 * max(sum, 0.0) * brdf_cosine_pow(h.x, m.x * m.x, brdf.power.x) * i.x * o.x;
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let m = brdf_half(wi, wo);
    let i = brdf_across(wi);
    let o = brdf_across(wo);
    let si = brdf_seen(i);
    let so = brdf_seen(o);
    let part = vec2<f32>(max(si.x, so.x), min(si.y, so.y));
    var diffuse = 0.0;
    var specular = 0.0;
    if part.y > part.x {
        diffuse += max(brdf_diffuse(i, o, part), 0.0);
        specular += brdf_specular(i, o, m, part);
    }
    let fi = brdf_floor(wi);
    let fo = brdf_floor(wo);
    let width = max(min(fi.y, fo.y) - max(fi.x, fo.x), 0.0) * wi.z * wo.z;
    diffuse += width;
    specular += width * brdf_power_cosine(vec3<f32>(0.0, 0.0, 1.0), m, brdf.power.x);
    let scale = 1.0 / max(brdf.kd.w * wi.z * wo.z, 1e-37);
    specular *= (brdf.power.x + 8.0) / (8.0 * BRDF_PI);
    return scale * (brdf.kd.rgb * (BRDF_INV_PI * diffuse) + brdf.ks.rgb * specular);
}
