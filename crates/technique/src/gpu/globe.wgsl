// A lat-long layer whose first and last rows lie on the poles, bilinear; u wraps.
fn globe_texels(image: texture_2d_array<f32>, uv: vec2<f32>, layer: u32) -> vec4<f32> {
    let size = textureDimensions(image);
    let x = fract(uv.x - 0.5 / f32(size.x)) * f32(size.x);
    let y = clamp(uv.y, 0.0, 1.0) * f32(size.y - 1u);
    let i = min(u32(x), size.x - 1u);
    let j = min(u32(y), size.y - 2u);
    let e = (i + 1u) % size.x;
    let t00 = textureLoad(image, vec2<u32>(i, j), layer, 0u);
    let t10 = textureLoad(image, vec2<u32>(e, j), layer, 0u);
    let t01 = textureLoad(image, vec2<u32>(i, j + 1u), layer, 0u);
    let t11 = textureLoad(image, vec2<u32>(e, j + 1u), layer, 0u);
    let u = x - f32(i);
    return mix(mix(t00, t10, u), mix(t01, t11, u), y - f32(j));
}
