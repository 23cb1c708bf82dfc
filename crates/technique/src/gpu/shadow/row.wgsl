// Row `row` of the occluders' buffer: four numbers.
fn shadow_row(row: u32) -> vec4<f32> {
    return vec4<f32>(
        fetch_light_shadows(row, 0u),
        fetch_light_shadows(row, 1u),
        fetch_light_shadows(row, 2u),
        fetch_light_shadows(row, 3u),
    );
}
