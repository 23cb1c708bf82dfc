fn local_radiance(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    if !(dot(n, wo) > 0.0) {
        return vec3<f32>(0.0);
    }
    return vec3<f32>(
        fetch_local_corners_at(site, 0u),
        fetch_local_corners_at(site, 1u),
        fetch_local_corners_at(site, 2u),
    );
}
