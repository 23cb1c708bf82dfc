// A point's own lobe; the twin of shared/surface/lobe.rs, where the derivation is.
struct LobeTaps {
    axis: vec3<f32>,
    side: i32,
    alpha: f32,
}

struct LobeTap {
    n: vec3<f32>,
    r: vec3<f32>,
    cos_o: f32,
    weight: f32,
}

const LOBE_REACH: f32 = 2.4;
const LOBE_STEP: f32 = 1.5;
const LOBE_GRAZING: f32 = 0.01;

fn lobe_alpha_of(lobe: Lobe, own: f32) -> f32 {
    return select(own, lobe.alpha, lobe.alpha >= 0.0);
}

fn lobe_reach(side: f32) -> f32 {
    return (side * LOBE_STEP / LOBE_REACH) * (side * LOBE_STEP / LOBE_REACH);
}

fn lobe_taps(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, lobe: Lobe, own: f32, finest: f32) -> LobeTaps {
    let alpha = lobe_alpha_of(lobe, own);
    let round_part = max(alpha * alpha + lobe.widen, lobe.least * lobe.least);
    if !(lobe.spread.x + lobe.spread.z > 0.0) {
        return LobeTaps(vec3<f32>(0.0), 0, sqrt(round_part));
    }
    let b = cross(n, t);
    let cos_n = min(dot(n, wo), 1.0);
    let across = wo - cos_n * n;
    let length_across = length(across);
    var c = 1.0;
    var s = 0.0;
    if length_across > 1e-4 {
        c = dot(across, t) / length_across;
        s = dot(across, b) / length_across;
    }
    let cos_o = max(cos_n, LOBE_GRAZING);
    let pp = c * c * lobe.spread.x + 2.0 * c * s * lobe.spread.y + s * s * lobe.spread.z;
    let ps = (c * c - s * s) * lobe.spread.y + c * s * (lobe.spread.z - lobe.spread.x);
    let ss = s * s * lobe.spread.x - 2.0 * c * s * lobe.spread.y + c * c * lobe.spread.z;
    let a = 4.0 * pp;
    let h = 4.0 * cos_o * ps;
    let d = 4.0 * cos_o * cos_o * ss;
    let mean = 0.5 * (a + d);
    let half_gap = 0.5 * (a - d);
    let radius = sqrt(half_gap * half_gap + h * h);
    let large = mean + radius;
    let limit = (LOBE_REACH / (8.0 * LOBE_STEP)) * (LOBE_REACH / (8.0 * LOBE_STEP));
    let sharpest = max(round_part, finest * finest);
    let small = min(max(max(mean - radius, 0.0), (limit * large - sharpest) / (0.5 + limit)), large);
    let rest = large - small;
    let alpha2 = round_part + 0.5 * small;
    let ratio = rest / max(alpha2, finest * finest);
    if ratio < 0.02 {
        return LobeTaps(vec3<f32>(0.0), 0, sqrt(alpha2 + 0.25 * rest));
    }
    var side = 8;
    if ratio <= lobe_reach(2.0) {
        side = 2;
    } else if ratio <= lobe_reach(4.0) {
        side = 4;
    }
    let e = select(vec2<f32>(h, radius - half_gap), vec2<f32>(radius + half_gap, h), half_gap >= 0.0);
    let scale = sqrt(rest / max(dot(e, e), 1e-30));
    let x = 0.5 * scale * e.x;
    let y = 0.5 * scale * e.y / cos_o;
    return LobeTaps((x * c - y * s) * t + (x * s + y * c) * b, side, sqrt(alpha2));
}

fn lobe_tap_at(n: vec3<f32>, wo: vec3<f32>, weight: f32) -> LobeTap {
    let cos_o = clamp(dot(n, wo), LOBE_GRAZING, 1.0);
    return LobeTap(n, 2.0 * cos_o * n - wo, cos_o, weight);
}

fn lobe_tap(taps: LobeTaps, n: vec3<f32>, wo: vec3<f32>, k: i32) -> LobeTap {
    if taps.side == 0 {
        return lobe_tap_at(n, wo, 1.0);
    }
    var norm = 0.12095019;
    var stretch = 1.0417652;
    if taps.side == 2 {
        norm = 0.47943833;
        stretch = 1.0090522;
    } else if taps.side == 4 {
        norm = 0.2408413;
        stretch = 1.0275699;
    }
    let x = f32(k) * (LOBE_REACH / f32(taps.side));
    return lobe_tap_at(normalize(n + stretch * x * taps.axis), wo, norm * exp(-0.5 * x * x));
}

// One of four normals that have the moments of the normals under the point.
fn lobe_normal(n: vec3<f32>, t: vec3<f32>, lobe: Lobe, k: i32) -> vec3<f32> {
    let l11 = sqrt(2.0 * max(lobe.spread.x, 0.0));
    var l21 = 0.0;
    if l11 > 0.0 {
        l21 = 2.0 * lobe.spread.y / l11;
    }
    let l22 = sqrt(max(2.0 * lobe.spread.z - l21 * l21, 0.0));
    let sign_k = f32(1 - 2 * (k % 2));
    let at = sign_k * select(vec2<f32>(0.0, l22), vec2<f32>(l11, l21), k < 2);
    return normalize(n + at.x * t + at.y * cross(n, t));
}
