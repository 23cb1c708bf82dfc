// Light that reaches a point and is reflected; `transferred` is written for the number of coefficients.
fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    return select(vec3<f32>(0.0), transferred(site), dot(n, wo) > 0.0);
}
