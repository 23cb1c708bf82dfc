// Materials of the RGL database: the twin of rgl/mod.rs and rgl/warp.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // Azimuths and elevations of the view; 1 where the half vector's azimuth is relative to the view's; the circle over
    // the azimuths' span.
    views: vec4<f32>,
    // Columns and rows of sigma and of the distribution of normals.
    normals: vec4<f32>,
    // Columns and rows of the visible normals and of the colours.
    planes: vec4<f32>,
    // x: 1 where colours are to be multiplied by D/(4 sigma).
    jacobian: vec4<f32>,
}

// Slices around a view, and their weights.
struct BrdfBlend {
    slices: vec4<f32>,
    shares: vec4<f32>,
}

// The node below a place on an axis of n nodes, and the weight of the next one.
fn brdf_node(u: f32, n: f32) -> vec2<f32> {
    let t = clamp(u, 0.0, 1.0) * (n - 1.0);
    let i = min(floor(t), n - 2.0);
    return vec2<f32>(i, t - i);
}

// The node below a place among n ascending numbers from cell `begin` on, and the weight of the next one.
fn brdf_among(begin: u32, n: u32, x: f32) -> vec2<f32> {
    if n < 2u {
        return vec2<f32>(0.0);
    }
    var low = 0u;
    var high = n - 1u;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if brdf_cell(begin + middle).x <= x {
            low = middle;
        } else {
            high = middle;
        }
    }
    let a = brdf_cell(begin + low).x;
    let b = brdf_cell(begin + low + 1u).x;
    return vec2<f32>(f32(low), clamp((x - a) / (b - a), 0.0, 1.0));
}

fn brdf_blend(phi: f32, theta: f32) -> BrdfBlend {
    let n = brdf.views.xy;
    let p = brdf_among(0u, u32(n.x), phi);
    let t = brdf_among(u32(n.x), u32(n.y), theta);
    let rows = min(vec2<f32>(p.x, p.x + 1.0), vec2<f32>(n.x - 1.0)) * n.y;
    let columns = min(vec2<f32>(t.x, t.x + 1.0), vec2<f32>(n.y - 1.0));
    let slices = vec4<f32>(rows.x + columns, rows.y + columns);
    return BrdfBlend(slices, vec4<f32>((1.0 - p.y) * vec2<f32>(1.0 - t.y, t.y), p.y * vec2<f32>(1.0 - t.y, t.y)));
}

// A number of a single plane of size.x columns that begins at cell `begin`.
fn brdf_plane(begin: u32, size: vec2<f32>, u: vec2<f32>) -> f32 {
    let x = brdf_node(u.x, size.x);
    let y = brdf_node(u.y, size.y);
    let at = begin + u32(y.x) * u32(size.x) + u32(x.x);
    let below = at + u32(size.x);
    let first = mix(brdf_cell(at).x, brdf_cell(at + 1u).x, x.y);
    let second = mix(brdf_cell(below).x, brdf_cell(below + 1u).x, x.y);
    return mix(first, second, y.y);
}

// Density, its integral along the row up to a node, and over the rows: two cells, sums in two parts.
fn brdf_visible(begin: u32, blend: BrdfBlend, x: f32, y: f32) -> vec3<f32> {
    let size = vec2<u32>(brdf.planes.xy);
    var sum = vec3<f32>(0.0);
    for (var k = 0; k < 4; k++) {
        if blend.shares[k] > 0.0 {
            let at = begin + 2u * ((u32(blend.slices[k]) * size.y + u32(y)) * size.x + u32(x));
            sum += blend.shares[k] * (brdf_cell(at) + brdf_cell(at + 1u));
        }
    }
    return sum;
}

// Density::invert.
fn brdf_unwarped(begin: u32, blend: BrdfBlend, u: vec2<f32>) -> vec2<f32> {
    let size = brdf.planes.xy;
    let step = 1.0 / (size - 1.0);
    let x = brdf_node(u.x, size.x);
    let y = brdf_node(u.y, size.y);
    let first = brdf_visible(begin, blend, x.x, y.x);
    let left = mix(first, brdf_visible(begin, blend, x.x, y.x + 1.0), y.y);
    let right = mix(brdf_visible(begin, blend, x.x + 1.0, y.x), brdf_visible(begin, blend, x.x + 1.0, y.x + 1.0), y.y);
    let within = left.y + step.x * x.y * (left.x + 0.5 * x.y * (right.x - left.x));
    let r0 = brdf_visible(begin, blend, size.x - 1.0, y.x).y;
    let r1 = brdf_visible(begin, blend, size.x - 1.0, y.x + 1.0).y;
    let row = mix(r0, r1, y.y);
    let below = first.z + step.y * y.y * (r0 + 0.5 * y.y * (r1 - r0));
    return clamp(vec2<f32>(select(x.y, within / max(row, 1e-37), row > 0.0), below), vec2<f32>(0.0), vec2<f32>(1.0));
}

fn brdf_colours(begin: u32, blend: BrdfBlend, s: vec2<f32>) -> vec3<f32> {
    let size = vec2<u32>(brdf.planes.zw);
    let x = brdf_node(s.x, brdf.planes.z);
    let y = brdf_node(s.y, brdf.planes.w);
    var sum = vec3<f32>(0.0);
    for (var k = 0; k < 4; k++) {
        if blend.shares[k] > 0.0 {
            let at = begin + (u32(blend.slices[k]) * size.y + u32(y.x)) * size.x + u32(x.x);
            let below = at + size.x;
            let first = mix(brdf_cell(at), brdf_cell(at + 1u), x.y);
            let second = mix(brdf_cell(below), brdf_cell(below + 1u), x.y);
            sum += blend.shares[k] * mix(first, second, y.y);
        }
    }
    return sum;
}

// The signs that bring the view into the measured part of the circle.
fn brdf_fold(wo: vec3<f32>) -> vec3<f32> {
    let away = select(vec2<f32>(1.0), vec2<f32>(-1.0), wo.xy > vec2<f32>(0.0));
    if brdf.views.w == 2.0 {
        return vec3<f32>(away.yy, 1.0);
    }
    return vec3<f32>(select(vec2<f32>(1.0), away, brdf.views.w == 4.0), 1.0);
}

fn brdf_f_cos(light: vec3<f32>, view: vec3<f32>) -> vec3<f32> {
    if !brdf_above(light, view) {
        return vec3<f32>(0.0);
    }
    let fold = brdf_fold(view);
    let wi = fold * light;
    let wo = fold * view;
    let theta = brdf_polar_angle(wo);
    let phi = brdf_atan2(wo.y, wo.x);
    let blend = brdf_blend(phi, theta);
    // Near the mirror direction sums of directions are exact in singles.
    let h = wi + wo;
    let turn = (brdf_atan2(h.y, h.x) - select(0.0, phi, brdf.views.z == 1.0)) / (2.0 * BRDF_PI) + 0.5;
    let u = vec2<f32>(sqrt(brdf_polar_angle(h) / (0.5 * BRDF_PI)), turn - floor(turn));
    // The cells: azimuths, elevations, sigma, normals, visible normals, colours.
    let sigma_at = u32(brdf.views.x) + u32(brdf.views.y);
    let normals_at = sigma_at + u32(brdf.normals.x) * u32(brdf.normals.y);
    let visible_at = normals_at + u32(brdf.normals.z) * u32(brdf.normals.w);
    let slices = u32(brdf.views.x) * u32(brdf.views.y);
    let colours_at = visible_at + 2u * slices * u32(brdf.planes.x) * u32(brdf.planes.y);
    var factor = 1.0;
    if brdf.jacobian.x == 1.0 {
        let place = vec2<f32>(sqrt(theta / (0.5 * BRDF_PI)), phi / (2.0 * BRDF_PI) + 0.5);
        let sigma = brdf_plane(sigma_at, brdf.normals.xy, place);
        if sigma <= 0.0 {
            return vec3<f32>(0.0);
        }
        factor = brdf_plane(normals_at, brdf.normals.zw, u) / (4.0 * sigma);
    }
    return factor * brdf_colours(colours_at, blend, brdf_unwarped(visible_at, blend, u));
}
