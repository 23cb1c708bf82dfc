// Numbers of a measured reflectance, 2048 a row.
@group(2) @binding(3) var brdf_cells: texture_2d<f32>;

fn brdf_cell(i: u32) -> vec3<f32> {
    return textureLoad(brdf_cells, vec2<u32>(i % 2048u, i / 2048u), 0).rgb;
}
