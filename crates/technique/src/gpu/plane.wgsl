// A layer whose outer texels lie on the ends of [0, 1]^2, bilinear.
fn plane_texels(image: texture_2d_array<f32>, uv: vec2<f32>, layer: u32) -> vec4<f32> {
    let last = vec2<f32>(textureDimensions(image, 0u) - vec2<u32>(1u, 1u));
    let p = clamp(uv, vec2<f32>(0.0), vec2<f32>(1.0)) * last;
    let q = min(floor(p), last - vec2<f32>(1.0));
    let c = vec2<u32>(q);
    let t00 = textureLoad(image, c, layer, 0u);
    let t10 = textureLoad(image, c + vec2<u32>(1u, 0u), layer, 0u);
    let t01 = textureLoad(image, c + vec2<u32>(0u, 1u), layer, 0u);
    let t11 = textureLoad(image, c + vec2<u32>(1u, 1u), layer, 0u);
    let w = p - q;
    return mix(mix(t00, t10, w.x), mix(t01, t11, w.x), w.y);
}
