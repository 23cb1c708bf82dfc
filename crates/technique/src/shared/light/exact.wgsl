
// Radiance of the suns apart, with the exact reflectance: exact_radiance, once all names have their prefix.
fn radiance(n: vec3<f32>, along: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let t = normalize(along - n * dot(n, along));
    let frame = transpose(mat3x3<f32>(t, cross(n, t), n));
    let o = frame * wo;
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < u32(technique.suns.x); k++) {
        // A row vector times a rotation is its inverse times the vector.
        let pole = frame * (vec3<f32>(fetch_suns(k, 0u), fetch_suns(k, 1u), fetch_suns(k, 2u)) * technique.turn);
        let theta = vec2<f32>(fetch_suns(k, 6u), fetch_suns(k, 7u));
        let half = fetch_suns(k, 8u);
        var seen = vec3<f32>(0.0);
        if half > 0.0 {
            let along = vec3<f32>(fetch_suns(k, 3u), fetch_suns(k, 4u), fetch_suns(k, 5u));
            seen = gpu_cell(pole, frame * (along * technique.turn), theta, half, o);
        } else {
            seen = gpu_disk(pole, theta.y, o);
        }
        sum += seen * vec3<f32>(fetch_suns(k, 9u), fetch_suns(k, 10u), fetch_suns(k, 11u));
    }
    return sum;
}
