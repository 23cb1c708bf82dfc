// Textures on surfaces, whose levels lie one below the other, the finest first: the twin of
// scene::surface::Texture.
struct TextureColumns {
    first: i32,
    second: i32,
    weight: f32,
}

// The two texels of n about coordinate u; `wrap` is 0 to repeat, 1 to mirror, 2 to clamp.
fn texture_columns(u: f32, n: i32, wrap: u32) -> TextureColumns {
    if wrap == 1u {
        let x = (u - 2.0 * floor(0.5 * u)) * f32(n) - 0.5;
        let i = i32(floor(x));
        let a = select(select(i, i - 2 * n, i >= 2 * n), i + 2 * n, i < 0);
        let b = select(i + 1, i + 1 - 2 * n, i + 1 >= 2 * n);
        return TextureColumns(min(a, 2 * n - 1 - a), min(b, 2 * n - 1 - b), x - floor(x));
    }
    let x = select(u - floor(u), clamp(u, 0.0, 1.0), wrap == 2u) * f32(n) - 0.5;
    let i = i32(floor(x));
    if wrap == 2u {
        return TextureColumns(clamp(i, 0, n - 1), clamp(i + 1, 0, n - 1), x - floor(x));
    }
    return TextureColumns(select(i, i + n, i < 0), select(i + 1, i + 1 - n, i + 1 >= n), x - floor(x));
}

// One level, bilinear. `shape`: number of levels, rows of the finest, and the wrap modes in u (two bits) and
// v.
fn texture_level(image: texture_2d_array<f32>, uv: vec2<f32>, level: u32, layer: u32, shape: vec3<u32>) -> vec4<f32> {
    var above = 0u;
    for (var k = 0u; k < level; k++) {
        above += max(shape.y >> k, 1u);
    }
    let size = max(vec2<u32>(textureDimensions(image).x, shape.y) >> vec2<u32>(level), vec2<u32>(1u));
    let x = texture_columns(uv.x, i32(size.x), shape.z & 3u);
    let y = texture_columns(uv.y, i32(size.y), (shape.z >> 2u) & 3u);
    let first = y.first + i32(above);
    let second = y.second + i32(above);
    let a = textureLoad(image, vec2<i32>(x.first, first), layer, 0);
    let b = textureLoad(image, vec2<i32>(x.second, first), layer, 0);
    let c = textureLoad(image, vec2<i32>(x.first, second), layer, 0);
    let d = textureLoad(image, vec2<i32>(x.second, second), layer, 0);
    return mix(mix(a, b, x.weight), mix(c, d, x.weight), y.weight);
}

// The texture averaged over a square of side `footprint` in texture coordinates.
fn texture_texels(image: texture_2d_array<f32>, uv: vec2<f32>, footprint: f32, layer: u32, shape: vec3<u32>) -> vec4<f32> {
    let last = f32(shape.x - 1u);
    let size = max(textureDimensions(image).x, shape.y);
    let lod = clamp(log2(max(footprint * f32(size), 1.0)), 0.0, last);
    let low = floor(lod);
    let a = texture_level(image, uv, u32(low), layer, shape);
    let b = texture_level(image, uv, u32(min(low + 1.0, last)), layer, shape);
    return mix(a, b, lod - low);
}

// A texel in the order of all levels, the finest first, and its weight.
struct TextureTap {
    texel: u32,
    weight: f32,
}

// The texels of one level. `shape`: columns and rows of the finest, number of levels, wrap modes.
fn texture_four(uv: vec2<f32>, level: u32, weight: f32, shape: vec4<u32>) -> array<TextureTap, 4> {
    var first = 0u;
    var size = shape.xy;
    for (var k = 0u; k < level; k++) {
        first += size.x * size.y;
        size = max(size / 2u, vec2<u32>(1u));
    }
    let x = texture_columns(uv.x, i32(size.x), shape.w & 3u);
    let y = texture_columns(uv.y, i32(size.y), (shape.w >> 2u) & 3u);
    let above = first + u32(y.first) * size.x;
    let below = first + u32(y.second) * size.x;
    return array<TextureTap, 4>(
        TextureTap(above + u32(x.first), weight * (1.0 - x.weight) * (1.0 - y.weight)),
        TextureTap(above + u32(x.second), weight * x.weight * (1.0 - y.weight)),
        TextureTap(below + u32(x.first), weight * (1.0 - x.weight) * y.weight),
        TextureTap(below + u32(x.second), weight * x.weight * y.weight),
    );
}

// The texels that a square of side `footprint` averages: the twin of scene::surface::Patch::taps.
fn texture_taps(uv: vec2<f32>, footprint: f32, shape: vec4<u32>) -> array<TextureTap, 8> {
    let last = f32(shape.z - 1u);
    let lod = clamp(log2(max(footprint * f32(max(shape.x, shape.y)), 1.0)), 0.0, last);
    let low = floor(lod);
    let t = lod - low;
    let a = texture_four(uv, u32(low), 1.0 - t, shape);
    let b = texture_four(uv, u32(min(low + 1.0, last)), t, shape);
    return array<TextureTap, 8>(a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]);
}
