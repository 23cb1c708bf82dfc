// Shades a planar buffer of points.
@group(1) @binding(0) var<storage, read> points: array<f32>;
@group(1) @binding(1) var<storage, read_write> radiance: array<f32>;

fn point_vector(k: u32, i: u32, count: u32) -> vec3<f32> {
    return vec3<f32>(points[k * count + i], points[(k + 1u) * count + i], points[(k + 2u) * count + i]);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let count = arrayLength(&radiance) / 3u;
    let i = id.x;
    if i >= count {
        return;
    }
    let l = point_radiance(i, count);
    radiance[i] = l.x;
    radiance[count + i] = l.y;
    radiance[2u * count + i] = l.z;
}
