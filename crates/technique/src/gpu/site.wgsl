// Where a point lies among the sites of a bake: three sites, their weights, which sum to 1, and texture coordinates. How
// these lie on the surface: its own normal on the viewer's side, tangent and side of the bitangent (side n x t), and the
// square that the point stands for.
struct Site {
    index: vec3<u32>,
    weight: vec3<f32>,
    uv: vec2<f32>,
    n: vec3<f32>,
    t: vec4<f32>,
    footprint: f32,
}

