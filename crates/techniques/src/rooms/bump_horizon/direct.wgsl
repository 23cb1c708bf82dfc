
fn local_f_cos(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return local_direct(x, wi, wo);
}
