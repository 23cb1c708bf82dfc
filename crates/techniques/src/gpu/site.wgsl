// Where a point lies among the sites of a bake: three sites, their weights, which sum to 1, and texture coordinates.
struct Site {
    index: vec3<u32>,
    weight: vec3<f32>,
    uv: vec2<f32>,
}

