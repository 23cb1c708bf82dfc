
struct LocalTexel {
    views: LocalAround,
    pictures: array<array<vec3<f32>, 17>, 3>,
}

fn local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) -> LocalTexel {
    var x: LocalTexel;
    x.views = local_around(wo, 0u);
    let components = u32(technique.local_shape.x);
    let texels = u32(technique.local_shape.y);
    var taps = local_taps(uv, footprint);
    for (var v = 0u; v < 3u; v++) {
        for (var k = 0u; k <= components; k++) {
            let first = (x.views.corners[v] * (components + 1u) + k) * texels;
            for (var i = 0u; i < 8u; i++) {
                let tap = taps[i];
                if tap.weight > 0.0 {
                    let row = first + tap.texel;
                    let e = vec3<f32>(fetch_local_pictures(row, 0u), fetch_local_pictures(row, 1u), fetch_local_pictures(row, 2u));
                    x.pictures[v][k] += x.views.weights[v] * tap.weight * e;
                }
            }
        }
    }
    return x;
}

fn local_value(texel: LocalTexel, light: u32) -> vec3<f32> {
    var x = texel;
    let components = u32(technique.local_shape.x);
    var sum = vec3<f32>(0.0);
    for (var v = 0u; v < 3u; v++) {
        let pair = x.views.corners[v] * u32(technique.local_shape.z) + light;
        sum += x.pictures[v][0];
        for (var j = 0u; j < components; j++) {
            sum += fetch_local_weights(pair, j) * x.pictures[v][j + 1u];
        }
    }
    return sum;
}
