fn local_sum(x: vec2<f32>, y: vec2<f32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    let terms = u32(technique.local_maps.w);
    for (var layer = 0u; layer < u32(technique.local_maps.z); layer++) {
        let g = fetch_local_left_layer(x, layer);
        for (var k = 4u * layer; k < min(4u * layer + 4u, terms); k++) {
            sum += g[k % 4u] * fetch_local_right_layer(y, k).rgb;
        }
    }
    return sum;
}
