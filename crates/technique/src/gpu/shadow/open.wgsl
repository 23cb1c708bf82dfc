// The part of a light in direction d, so far away, that reaches a point of normal n: nothing blocks.
fn light_arriving(p: vec3<f32>, n: vec3<f32>, d: vec3<f32>, distance: f32) -> f32 {
    return 1.0;
}
