// Radiance of a hat of a cluster: its mean and components, weighed by site s.
fn hat(place: u32, s: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < ROW; k++) {
        let part = vec3<f32>(
            fetch_radiance(place, 3u * k),
            fetch_radiance(place, 3u * k + 1u),
            fetch_radiance(place, 3u * k + 2u),
        );
        sum += select(fetch_weights(s, k), 1.0, k == 0u) * part;
    }
    return sum;
}

// The four hats that act at the view, in the frame of site s.
fn at_corner(s: u32, wo: vec3<f32>) -> vec3<f32> {
    let n = vec3<f32>(fetch_normals(s, 0u), fetch_normals(s, 1u), fetch_normals(s, 2u));
    let a = select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), abs(n.y) < 0.99);
    let c = cross(a, n);
    if !(dot(c, c) > 0.0) {
        return vec3<f32>(0.0);
    }
    let x = normalize(c);
    let y = cross(n, x);
    let place = vec2<f32>(dot(x, wo), dot(y, wo)) / (1.0 + max(dot(n, wo), 0.0));
    let last = f32(HATS - 1u);
    let at = clamp(0.5 * (place + 1.0) * last, vec2<f32>(0.0), vec2<f32>(last));
    let first = min(vec2<u32>(at), vec2<u32>(HATS - 2u));
    let w = at - vec2<f32>(first);
    let i = u32(fetch_weights(s, 0u)) * HATS * HATS + first.y * HATS + first.x;
    let near = mix(hat(i, s), hat(i + 1u, s), w.x);
    let far = mix(hat(i + HATS, s), hat(i + HATS + 1u, s), w.x);
    return mix(near, far, w.y);
}

fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    if !(dot(n, wo) > 0.0) {
        return vec3<f32>(0.0);
    }
    return site.weight.x * at_corner(site.index.x, wo) + site.weight.y * at_corner(site.index.y, wo)
        + site.weight.z * at_corner(site.index.z, wo);
}
