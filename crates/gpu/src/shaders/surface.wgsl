// From an interpolated surface to radiance: the twin of the CPU renderer's shading of a hit.
struct GpuPoint {
    p: vec3<f32>,
    n: vec3<f32>,
    // Tangent, and the sign of the bitangent.
    t: vec4<f32>,
    uv: vec2<f32>,
    // Geometric normal; w: texture coordinates per metre. The raster path leaves it 0 where nothing
    // needs it.
    plane: vec4<f32>,
    // 1 where the viewer sees the outside, else -1.
    side: f32,
    // Corners of the triangle and their weights, for techniques that read sites.
    corners: vec3<u32>,
    weights: vec3<f32>,
    // Vertex colour; w: change of the normal per metre. Read by shaders with maps.
    extra: vec4<f32>,
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

struct GpuColumns {
    first: i32,
    second: i32,
    weight: f32,
}

// The two texels of n about coordinate u; `wrap` is 0 to repeat, 1 to mirror, 2 to clamp.
fn gpu_columns(u: f32, n: i32, wrap: u32) -> GpuColumns {
    if wrap == 1u {
        let x = (u - 2.0 * floor(0.5 * u)) * f32(n) - 0.5;
        let i = i32(floor(x));
        let a = select(select(i, i - 2 * n, i >= 2 * n), i + 2 * n, i < 0);
        let b = select(i + 1, i + 1 - 2 * n, i + 1 >= 2 * n);
        return GpuColumns(min(a, 2 * n - 1 - a), min(b, 2 * n - 1 - b), x - floor(x));
    }
    let x = select(fract(u), clamp(u, 0.0, 1.0), wrap == 2u) * f32(n) - 0.5;
    let i = i32(floor(x));
    if wrap == 2u {
        return GpuColumns(clamp(i, 0, n - 1), clamp(i + 1, 0, n - 1), x - floor(x));
    }
    return GpuColumns(select(i, i + n, i < 0), select(i + 1, i + 1 - n, i + 1 >= n), x - floor(x));
}

// Levels lie one below the other; `rows` are those of the finest.
fn gpu_bilinear(image: texture_2d<f32>, uv: vec2<f32>, level: u32, rows: u32, wrap: u32) -> vec3<f32> {
    var above = 0u;
    for (var k = 0u; k < level; k++) {
        above += max(rows >> k, 1u);
    }
    let size = max(vec2<u32>(textureDimensions(image).x, rows) >> vec2<u32>(level), vec2<u32>(1u));
    let x = gpu_columns(uv.x, i32(size.x), wrap & 3u);
    let y = gpu_columns(uv.y, i32(size.y), (wrap >> 2u) & 3u);
    let first = y.first + i32(above);
    let second = y.second + i32(above);
    let a = textureLoad(image, vec2<i32>(x.first, first), 0).rgb;
    let b = textureLoad(image, vec2<i32>(x.second, first), 0).rgb;
    let c = textureLoad(image, vec2<i32>(x.first, second), 0).rgb;
    let d = textureLoad(image, vec2<i32>(x.second, second), 0).rgb;
    return mix(mix(a, b, x.weight), mix(c, d, x.weight), y.weight);
}

// An image averaged over a square of side `footprint` in texture coordinates.
fn gpu_sample(image: texture_2d<f32>, uv: vec2<f32>, footprint: f32, part: GpuImage) -> vec3<f32> {
    let last = f32(part.levels - 1u);
    let size = max(textureDimensions(image).x, part.rows);
    let lod = clamp(log2(max(footprint * f32(size), 1.0)), 0.0, last);
    let low = floor(lod);
    let a = gpu_bilinear(image, uv, u32(low), part.rows, part.wrap);
    let b = gpu_bilinear(image, uv, u32(min(low + 1.0, last)), part.rows, part.wrap);
    return mix(a, b, lod - low);
}

// The unit normal as interpolated, or that of the triangle.
fn gpu_outward(s: GpuPoint) -> vec3<f32> {
    let length_n = length(s.n);
    if length_n > 0.0 {
        return s.n / length_n;
    }
    return s.plane.xyz;
}

// Radiance towards the viewer.
fn gpu_radiance(s: GpuPoint) -> vec3<f32> {
    let away = gpu_camera.origin.xyz - s.p;
    let wo = select(normalize(away), -gpu_camera.forward.xyz, gpu_camera.origin.w > 0.0);
    let outward = gpu_outward(s);
    // Side, in metres, of the square on the surface that this point covers.
    let spacing = gpu_camera.film.w * gpu_camera.up.w * select(length(away), 1.0, gpu_camera.origin.w > 0.0);
    let footprint = spacing / sqrt(max(abs(dot(s.plane.xyz, wo)), 0.05));
    let look = gpu_look(s, outward, wo, footprint);
    let side = footprint * s.plane.w;
    var l = gpu_reflected(look, wo, s, side) * s.extra.rgb;
    if gpu_object.images[GPU_TINT].levels > 0u {
        l *= gpu_sample(gpu_tint, s.uv, side, gpu_object.images[GPU_TINT]);
    }
    if gpu_object.images[GPU_EMISSION].levels > 0u {
        l += gpu_sample(gpu_emission, s.uv, side, gpu_object.images[GPU_EMISSION]);
    }
    return l;
}
