
struct LocalTexel {
    views: LocalAround,
    count: u32,
    cluster: array<u32, 8>,
    weights: array<array<f32, 17>, 8>,
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    var x: LocalTexel;
    x.views = local_around(wo, 0u);
    let components = u32(technique.local_shape.x);
    var taps = local_taps(uv, footprint);
    for (var i = 0u; i < 8u; i++) {
        let tap = taps[i];
        if !(tap.weight > 0.0) {
            continue;
        }
        let cluster = u32(fetch_local_texels(tap.texel, 0u));
        var at = x.count;
        for (var k = 0u; k < x.count; k++) {
            if x.cluster[k] == cluster {
                at = k;
            }
        }
        if at == x.count {
            x.cluster[at] = cluster;
            x.count++;
        }
        x.weights[at][0] += tap.weight;
        for (var j = 1u; j <= components; j++) {
            x.weights[at][j] += tap.weight * fetch_local_texels(tap.texel, j);
        }
    }
    return x;
}

fn local_value(texel: LocalTexel, light: u32) -> vec3<f32> {
    var x = texel;
    let components = u32(technique.local_shape.x);
    let pairs = u32(technique.local_shape.y);
    var sum = vec3<f32>(0.0);
    for (var v = 0u; v < 3u; v++) {
        let pair = x.views.corners[v] * u32(technique.local_shape.z) + light;
        for (var k = 0u; k < x.count; k++) {
            for (var j = 0u; j <= components; j++) {
                let row = (x.cluster[k] * (components + 1u) + j) * pairs + pair;
                let e = vec3<f32>(fetch_local_tables(row, 0u), fetch_local_tables(row, 1u), fetch_local_tables(row, 2u));
                sum += x.views.weights[v] * x.weights[k][j] * e;
            }
        }
    }
    return sum;
}
