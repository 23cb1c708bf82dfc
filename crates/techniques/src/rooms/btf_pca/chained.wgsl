
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
        let h = u32(fetch_local_cells(pair, 0u));
        let d = u32(fetch_local_cells(pair, 1u));
        let by = x.views.weights[v] * fetch_local_cosines(light, 1u);
        for (var i = 0u; i < 8u; i++) {
            let tap = x.taps[i];
            if tap.weight > 0.0 {
                for (var j = 0u; j < terms; j++) {
                    let row = (tap.texel * halves + h) * terms + j;
                    let p = vec3<f32>(fetch_local_factors(row, 0u), fetch_local_factors(row, 1u), fetch_local_factors(row, 2u));
                    sum += by * tap.weight * fetch_local_differences(d, j) * p;
                }
            }
        }
    }
    return sum;
}
