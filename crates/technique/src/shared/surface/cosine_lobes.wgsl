// A generalised cosine lobe of red, green and blue: factor, C in x, y and z, exponent.
struct CosineLobe {
    rho: vec3<f32>,
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
    n: vec3<f32>,
}

// The lobe of the averages over a footprint of the largest value, and of that value times C, 1/n and |C|^2.
fn cosine_lobe(rho: vec3<f32>, cx: vec3<f32>, cy: vec3<f32>, cz: vec3<f32>, inverse: vec3<f32>, squares: vec3<f32>) -> CosineLobe {
    let weight = 1.0 / max(rho, vec3<f32>(1e-30));
    let x = weight * cx;
    let y = weight * cy;
    let z = weight * cz;
    let s = max(weight * inverse, vec3<f32>(1e-30));
    let q = weight * squares;
    let square = x * x + y * y + z * z;
    let scatter = vec3<f32>(1.0) - square / max(q, vec3<f32>(1e-30));
    let scattered = scatter > vec3<f32>(1e-5);
    let wide = select(s, s + 0.5 * scatter, scattered);
    let longer = select(vec3<f32>(1.0), sqrt(q / max(square, vec3<f32>(1e-30))), scattered);
    let scale = select(vec3<f32>(1.0), s * (1.0 + wide) / (wide * (1.0 + s)), scattered);
    return CosineLobe(rho * scale, x * longer, y * longer, z * longer, 1.0 / wide);
}
