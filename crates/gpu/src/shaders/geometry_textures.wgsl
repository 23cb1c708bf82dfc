// Vertices, indices and colours in textures of 2048 texels a row, for devices whose vertex shaders read no buffers.
@group(1) @binding(1) var gpu_vertices: texture_2d<f32>;
@group(1) @binding(2) var gpu_indices: texture_2d<u32>;
@group(1) @binding(3) var gpu_colours: texture_2d<f32>;

fn gpu_vertex_row(i: u32) -> vec4<f32> {
    return textureLoad(gpu_vertices, vec2<u32>(i % 2048u, i / 2048u), 0);
}

fn gpu_index(i: u32) -> u32 {
    return textureLoad(gpu_indices, vec2<u32>(i % 2048u, i / 2048u), 0).x;
}

fn gpu_colour_value(i: u32) -> f32 {
    return textureLoad(gpu_colours, vec2<u32>(i % 2048u, i / 2048u), 0).x;
}
