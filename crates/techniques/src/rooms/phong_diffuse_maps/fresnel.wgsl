// F = f0 + (1 - f0)(1 - n.wo)^5; f = (f0, 1 - f0).
fn fresnel(f: vec2<f32>, cos_o: f32) -> f32 {
    let u = 1.0 - cos_o;
    return f.x + f.y * ((u * u) * (u * u) * u);
}

