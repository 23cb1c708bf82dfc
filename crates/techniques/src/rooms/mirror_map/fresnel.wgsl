// Schlick's Fresnel term.
fn fresnel(f0: vec3<f32>, cos_o: f32) -> vec3<f32> {
    let u = 1.0 - cos_o;
    return f0 + (vec3<f32>(1.0) - f0) * ((u * u) * (u * u) * u);
}

