// Radiance that leaves the corners of a triangle because of each group of lights, interpolated: of all together,
// or of each light by itself where the point lies behind something.
fn local_radiance(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    if !(dot(n, wo) > 0.0) {
        return sum;
    }
    for (var k = 0u; k < u32(technique.local_groups); k++) {
        var seen = 1.0;
        if technique.local_shadowed > 0.0 {
            let light = local_light(k, p);
            if light.there {
                seen = light_arriving(p, n, light.d, light.distance);
            }
        }
        if seen > 0.0 {
            sum += seen * vec3<f32>(
                fetch_local_corners_at(site, 3u * k),
                fetch_local_corners_at(site, 3u * k + 1u),
                fetch_local_corners_at(site, 3u * k + 2u),
            );
        }
    }
    return sum;
}
