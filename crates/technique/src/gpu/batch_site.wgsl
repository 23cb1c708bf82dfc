// The site of a point, whose numbers begin at plane k: bits of three indices, two weights, u and v, normal,
// tangent and side, footprint.
fn point_site(k: u32, i: u32, count: u32) -> Site {
    let second = points[(k + 3u) * count + i];
    let third = points[(k + 4u) * count + i];
    return Site(
        bitcast<vec3<u32>>(point_vector(k, i, count)),
        vec3<f32>(1.0 - second - third, second, third),
        vec2<f32>(points[(k + 5u) * count + i], points[(k + 6u) * count + i]),
        point_vector(k + 7u, i, count),
        vec4<f32>(point_vector(k + 10u, i, count), points[(k + 13u) * count + i]),
        points[(k + 14u) * count + i],
    );
}
