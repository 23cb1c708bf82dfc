
fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    let d = dot(n, wo);
    if !(d > 0.0) {
        return vec3<f32>(0.0);
    }
    let diffuse = technique.diffuse.rgb * fetch_irradiance(technique.turn * n) - hidden_diffuse(site);
    return max(diffuse, vec3<f32>(0.0)) + lobes_of(n, t, wo, d, blocked_at(site));
}
