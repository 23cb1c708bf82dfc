// From radiance to what the canvas shows: the picture, or how far it is from the reference.
struct GpuShown {
    // Factor of radiance; the factor that the reference holds already; stops at the ends of the heat map, 0 for the
    // picture; unused.
    gain: vec4<f32>,
    // From the film (0 to 1 from its top left corner) to the reference's picture: scale, offset.
    place: vec4<f32>,
}
@group(3) @binding(0) var<uniform> gpu_shown: GpuShown;
// Exposed radiance and coverage.
@group(3) @binding(1) var gpu_reference: texture_2d<f32>;

// Luminance at which differences begin to count: a 256th of what shows as white.
const GPU_DARK: f32 = 0.00390625;

fn gpu_luminance(c: vec3<f32>) -> f32 {
    return dot(c, vec3<f32>(0.2126, 0.7152, 0.0722));
}

// IEC 61966-2-1.
fn gpu_encoded(c: vec3<f32>) -> vec3<f32> {
    let v = clamp(c, vec3<f32>(0.0), vec3<f32>(1.0));
    return select(1.055 * pow(v, vec3<f32>(1.0 / 2.4)) - 0.055, 12.92 * v, v <= vec3<f32>(0.0031308));
}

fn gpu_picture(l: vec3<f32>) -> vec3<f32> {
    return gpu_encoded(gpu_tone(clamp(l * gpu_shown.gain.x, vec3<f32>(0.0), vec3<f32>(1e6))));
}

// The reference's luminance at `at` texels, or -1 where surfaces do not fill the texel.
fn gpu_reference_at(at: vec2<i32>) -> f32 {
    let size = vec2<i32>(textureDimensions(gpu_reference));
    let c = textureLoad(gpu_reference, clamp(at, vec2<i32>(0), size - 1), 0);
    return select(-1.0, gpu_luminance(c.rgb), c.a > 0.999);
}

// Too dark is blue, too bright is red (the ends and the middle of Moreland's diverging map, 2009).
fn gpu_diverging(x: f32) -> vec3<f32> {
    let end = select(vec3<f32>(0.706, 0.016, 0.150), vec3<f32>(0.230, 0.299, 0.754), x < 0.0);
    let half_way = select(vec3<f32>(0.958, 0.603, 0.482), vec3<f32>(0.553, 0.691, 0.996), x < 0.0);
    let middle = vec3<f32>(0.865, 0.865, 0.865);
    let a = min(abs(x), 1.0);
    return select(mix(half_way, end, 2.0 * a - 1.0), mix(middle, half_way, 2.0 * a), a < 0.5);
}

const GPU_NO_HEAT: vec3<f32> = vec3<f32>(0.2, 0.2, 0.21);

fn gpu_heat(l: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let c = gpu_camera.view_projection * vec4<f32>(p, 1.0);
    let film = vec2<f32>(0.5 + 0.5 * c.x / c.w, 0.5 - 0.5 * c.y / c.w);
    let uv = film * gpu_shown.place.xy + gpu_shown.place.zw;
    if any(uv < vec2<f32>(0.0)) || any(uv > vec2<f32>(1.0)) {
        return GPU_NO_HEAT;
    }
    let at = uv * vec2<f32>(textureDimensions(gpu_reference)) - 0.5;
    let first = floor(at);
    let w = at - first;
    let k = vec2<i32>(first);
    let r = vec4<f32>(
        gpu_reference_at(k),
        gpu_reference_at(k + vec2<i32>(1, 0)),
        gpu_reference_at(k + vec2<i32>(0, 1)),
        gpu_reference_at(k + vec2<i32>(1, 1)),
    );
    let weights = vec4<f32>((1.0 - w.x) * (1.0 - w.y), w.x * (1.0 - w.y), (1.0 - w.x) * w.y, w.x * w.y);
    let taken = select(weights, vec4<f32>(0.0), r < vec4<f32>(0.0));
    let total = dot(taken, vec4<f32>(1.0));
    if total < 0.25 {
        return GPU_NO_HEAT;
    }
    let truth = dot(taken, r) / total;
    let stops = log2((gpu_luminance(l) * gpu_shown.gain.y + GPU_DARK) / (truth + GPU_DARK));
    return gpu_diverging(stops / gpu_shown.gain.z);
}
