// The central direction.
fn central(n: vec3<f32>, t: vec3<f32>, r: vec3<f32>) -> vec3<f32> {
    if technique.orders.z == 1.0 {
        return r;
    }
    if technique.orders.z == 2.0 {
        return n;
    }
    return tangent(n, t);
}

