// albedo L_a ao (STAR04 eq. 6).
fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    return select(vec3<f32>(0.0), technique.full.xyz * fetch_occlusion_at(site, 0u), dot(n, wo) > 0.0);
}
