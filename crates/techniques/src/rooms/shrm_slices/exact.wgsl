
// Radiance of the lights apart, with the exact reflectance.
fn exact_radiance(n: vec3<f32>, along: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let t = normalize(along - n * dot(n, along));
    let frame = transpose(mat3x3<f32>(t, cross(n, t), n));
    let o = frame * wo;
    let first = u32(room.orders.x);
    var sum = vec3<f32>(0.0);
    for (var k = first; k < first + u32(room.orders.w); k++) {
        let d = vec3<f32>(fetch_levels(k, 0u), fetch_levels(k, 1u), fetch_levels(k, 2u));
        let radiance = vec3<f32>(fetch_levels(k, 4u), fetch_levels(k, 5u), fetch_levels(k, 6u));
        // A row vector times a rotation is its inverse times the vector.
        sum += exact_disk(frame * (d * room.turn), fetch_levels(k, 3u), o) * radiance;
    }
    return sum;
}
