// Face and position on it, Khronos orientation; the CPU's `tables::edge_cube::face_position`.
struct FacePosition {
    face: u32,
    s: f32,
    t: f32,
}

fn face_position(d: vec3<f32>) -> FacePosition {
    let a = abs(d);
    var face: u32;
    var s: f32;
    var t: f32;
    var m: f32;
    if a.x >= a.y && a.x >= a.z {
        m = a.x;
        face = select(0u, 1u, d.x < 0.0);
        s = select(-d.z, d.z, d.x < 0.0);
        t = -d.y;
    } else if a.y >= a.z {
        m = a.y;
        face = select(2u, 3u, d.y < 0.0);
        s = d.x;
        t = select(d.z, -d.z, d.y < 0.0);
    } else {
        m = a.z;
        face = select(4u, 5u, d.z < 0.0);
        s = select(d.x, -d.x, d.z < 0.0);
        t = -d.y;
    }
    return FacePosition(face, 0.5 * (s / m) + 0.5, 0.5 * (t / m) + 0.5);
}

// The cube of place.z intervals at place.xy of the layers from `first` on, bilinear.
fn cube_texels(image: texture_2d_array<f32>, d: vec3<f32>, place: vec3<u32>, first: u32) -> vec3<f32> {
    let at = face_position(d);
    let layer = first + at.face;
    let last = f32(place.z);
    let x = clamp(at.s, 0.0, 1.0) * last;
    let y = clamp(at.t, 0.0, 1.0) * last;
    let i = min(floor(x), last - 1.0);
    let j = min(floor(y), last - 1.0);
    let c = place.xy + vec2<u32>(u32(i), u32(j));
    let t00 = textureLoad(image, c, layer, 0u).rgb;
    let t10 = textureLoad(image, c + vec2<u32>(1u, 0u), layer, 0u).rgb;
    let t01 = textureLoad(image, c + vec2<u32>(0u, 1u), layer, 0u).rgb;
    let t11 = textureLoad(image, c + vec2<u32>(1u, 1u), layer, 0u).rgb;
    return mix(mix(t00, t10, x - i), mix(t01, t11, x - i), y - j);
}

// The whole of six layers from `first` on.
fn cube_layers(image: texture_2d_array<f32>, d: vec3<f32>, first: u32) -> vec3<f32> {
    return cube_texels(image, d, vec3<u32>(0u, 0u, textureDimensions(image).x - 1u), first);
}
