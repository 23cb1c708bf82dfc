// Measurements on a grid of four coordinates: the twin of grid.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
    // x: 0 half and difference angles, 1 differences of azimuths, 2 both directions; y: the last polar angle, radians.
    coordinates: vec4<f32>,
    // Cells along each coordinate.
    sizes: vec4<f32>,
}

// Places among the cells.
fn brdf_place(wi: vec3<f32>, wo: vec3<f32>) -> vec4<f32> {
    let quarter = 0.5 * BRDF_PI;
    let n = brdf.sizes;
    if brdf.coordinates.x == 0.0 {
        let h = brdf_halved(wi, wo);
        var phi_d = brdf_atan2(h.light.y, h.light.x);
        phi_d += select(0.0, BRDF_PI, phi_d < 0.0);
        let phi_h = brdf_atan2(h.turn.y, h.turn.x);
        let theta = vec2<f32>(brdf_theta_h(h), brdf_theta_d(h)) / quarter;
        return n * vec4<f32>(sqrt(theta.x), phi_h / (2.0 * BRDF_PI), theta.y, phi_d / BRDF_PI) - 0.5;
    }
    let theta = vec2<f32>(brdf_polar_angle(wi), brdf_polar_angle(wo)) / brdf.coordinates.y;
    let phi = vec2<f32>(brdf_atan2(wi.y, wi.x), brdf_atan2(wo.y, wo.x)) / (2.0 * BRDF_PI);
    if brdf.coordinates.x == 1.0 {
        return n * vec4<f32>(theta, phi.y - phi.x, phi.x) - 0.5;
    }
    return vec4<f32>(theta.x * (n.x - 1.0), phi.x * n.y, theta.y * (n.z - 1.0), phi.y * n.w);
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let kind = brdf.coordinates.x;
    let periodic = vec4<bool>(false, kind != 1.0, kind == 1.0, true);
    let last = max(brdf.sizes - 2.0, vec4<f32>(0.0));
    let all = brdf_place(wi, wo);
    let place = select(clamp(all, vec4<f32>(0.0), brdf.sizes - 1.0), all, periodic);
    let floored = floor(place);
    let low = select(min(floored, last), floored, periodic);
    let t = select(place - low, vec4<f32>(0.0), brdf.sizes == vec4<f32>(1.0));
    let n = vec4<i32>(brdf.sizes);
    let first = (vec4<i32>(low) % n + n) % n;
    let second = (first + 1) % n;
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < 16u; k++) {
        let upper = (vec4<u32>(k) & vec4<u32>(8u, 4u, 2u, 1u)) != vec4<u32>(0u);
        let w = select(1.0 - t, t, upper);
        let weight = w.x * w.y * w.z * w.w;
        if weight > 0.0 {
            // As floats: GLSL ES 3.00 cannot select integers.
            let at = vec4<i32>(select(vec4<f32>(first), vec4<f32>(second), upper));
            sum += weight * brdf_cell(u32(((at.x * n.y + at.y) * n.z + at.z) * n.w + at.w));
        }
    }
    return sum;
}
