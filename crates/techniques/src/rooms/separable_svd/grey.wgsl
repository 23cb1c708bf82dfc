fn local_sum(x: vec2<f32>, y: vec2<f32>) -> vec3<f32> {
    var s = 0.0;
    for (var k = 0u; k < u32(technique.local_maps.z); k++) {
        s += dot(fetch_local_left_layer(x, k), fetch_local_right_layer(y, k));
    }
    return s * technique.local_tint.rgb;
}
