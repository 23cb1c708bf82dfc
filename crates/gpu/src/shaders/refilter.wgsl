// Common parts of all passes of the refilter: one job's numbers, the buffers, cubes and kernels. Every output
// is a function of its index alone, so that tiles in any number and order give the same bits as one pass.
struct Job {
    // First output, one past the last, intervals of the cube written, intervals of the cube read.
    span: vec4<u32>,
    // Offset written, offset read, stride between the samples read, a count.
    at: vec4<u32>,
    // Offsets in `tables`, a count, and bands.
    tables: vec4<u32>,
    // Place in the chain: x, y, texels a row, rows a face.
    place: vec4<u32>,
    // Numbers of the pass.
    a: vec4<f32>,
    // Kernel: shape (0 GGX, 1 power), parameter, factor, gain.
    kernel: vec4<f32>,
}
@group(0) @binding(0) var<uniform> job: Job;
// The light: texels of a lat-long image or of six faces.
@group(0) @binding(1) var<storage, read> light: array<vec4<f32>>;
// Intermediate cubes and maps.
@group(0) @binding(2) var<storage, read_write> maps: array<vec4<f32>>;
// The chain as the technique's atlas has it: rows of `place.z`, faces of `place.w` rows.
@group(0) @binding(3) var<storage, read_write> chain: array<vec4<f32>>;
// Numbers that the plan fixes.
@group(0) @binding(4) var<storage, read> tables: array<vec4<f32>>;
// Partial sums and coefficients.
@group(0) @binding(5) var<storage, read_write> harmonics: array<vec4<f32>>;
// Data of the light. 0: points, extra samples, 1 where nothing is negative, their coefficients' bands. 1: 0
// lat-long or 1 faces, width, height, angle of a texel. Then a point's direction and its flux; a sample's
// place (bits) and its radiance; coefficients.
@group(0) @binding(6) var<storage, read> extras: array<vec4<f32>>;

const QUARTER_PI: f32 = 0.78539816339744831;

// Face coordinates s, t and the distance m along the face's axis, Khronos orientation.
fn to_face(face: u32, d: vec3<f32>) -> vec3<f32> {
    switch face {
        case 0u: { return vec3<f32>(-d.z, -d.y, d.x); }
        case 1u: { return vec3<f32>(d.z, -d.y, -d.x); }
        case 2u: { return vec3<f32>(d.x, d.z, d.y); }
        case 3u: { return vec3<f32>(d.x, -d.z, -d.y); }
        case 4u: { return vec3<f32>(d.x, -d.y, d.z); }
        default: { return vec3<f32>(-d.x, -d.y, -d.z); }
    }
}

fn from_face(face: u32, p: vec3<f32>) -> vec3<f32> {
    switch face {
        case 0u: { return vec3<f32>(p.z, -p.y, -p.x); }
        case 1u: { return vec3<f32>(-p.z, -p.y, p.x); }
        case 2u: { return vec3<f32>(p.x, p.z, p.y); }
        case 3u: { return vec3<f32>(p.x, -p.z, -p.y); }
        case 4u: { return vec3<f32>(p.x, -p.y, p.z); }
        default: { return vec3<f32>(-p.x, -p.y, -p.z); }
    }
}

fn face_of(d: vec3<f32>) -> u32 {
    let a = abs(d);
    if a.x >= a.y && a.x >= a.z {
        return select(0u, 1u, d.x < 0.0);
    }
    if a.y >= a.z {
        return select(2u, 3u, d.y < 0.0);
    }
    return select(4u, 5u, d.z < 0.0);
}

// Intermediate cubes are equiangular: steps of equal angle along the middle of a face, cells of nearly equal
// size. Edges are exactly 1, so that neighbours share bits.
fn warp(a: f32) -> f32 {
    return select(tan(QUARTER_PI * a), a, abs(a) == 1.0);
}

fn warp2(a: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(warp(a.x), warp(a.y));
}

// Lattice position of sample k of a cube of n intervals, a face after the other: face, i, j.
fn lattice(k: u32, n: u32) -> vec3<u32> {
    let row = n + 1u;
    let face = k / (row * row);
    let r = k - face * row * row;
    let j = r / row;
    return vec3<u32>(face, r - j * row, j);
}

// Face coordinates -1 ... 1 of lattice steps.
fn along(i: vec2<u32>, n: u32) -> vec2<f32> {
    return vec2<f32>(vec2<i32>(2u * i) - vec2<i32>(i32(n))) / f32(n);
}

// The direction of lattice sample k of the equiangular cube.
fn even_direction(at: vec3<u32>, n: u32) -> vec3<f32> {
    return normalize(from_face(at.x, vec3<f32>(warp2(along(at.yz, n)), 1.0)));
}

// The direction of lattice sample k of the ordinary cube, as techniques look it up.
fn chain_direction(at: vec3<u32>, n: u32) -> vec3<f32> {
    return normalize(from_face(at.x, vec3<f32>(along(at.yz, n), 1.0)));
}

// Where a sample of the cube at `place` lies in the chain.
fn chain_index(at: vec3<u32>) -> u32 {
    return (at.x * job.place.w + job.place.y + at.z) * job.place.z + job.place.x + at.y;
}

// The kernel at half the squared chord q = 1 - cos: Gaussians (GKD07), STAR04 eq. 25 and Karis 2013, as
// `steradian_prefilter` has them.
fn kernel_at(q: f32) -> f32 {
    if job.kernel.x > 1.5 {
        return job.kernel.z * exp(-job.kernel.y * q);
    }
    let x = 1.0 - q;
    if x <= 0.0 {
        return 0.0;
    }
    if job.kernel.x > 0.5 {
        return job.kernel.z * pow(x, job.kernel.y);
    }
    let a2 = job.kernel.y * job.kernel.y;
    let s2 = 0.5 * q;
    let d = s2 + a2 * (1.0 - s2);
    return job.kernel.z * a2 / (d * d) * x;
}

// Radiance of suns and directional lights, each of them as points: exact, whichever method filters the image.
fn points_at(d: vec3<f32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    let count = u32(extras[0].x);
    for (var k = 0u; k < count; k++) {
        let e = extras[2u + 2u * k].xyz - d;
        sum += kernel_at(0.5 * dot(e, e)) * extras[3u + 2u * k].xyz;
    }
    return sum;
}

// Writes a sample of the chain: the image, clamped to 0 unless it has negative light, plus the points, times
// the gain.
fn put_chain(at: vec3<u32>, d: vec3<f32>, image: vec3<f32>) {
    let floored = select(image, max(image, vec3<f32>(0.0)), extras[0].z > 0.5);
    chain[chain_index(at)] = vec4<f32>(job.kernel.w * (floored + points_at(d)), 1.0);
}
