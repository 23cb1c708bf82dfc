fn diffuse(n: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}

