
// Disks shaded with the exact reflectance. gpu_node(i) has the nodes and weights of Gauss and Legendre on 0
// ... 1; the rule of n = 1, 2, 4, 8, 16, 32 starts at n - 1.

// Number of rings of the rule for a disk whose radius is `ratio` times the reflectance's width; 0 stands for
// the disk's centre alone. Where the CPU would subdivide adaptively, the largest rule is used.
fn gpu_rings(ratio: f32, crossed: bool) -> u32 {
    if ratio < 0.03 && !crossed {
        return 0u;
    }
    var n = 16u;
    if ratio < 0.5 {
        n = 1u;
    } else if ratio < 1.3 {
        n = 2u;
    } else if ratio < 3.0 {
        n = 4u;
    } else if ratio < 7.0 {
        n = 8u;
    }
    return select(n, max(2u * n, 8u), crossed);
}

// Integrates by rings about the centre, or by the centre alone as a ring of no size: one loop for both, since
// compilers insert the text of a reflectance at every call.
fn gpu_polar(c: vec3<f32>, radius: f32, n: u32, wo: vec3<f32>) -> vec3<f32> {
    let s = sin(0.5 * radius);
    let top = 2.0 * s * s;
    let omega = 2.0 * BRDF_PI * top;
    // Duff et al. 2017, Building an Orthonormal Basis, Revisited.
    let z = select(-1.0, 1.0, c.z >= 0.0);
    let k = -1.0 / (z + c.z);
    let a = vec3<f32>(1.0 + z * c.x * c.x * k, z * c.x * c.y * k, -z * c.x);
    let b = vec3<f32>(c.x * c.y * k, z + c.y * c.y * k, -c.y);
    let rings = max(n, 1u);
    let around = max(4u * n, 1u);
    var sum = vec3<f32>(0.0);
    for (var q = 0u; q < rings * around; q++) {
        let i = q / around;
        let node = select(vec2<f32>(0.0, 1.0), gpu_node(rings - 1u + i), n > 0u);
        let versine = node.x * top;
        let r = sqrt(versine * (2.0 - versine));
        let phi = 2.0 * BRDF_PI * (f32(q % around) + 0.5 * f32(i % 2u)) / f32(around);
        sum += node.y * brdf_value(a * (r * cos(phi)) + b * (r * sin(phi)) + c * (1.0 - versine), wo);
    }
    return sum * (omega / f32(around));
}

// Strips of equal elevation above the horizon.
fn gpu_strips(c: vec3<f32>, radius: f32, n: u32, wo: vec3<f32>) -> vec3<f32> {
    let centre = brdf_asin(c.z);
    let azimuth = brdf_atan2(c.y, c.x);
    let x = clamp(-centre / radius, -1.0, 1.0);
    let end = brdf_atan2(sqrt((1.0 - x) * (1.0 + x)), x);
    let s = sin(0.5 * radius);
    var sum = vec3<f32>(0.0);
    for (var q = 0u; q < n * n; q++) {
        let node = gpu_node(n - 1u + q / n);
        let u = node.x * end;
        let e = centre + radius * cos(u);
        let d = sin(0.5 * radius * cos(u));
        let sine = min(sqrt(max(s * s - d * d, 0.0) / max(cos(e) * cos(centre), 1e-12)), 1.0);
        let width = 4.0 * brdf_asin(sine);
        let inner = gpu_node(n - 1u + q % n);
        let phi = azimuth + width * (inner.x - 0.5);
        let f = brdf_value(vec3<f32>(cos(e) * cos(phi), cos(e) * sin(phi), sin(e)), wo);
        sum += (node.y * inner.y * end * radius * sin(u) * cos(e) * width) * f;
    }
    return sum;
}

// Does a disk that crosses the horizon have a rule of its own?
fn gpu_takes_strips() -> bool {
    return true;
}

// The integral of f_cos over a disk.
fn gpu_disk(c: vec3<f32>, radius: f32, wo: vec3<f32>) -> vec3<f32> {
    let reach = sin(radius);
    if !brdf_is_whole() && radius < 1.5 && c.z <= -reach {
        return vec3<f32>(0.0);
    }
    let crossed = !brdf_is_whole() && (radius >= 1.5 || c.z < reach);
    let scale = brdf_scale(c, wo, radius);
    if gpu_at_horizon(c, radius, scale, wo) {
        return gpu_horizon_disk(c, radius, wo);
    }
    let n = gpu_rings(radius / scale, crossed);
    if crossed && gpu_takes_strips() {
        return gpu_strips(c, radius, n, wo);
    }
    return gpu_polar(c, radius, n, wo);
}

