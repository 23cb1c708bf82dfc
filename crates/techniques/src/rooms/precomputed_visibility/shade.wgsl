
// The loop over directional and point lights, and over the directions along which light arrives at the vertices.
// Of each light the vertices see a part, or where the scene has shadows of its own, those say it for the point.
fn local_radiance(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    let frame = transpose(mat3x3<f32>(t, cross(n, t), n));
    let o = frame * wo;
    if !(o.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let most = vec3<f32>(3.4028234e38);
    let directions = u32(technique.local_scatter.x);
    let vertices = u32(technique.local_scatter.y);
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < u32(technique.local_count); k++) {
        let light = local_light(k, p);
        if !light.there {
            continue;
        }
        var seen = 0.0;
        if technique.local_scatter.z > 0.0 {
            seen = light_arriving(p, n, light.d, light.distance);
        } else {
            seen = fetch_local_rows_at(site, 3u * directions + k);
        }
        if seen > 0.0 {
            sum = clamp(sum + seen * local_f_cos(frame * light.d, o) * light.e, -most, most);
        }
    }
    var cosines = 0.0;
    var more = vec3<f32>(0.0);
    for (var k = 0u; k < 3u * directions; k += 3u) {
        let d = frame * vec3<f32>(fetch_local_rows(vertices, k), fetch_local_rows(vertices, k + 1u), fetch_local_rows(vertices, k + 2u));
        if d.z > 0.0 {
            cosines += d.z;
            let l = vec3<f32>(
                fetch_local_rows_at(site, k),
                fetch_local_rows_at(site, k + 1u),
                fetch_local_rows_at(site, k + 2u),
            );
            if any(l != vec3<f32>(0.0)) {
                more = clamp(more + local_f_cos(d, o) * l, -most, most);
            }
        }
    }
    // All directions above a point have one weight, by which their cosines sum to pi.
    let weight = select(0.0, 3.1415927 / cosines, cosines > 0.0);
    return clamp(sum + weight * more, -most, most);
}
