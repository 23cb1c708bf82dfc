
// Radiance of the suns apart, with the exact reflectance.
fn exact_radiance(n: vec3<f32>, along: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let t = normalize(along - n * dot(n, along));
    let frame = transpose(mat3x3<f32>(t, cross(n, t), n));
    let o = frame * wo;
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < u32(room.suns.x); k++) {
        let d = vec3<f32>(fetch_suns(k, 0u), fetch_suns(k, 1u), fetch_suns(k, 2u));
        let radiance = vec3<f32>(fetch_suns(k, 4u), fetch_suns(k, 5u), fetch_suns(k, 6u));
        // A row vector times a rotation is its inverse times the vector.
        sum += exact_disk(frame * (d * room.turn), fetch_suns(k, 3u), o) * radiance;
    }
    return sum;
}
