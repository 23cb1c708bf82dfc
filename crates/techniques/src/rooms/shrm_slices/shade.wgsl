// The place among the candidates, 0 to 1: the inverse of theta_v = 89.5 degrees (1 - (1 - s)^2).
fn place(theta_v: f32) -> f32 {
    return 1.0 - sqrt(1.0 - min(theta_v * 0.6401763074, 1.0));
}

struct Leaning {
    c: vec3<f32>,
    zero: vec3<f32>,
}

// The centre at angle gamma from n, and the direction of azimuth 0 about it.
fn lean(n: vec3<f32>, wo: vec3<f32>, cos_o: f32, gamma: f32) -> Leaning {
    var side = wo - cos_o * n;
    let square = dot(side, side);
    if square > 1e-12 {
        side = side / sqrt(square);
    } else {
        let s = sqrt(n.x * n.x + n.z * n.z);
        side = vec3<f32>(n.y, 0.0, 0.0);
        if s > 0.0 {
            side = vec3<f32>(n.y * n.x / s, -s, n.y * n.z / s);
        }
    }
    return Leaning(n * cos(gamma) - side * sin(gamma), side * cos(gamma) + n * sin(gamma));
}

// The sum of a level's maps with the weights of its components and of the azimuth; `row` is the elevation
// before, and `x` the fraction of the way to the next one.
fn level_sum(level: u32, uv: vec2<f32>, phi: vec2<f32>, row: u32, x: f32) -> vec3<f32> {
    let rows = u32(fetch_levels(level, 0u));
    let columns = u32(fetch_levels(level, 1u));
    let components = u32(fetch_levels(level, 2u));
    let begin = u32(fetch_levels(level, 3u)) * 65536u + u32(fetch_levels(level, 4u));
    let first = u32(fetch_levels(level, 5u));
    let terms = u32(fetch_levels(level, 6u));
    let orders = u32(technique.orders.y) + 1u;
    var gx = uv.x * f32(columns) - 0.5;
    gx = select(gx, gx + f32(columns), gx < 0.0);
    let gy = clamp(uv.y, 0.0, 1.0) * f32(rows - 1u);
    let i = min(u32(gx), columns - 1u);
    let j = min(u32(gy), rows - 2u);
    let e = select(i + 1u, 0u, i + 1u == columns);
    let u = gx - f32(i);
    let v = gy - f32(j);
    let run = 3u * terms;
    let line = j * columns;
    let t00 = begin + (line + i) * run;
    let t10 = begin + (line + e) * run;
    let t01 = begin + (line + columns + i) * run;
    let t11 = begin + (line + columns + e) * run;
    let w = vec4<f32>((1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v);
    var out = vec3<f32>(0.0);
    var a = vec2<f32>(1.4142135623730951, 0.0);
    var now = 0u;
    var k = 0u;
    for (var m = 0u; m < components; m++) {
        let q = u32(fetch_curve(orders, first + m));
        while now < q {
            a = vec2<f32>(a.x * phi.x - a.y * phi.y, a.x * phi.y + a.y * phi.x);
            now++;
        }
        let weight = mix(fetch_curve(row, first + m), fetch_curve(row + 1u, first + m), x);
        let both = select(2u, 1u, q == 0u);
        for (var s = 0u; s < both; s++) {
            let azimuth = select(select(a.y, a.x, s == 0u), 1.0, q == 0u);
            for (var c = 0u; c < 3u; c++) {
                let at = c * terms + k;
                let taps = vec4<f32>(
                    fetch_maps(t00 + at, 0u),
                    fetch_maps(t10 + at, 0u),
                    fetch_maps(t01 + at, 0u),
                    fetch_maps(t11 + at, 0u)
                );
                out[c] += weight * azimuth * dot(w, taps);
            }
            k++;
        }
    }
    return out;
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let strands = technique.orders.z == 3.0;
    var part = 0.0;
    let along = tangent(n, t);
    if strands {
        part = angle(clamp(dot(along, wo), -1.0, 1.0)) * 0.3183098861837907;
    } else {
        part = place(brdf_atan2(length(wo - cos_o * n), cos_o));
    }
    let y = part * technique.orders.y;
    let row = min(u32(y), u32(technique.orders.y) - 1u);
    let x = y - f32(row);
    var head = vec4<f32>(0.0);
    for (var k = 0u; k < 4u; k++) {
        head[k] = mix(fetch_curve(row, k), fetch_curve(row + 1u, k), x);
    }
    var l = Leaning(along, n);
    if !strands {
        l = lean(n, wo, min(cos_o, 1.0), head.x);
    }
    let c = technique.turn * l.c;
    let d = globe_local(c, technique.turn * l.zero);
    let uv = globe_uv(c);
    var b = vec3<f32>(0.0);
    for (var level = 0u; level < u32(technique.orders.x); level++) {
        b += level_sum(level, uv, d.xy, row, x);
    }
    return head.yzw * b + exact_radiance(n, along, wo);
}
