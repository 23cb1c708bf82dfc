
// Shadows of the lights by the technique's library: the twin of steradian_technique::direct::Place.
fn gpu_arriving(p: vec3<f32>, n: vec3<f32>, d: vec3<f32>, distance: f32) -> f32 {
    return light_arriving(p, n, d, distance);
}

// The integral over a disk, times the share of its reflected light that is not blocked, measured by 8 or 64
// rays.
fn gpu_seen_disk(disk: vec4<f32>, frame: mat3x3<f32>, o: vec3<f32>, n: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let whole = gpu_disk(frame * disk.xyz, disk.w, o);
    if all(whole == vec3<f32>(0.0)) {
        return whole;
    }
    let c = disk.xyz;
    // Duff et al. 2017, Building an Orthonormal Basis, Revisited.
    let sign = select(1.0, -1.0, c.z < 0.0);
    let k = -1.0 / (sign + c.z);
    let a = vec3<f32>(1.0 + sign * c.x * c.x * k, sign * c.x * c.y * k, -sign * c.x);
    let b = vec3<f32>(c.x * c.y * k, sign + c.y * c.y * k, -c.y);
    let top = 2.0 * sin(0.5 * disk.w) * sin(0.5 * disk.w);
    var share = 1.0;
    for (var rays = 8; rays <= 64; rays *= 8) {
        var every = 0.0;
        var open = 0.0;
        var blocked = false;
        for (var i = 1; i <= rays; i++) {
            // The R2 sequence (Roberts 2018).
            let at = fract(0.5 + vec2<f32>(0.75487767, 0.56984029) * f32(i));
            let versine = at.x * top;
            let r = sqrt(max(versine * (2.0 - versine), 0.0));
            let phi = 6.2831853 * at.y;
            let d = normalize(a * (r * cos(phi)) + b * (r * sin(phi)) + c * (1.0 - versine));
            let f = brdf_value(frame * d, o);
            let value = abs(f.x + f.y + f.z);
            let part = light_arriving(p, n, d, 3e38);
            every += value;
            open += part * value;
            blocked = blocked || part < 1.0;
        }
        if !blocked {
            return whole;
        }
        share = select(0.0, open / every, every > 0.0);
        if open == 0.0 {
            break;
        }
    }
    return whole * share;
}
