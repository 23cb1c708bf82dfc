// A row whose outer texels lie on 0 and 1, linear.
fn line_texels(image: texture_2d_array<f32>, u: f32) -> vec4<f32> {
    let last = f32(textureDimensions(image).x - 1u);
    let x = clamp(u, 0.0, 1.0) * last;
    let i = min(floor(x), last - 1.0);
    let a = textureLoad(image, vec2<u32>(u32(i), 0u), 0u, 0u);
    let b = textureLoad(image, vec2<u32>(u32(i) + 1u, 0u), 0u, 0u);
    return mix(a, b, x - i);
}
