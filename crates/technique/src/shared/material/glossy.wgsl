// Light that is not blocked, convolved with Phong's lobe at the mirror direction; `lobe` and `transferred` are written for
// the number of coefficients.
fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    return transferred(site, lobe(2.0 * cos_o * n - wo));
}
