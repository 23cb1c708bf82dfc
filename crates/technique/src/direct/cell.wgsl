
// Number of nodes along a side of a texel whose half is `ratio` times the reflectance's width. Where the CPU
// would subdivide adaptively, the largest rule is used.
fn gpu_across(ratio: f32) -> u32 {
    if ratio < 0.03 {
        return 1u;
    }
    var n = 32u;
    if ratio < 0.5 {
        n = 2u;
    } else if ratio < 1.3 {
        n = 4u;
    } else if ratio < 3.0 {
        n = 8u;
    } else if ratio < 7.0 {
        n = 16u;
    }
    return n;
}

// The integral of f_cos over the texel between the angles `theta` from `pole`, `half` radians to both sides
// of `meridian`.
fn gpu_cell(pole: vec3<f32>, meridian: vec3<f32>, theta: vec2<f32>, half: f32, wo: vec3<f32>) -> vec3<f32> {
    let middle = 0.5 * (theta.x + theta.y);
    let height = 0.5 * (theta.y - theta.x);
    let width = min(half, 0.5 * BRDF_PI) * (sin(middle) + height * abs(cos(middle)));
    let radius = sqrt(height * height + width * width);
    let c = pole * cos(middle) + meridian * sin(middle);
    let whole = brdf_is_whole();
    if !whole && c.z <= -radius {
        return vec3<f32>(0.0);
    }
    let scale = brdf_scale(c, wo, radius);
    if gpu_at_horizon(c, radius, scale, wo) {
        return gpu_horizon_cell(pole, meridian, theta, half, wo);
    }
    let least = select(1u, 8u, !whole && c.z < radius);
    let n = max(gpu_across(height / scale), least);
    let m = max(gpu_across(width / scale), least);
    let side = cross(pole, meridian);
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < m; i++) {
        let node = gpu_node(m - 1u + i);
        let phi = half * (2.0 * node.x - 1.0);
        let equator = meridian * cos(phi) + side * sin(phi);
        var low = theta.x;
        var high = theta.y;
        if !whole {
            var top = brdf_atan2(equator.z, pole.z);
            top += select(0.0, 2.0 * BRDF_PI, top < -0.5 * BRDF_PI);
            low = max(low, top - 0.5 * BRDF_PI);
            high = min(high, top + 0.5 * BRDF_PI);
        }
        if high > low {
            var line = vec3<f32>(0.0);
            for (var j = 0u; j < n; j++) {
                let inner = gpu_node(n - 1u + j);
                let t = low + (high - low) * inner.x;
                line += (inner.y * sin(t)) * brdf_value(pole * cos(t) + equator * sin(t), wo);
            }
            sum += (node.y * (high - low)) * line;
        }
    }
    return sum * (2.0 * half);
}
