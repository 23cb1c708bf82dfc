// Counts, at each sample, the prisms behind light-blocking triangles that contain the visible point: of the
// pieces of their boundary at its depth or behind it, those that lead out less those that lead in (z-fail).
@group(0) @binding(0) var<uniform> gpu_volume: GpuVolume;
@group(0) @binding(1) var<storage, read> gpu_places: array<f32>;
// Corners of caps and their number; two corners of sides, 0, and their number.
@group(0) @binding(2) var<storage, read> gpu_pieces: array<vec4<i32>>;

struct GpuSide {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) @interpolate(flat) number: i32,
}

fn gpu_near(v: i32) -> vec4<f32> {
    return vec4<f32>(gpu_places[3 * v], gpu_places[3 * v + 1], gpu_places[3 * v + 2], 1.0);
}

// The corner moved away from the light as far as possible.
fn gpu_far(v: i32) -> vec4<f32> {
    let p = gpu_near(v);
    let l = gpu_volume.light;
    return vec4<f32>(select(-l.xyz, p.xyz - l.xyz, l.w > 0.0), 0.0) + gpu_camera.origin.w * gpu_volume.far.x * p;
}

@vertex
fn gpu_side_vertex(@builtin(vertex_index) i: u32) -> GpuSide {
    let caps = gpu_volume.counts.x;
    let sides = gpu_volume.counts.y;
    var at: vec4<f32>;
    var number: i32;
    if i < 3u * caps {
        let c = gpu_pieces[i / 3u];
        at = gpu_near(c[i % 3u]);
        number = c.w;
    } else if i < 3u * caps + 6u * sides {
        let k = i - 3u * caps;
        let c = gpu_pieces[caps + k / 6u];
        number = c.w;
        // q, p, p far away; q, p far away, q far away.
        switch k % 6u {
            case 0u, 3u: { at = gpu_near(c.y); }
            case 1u: { at = gpu_near(c.x); }
            case 2u, 4u: { at = gpu_far(c.x); }
            default: { at = gpu_far(c.y); }
        }
    } else {
        let k = i - 3u * caps - 6u * sides;
        let c = gpu_pieces[k / 3u];
        at = gpu_far(c[k % 3u]);
        number = -c.w;
    }
    return GpuSide(gpu_camera.view_projection * at, number);
}

@fragment
fn gpu_side_fragment(v: GpuSide, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    return vec4<f32>(f32(select(v.number, -v.number, front)), 0.0, 0.0, 0.0);
}
