// Nothing is blocked.
alias Blocked = f32;

fn visible(b: Blocked, n: vec3<f32>, zonal: vec4<f32>, d: vec3<f32>) -> f32 {
    return 1.0;
}
