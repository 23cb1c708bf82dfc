// An object's triangles, pulled by vertex index: three vec4 a vertex hold p u, n v, t and the
// sign of the bitangent. gpu_vertex_row, gpu_index and gpu_colour_value read them from buffers or textures.
struct GpuObject {
    model: mat4x4<f32>,
    // Cofactors of the model's linear part, times the sign of its determinant.
    normals: mat3x3<f32>,
    // First id of its triangles, their number, filtering of normals (0 none, 1 isotropic, 2 covariance; 4 is
    // added with vertex colours), and 1 where the model mirrors.
    counts: vec4<u32>,
    // The object's textures, by the indices below.
    images: array<GpuImage, 7>,
}

// Levels of a texture (0: there is none), rows of the finest, and the wrap mode in u (two bits) and v: 0
// repeats, 1 mirrors, 2 clamps.
struct GpuImage {
    levels: u32,
    rows: u32,
    wrap: u32,
    unused: u32,
}

// Entries of `images`.
const GPU_TINT: u32 = 0u;
const GPU_MEAN_NORMALS: u32 = 1u;
const GPU_NORMAL_SPREAD: u32 = 2u;
const GPU_ALPHA2: u32 = 3u;
const GPU_ALBEDO: u32 = 4u;
const GPU_F0: u32 = 5u;
const GPU_EMISSION: u32 = 6u;

@group(1) @binding(0) var<uniform> gpu_object: GpuObject;
@group(1) @binding(4) var gpu_tint: texture_2d<f32>;
@group(1) @binding(5) var gpu_mean_normals: texture_2d<f32>;
@group(1) @binding(6) var gpu_normal_spread: texture_2d<f32>;
@group(1) @binding(7) var gpu_alpha2: texture_2d<f32>;
@group(1) @binding(8) var gpu_albedo: texture_2d<f32>;
@group(1) @binding(9) var gpu_f0: texture_2d<f32>;
@group(1) @binding(10) var gpu_emission: texture_2d<f32>;

fn gpu_position(v: u32) -> vec3<f32> {
    return (gpu_object.model * vec4<f32>(gpu_vertex_row(3u * v).xyz, 1.0)).xyz;
}

fn gpu_uv(v: u32) -> vec2<f32> {
    return vec2<f32>(gpu_vertex_row(3u * v).w, gpu_vertex_row(3u * v + 1u).w);
}

fn gpu_corners(triangle: u32) -> vec3<u32> {
    return vec3<u32>(gpu_index(3u * triangle), gpu_index(3u * triangle + 1u), gpu_index(3u * triangle + 2u));
}

// The site of a vertex: sites follow the indices.
fn gpu_site(v: u32) -> u32 {
    return gpu_index(3u * gpu_object.counts.y + v);
}

// A triangle's outward normal (unit), and its texture coordinates per metre.
fn gpu_plane(c: vec3<u32>) -> vec4<f32> {
    let a = gpu_position(c.x);
    var n = cross(gpu_position(c.y) - a, gpu_position(c.z) - a);
    if gpu_object.counts.w > 0u {
        n = -n;
    }
    let area = length(n);
    if !(area > 0.0) {
        return vec4<f32>(0.0);
    }
    let u = gpu_uv(c.x);
    let e = gpu_uv(c.y) - u;
    let f = gpu_uv(c.z) - u;
    return vec4<f32>(n / area, sqrt(abs(e.x * f.y - e.y * f.x) / area));
}
