// The three sites around a point, weighed.
fn views_at_site(site: Site, n: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    var l = vec3<f32>(0.0);
    for (var k = 0u; k < 3u; k++) {
        let w = site.weight[k];
        if w != 0.0 {
            l += w * views_local(site.index[k], n, wo);
        }
    }
    return l;
}
