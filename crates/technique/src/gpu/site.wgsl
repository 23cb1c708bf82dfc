// A point's place among the sites of a bake: three sites, weights of sum 1, and texture coordinates. Then the
// orientation of the texture on the surface: the surface's own normal on the viewer's side, the tangent and
// the side of the bitangent (side n x t), and the side of the square over which textures are averaged.
struct Site {
    index: vec3<u32>,
    weight: vec3<f32>,
    uv: vec2<f32>,
    n: vec3<f32>,
    t: vec4<f32>,
    footprint: f32,
}

