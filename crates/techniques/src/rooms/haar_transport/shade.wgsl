// Radiance of a site, which each frame sums over wavelets (Ng, Ramamoorthi & Hanrahan 2003).
fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    let l = vec3<f32>(fetch_radiance_at(site, 0u), fetch_radiance_at(site, 1u), fetch_radiance_at(site, 2u));
    return select(vec3<f32>(0.0), l, dot(n, wo) > 0.0);
}
