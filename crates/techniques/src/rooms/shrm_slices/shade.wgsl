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

// The sum over q of a node's maps with weights 1, sqrt 2 cos q phi, sqrt 2 sin q phi.
fn node_sum(node: u32, uv: vec2<f32>, phi: vec2<f32>) -> vec3<f32> {
    let rows = u32(fetch_nodes(node, 0u));
    let columns = u32(fetch_nodes(node, 1u));
    let terms = u32(fetch_nodes(node, 2u));
    let begin = u32(fetch_nodes(node, 4u)) * 65536u + u32(fetch_nodes(node, 5u));
    var x = uv.x * f32(columns) - 0.5;
    x = select(x, x + f32(columns), x < 0.0);
    let y = clamp(uv.y, 0.0, 1.0) * f32(rows - 1u);
    let i = min(u32(x), columns - 1u);
    let j = min(u32(y), rows - 2u);
    let e = select(i + 1u, 0u, i + 1u == columns);
    let u = x - f32(i);
    let v = y - f32(j);
    let run = 3u * terms;
    let row = j * columns;
    let t00 = begin + (row + i) * run;
    let t10 = begin + (row + e) * run;
    let t01 = begin + (row + columns + i) * run;
    let t11 = begin + (row + columns + e) * run;
    let w = vec4<f32>((1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v);
    var out = vec3<f32>(0.0);
    var a = vec2<f32>(1.4142135623730951, 0.0);
    for (var k = 0u; k < terms; k++) {
        var weight = 1.0;
        if k % 2u == 1u {
            a = vec2<f32>(a.x * phi.x - a.y * phi.y, a.x * phi.y + a.y * phi.x);
            weight = a.x;
        } else if k > 0u {
            weight = a.y;
        }
        for (var c = 0u; c < 3u; c++) {
            let at = c * terms + k;
            let taps = vec4<f32>(
                fetch_maps(t00 + at, 0u),
                fetch_maps(t10 + at, 0u),
                fetch_maps(t01 + at, 0u),
                fetch_maps(t11 + at, 0u)
            );
            out[c] += weight * dot(w, taps);
        }
    }
    return out;
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let strands = room.orders.z == 3.0;
    var part = 0.0;
    let along = tangent(n, t);
    if strands {
        part = angle(clamp(dot(along, wo), -1.0, 1.0)) * 0.3183098861837907;
    } else {
        part = place(angle(min(cos_o, 1.0)));
    }
    let curve = fetch_curve(part);
    var l = Leaning(along, n);
    if !strands {
        l = lean(n, wo, min(cos_o, 1.0), curve.x);
    }
    let c = room.turn * l.c;
    let d = globe_local(c, room.turn * l.zero);
    let uv = globe_uv(c);
    let x = part * room.orders.y;
    let last = u32(room.orders.x) - 2u;
    var node = 0u;
    while node < last && fetch_nodes(node + 1u, 3u) <= x {
        node++;
    }
    let before = fetch_nodes(node, 3u);
    let w = (x - before) / (fetch_nodes(node + 1u, 3u) - before);
    let b = mix(node_sum(node, uv, d.xy), node_sum(node + 1u, uv, d.xy), w);
    return curve.yzw * b;
}
