
fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    if !(dot(n, wo) > 0.0) {
        return vec3<f32>(0.0);
    }
    return views_radiance(n, t, wo, site) + exact_radiance(n, views_frame(n, t)[0], wo);
}
