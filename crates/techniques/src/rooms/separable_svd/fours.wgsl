fn local_sum(x: vec2<f32>, y: vec2<f32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var layer = 0u; layer < u32(technique.local_maps.z); layer++) {
        let g = fetch_local_left_layer(x, layer);
        sum.r += dot(g, fetch_local_right_layer(y, 3u * layer));
        sum.g += dot(g, fetch_local_right_layer(y, 3u * layer + 1u));
        sum.b += dot(g, fetch_local_right_layer(y, 3u * layer + 2u));
    }
    return sum;
}
