// Radiance of a point whose shading normal differs from the surface's own.
fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    return select(vec3<f32>(0.0), transferred(site) + bumped(site, n), dot(n, wo) > 0.0);
}
