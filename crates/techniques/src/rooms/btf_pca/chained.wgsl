
struct LocalTexel {
    views: LocalAround,
    taps: array<LocalTap, 8>,
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    return LocalTexel(local_around(wo, 0u), local_taps(uv, footprint));
}

fn local_value(texel: LocalTexel, light: u32) -> vec3<f32> {
    var x = texel;
    let terms = u32(technique.local_shape.x);
    let halves = u32(technique.local_shape.y);
    var sum = vec3<f32>(0.0);
    for (var v = 0u; v < 3u; v++) {
        let pair = x.views.corners[v] * u32(technique.local_shape.z) + light;
        let by = x.views.weights[v] * fetch_local_cosines(light, 1u);
        for (var i = 0u; i < 8u; i++) {
            let tap = x.taps[i];
            if tap.weight > 0.0 {
                for (var k = 0u; k < 3u; k++) {
                    let weight = by * tap.weight * fetch_local_places(pair, 3u + k);
                    let first = (tap.texel * halves + u32(fetch_local_places(pair, k))) * terms;
                    for (var j = 0u; j < terms; j++) {
                        let row = first + j;
                        let p = vec3<f32>(fetch_local_products(row, 0u), fetch_local_products(row, 1u), fetch_local_products(row, 2u));
                        sum += weight * fetch_local_factors(pair, j) * p;
                    }
                }
            }
        }
    }
    return sum;
}
