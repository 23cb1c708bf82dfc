fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let cos_o = dot(n, wo);
    if !(cos_o > 0.0) {
        return vec3<f32>(0.0);
    }
    let c = room.turn * central(n, t, 2.0 * cos_o * n - wo);
    let b = sum(c, room.turn * wo);
    let a = fetch_scale((angle(min(cos_o, 1.0)) - room.range.x) * room.range.y).rgb;
    return a * b + diffuse(room.turn * n);
}
