fn diffuse(n: vec3<f32>) -> vec3<f32> {
    return fetch_diffuse(globe_uv(n), 0u).rgb;
}

