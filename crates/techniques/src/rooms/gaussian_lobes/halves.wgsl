// The sum over half vectors of the lookup about the view's mirror image times its visibility. Rows of the
// tables lie closer together towards grazing views and go once around; counts = (rows, 1/89 degrees, columns,
// texels of a place in `used`).
fn lobes(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, blocked: Blocked) -> vec3<f32> {
    let b = cross(n, t);
    let cosine = min(dot(n, wo), 1.0);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let w = vec2<f32>(dot(wo, t), dot(wo, b));
    let turn = select(0.0, atan2(w.y, w.x) * 0.15915494, length(w) > 1e-6);
    let theta = clamp(atan2(sine, cosine) * technique.counts.y, 0.0, 1.0);
    let at = vec2<f32>(turn - floor(turn), 1.0 - sqrt(1.0 - theta));
    let size = vec2<f32>(technique.counts.z, technique.counts.x) - 1.0;
    let cell = vec2<u32>(min(floor(at * size), size - 1.0));
    let quads = u32(technique.counts.w);
    let first = (cell.y * u32(technique.counts.z) + cell.x) * quads;
    var sum = vec3<f32>(0.0);
    for (var quad = 0u; quad < quads; quad++) {
        let four = fetch_used(first + quad);
        for (var k = 0u; k < 4u; k++) {
            if four[k] < 0.0 {
                return sum;
            }
            let i = u32(four[k]);
            let weight = fetch_weights_layer(at, i).rgb;
            let local = fetch_half_vectors(i);
            let h = local.x * t + local.y * b + local.z * n;
            let d = 2.0 * dot(wo, h) * h - wo;
            sum += visible(blocked, n, zonal_at(i), d) * weight * fetch_chain(technique.turn * d, local.w);
        }
    }
    return sum;
}

fn lobes_of(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, d: f32, b: Blocked) -> vec3<f32> {
    return lobes(n, tangent(n, t), wo, b);
}
