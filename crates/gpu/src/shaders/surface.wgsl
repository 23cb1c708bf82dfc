// From an interpolated surface to radiance: the twin of what the CPU renderer does at a hit.
struct GpuPoint {
    p: vec3<f32>,
    n: vec3<f32>,
    t: vec3<f32>,
    uv: vec2<f32>,
    // Geometric normal; w: texture coordinates per metre. The raster path leaves it 0 where nothing
    // needs it.
    plane: vec4<f32>,
    // 1 where the viewer sees the outside, else -1.
    side: f32,
}

// Smallest n.wo of a shading normal: interpolated normals that turn away from the viewer are bent back.
const GPU_GRAZING: f32 = 0.01;

fn gpu_facing(n: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let c = dot(n, wo);
    if c >= GPU_GRAZING {
        return n;
    }
    let across = n - wo * c;
    let length_across = length(across);
    if !(length_across > 0.0) {
        return wo;
    }
    return wo * GPU_GRAZING + across * (sqrt(1.0 - GPU_GRAZING * GPU_GRAZING) / length_across);
}

// The tangent projected to the plane of n; without one, that of a surface without tangents.
fn gpu_tangent(n: vec3<f32>, tangent: vec3<f32>) -> vec3<f32> {
    let t = tangent - n * dot(n, tangent);
    if dot(t, t) > 1e-12 * dot(tangent, tangent) {
        return normalize(t);
    }
    return normalize(cross(select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), abs(n.y) < 0.99), n));
}

// `at` is at most one texel beyond the borders, where the texture repeats.
fn gpu_texel(at: vec2<i32>, size: vec2<i32>, level: i32) -> vec3<f32> {
    let below = select(at, at + size, at < vec2<i32>(0));
    return textureLoad(gpu_base_colour, select(below, below - size, below >= size), level).rgb;
}

fn gpu_bilinear(uv: vec2<f32>, level: i32) -> vec3<f32> {
    let size = vec2<i32>(textureDimensions(gpu_base_colour, level));
    let x = fract(uv) * vec2<f32>(size) - 0.5;
    let i = floor(x);
    let w = x - i;
    let k = vec2<i32>(i);
    let top = mix(gpu_texel(k, size, level), gpu_texel(k + vec2<i32>(1, 0), size, level), w.x);
    let bottom = mix(gpu_texel(k + vec2<i32>(0, 1), size, level), gpu_texel(k + vec2<i32>(1, 1), size, level), w.x);
    return mix(top, bottom, w.y);
}

// The base colour averaged over a square of side `footprint` in texture coordinates.
fn gpu_tint(uv: vec2<f32>, footprint: f32) -> vec3<f32> {
    let size = textureDimensions(gpu_base_colour, 0);
    let last = f32(gpu_object.counts.z - 1u);
    let lod = clamp(log2(max(footprint * f32(max(size.x, size.y)), 1.0)), 0.0, last);
    let low = floor(lod);
    let a = gpu_bilinear(uv, i32(low));
    let b = gpu_bilinear(uv, i32(min(low + 1.0, last)));
    return mix(a, b, lod - low);
}

// Radiance towards the viewer.
fn gpu_radiance(s: GpuPoint) -> vec3<f32> {
    let away = gpu_camera.origin.xyz - s.p;
    let wo = select(normalize(away), -gpu_camera.forward.xyz, gpu_camera.origin.w > 0.0);
    let length_n = length(s.n);
    var n = s.plane.xyz;
    if length_n > 0.0 {
        n = s.n / length_n;
    }
    n = gpu_facing(s.side * n, wo);
    var l = shade(n, gpu_tangent(n, s.t), wo, s.p);
    if gpu_object.counts.z > 0u {
        let spacing = gpu_camera.film.w * gpu_camera.up.w * select(length(away), 1.0, gpu_camera.origin.w > 0.0);
        let slope = sqrt(max(abs(dot(s.plane.xyz, wo)), 0.05));
        l *= gpu_tint(s.uv, spacing * s.plane.w / slope);
    }
    return l;
}
