// A per channel and b of lobe i at x = sqrt(1 - sqrt(n.wo)); counts = (lobes, maps of a lobe, views, all
// views - 1).
fn view(i: f32, x: f32) -> vec4<f32> {
    return fetch_views((i * technique.counts.z + x * (technique.counts.z - 1.0)) / technique.counts.w);
}

// o = a n + b r of length 1.
fn lobe_axis(n: vec3<f32>, r: vec3<f32>, cos_o: f32, b: f32) -> vec3<f32> {
    let sine2 = 1.0 - cos_o * cos_o;
    let a = sqrt(max(1.0 - b * b * sine2, 0.0)) - b * cos_o;
    return a * n + b * r;
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let d = dot(n, wo);
    if !(d > 0.0) {
        return vec3<f32>(0.0);
    }
    let r = 2.0 * d * n - wo;
    let cos_o = min(d, 1.0);
    let x = sqrt(max(1.0 - sqrt(cos_o), 0.0));
    var sum = vec3<f32>(0.0);
    for (var i = 0.0; i < technique.counts.x; i += 1.0) {
        let v = view(i, x);
        let o = technique.turn * lobe_axis(n, r, cos_o, v.w);
        sum += v.rgb * fetch_maps(o, i * technique.counts.y + x * (technique.counts.y - 1.0));
    }
    return sum;
}
