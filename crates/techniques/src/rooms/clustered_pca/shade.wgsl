// The clusters of the three sites around a point, at the mirror direction; `at_corner` is written for the numbers of
// coefficients and components.
fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let y = harmonics(2.0 * cos_o * n - wo);
    return site.weight.x * at_corner(site.index.x, y) + site.weight.y * at_corner(site.index.y, y)
        + site.weight.z * at_corner(site.index.z, y);
}
