// Vertices, indices and colours in storage buffers.
@group(1) @binding(1) var<storage, read> gpu_vertices: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read> gpu_indices: array<u32>;
@group(1) @binding(3) var<storage, read> gpu_colours: array<f32>;

fn gpu_vertex_row(i: u32) -> vec4<f32> {
    return gpu_vertices[i];
}

fn gpu_index(i: u32) -> u32 {
    return gpu_indices[i];
}

fn gpu_colour_value(i: u32) -> f32 {
    return gpu_colours[i];
}
