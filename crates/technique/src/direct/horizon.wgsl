
// Suns at the horizon, seen at grazing angles: `horizon.rs` says how.

// Does this rule integrate a light of `radius` about `c`, where the lobe is `scale` wide?
fn gpu_at_horizon(c: vec3<f32>, radius: f32, scale: f32, wo: vec3<f32>) -> bool {
    let near = brdf.peak.x == 1.0 && !brdf_is_whole() && wo.z < 0.1 && c.z < 0.5;
    return near && (c.z < radius || radius > 0.6 * scale);
}

fn gpu_wrap(x: f32) -> f32 {
    return x - 2.0 * BRDF_PI * round(x / (2.0 * BRDF_PI));
}

// The integral of f over azimuths from `ends.x` to `ends.y`, relative to that of the mirror direction, at elevation e.
fn gpu_wedge(e: f32, ends: vec2<f32>, wo: vec3<f32>) -> vec3<f32> {
    let up = sin(e);
    let level = cos(e);
    let off = up - wo.z;
    let w = sqrt(brdf.peak.y * brdf.peak.z + off * off) * max(0.5 * (up + wo.z), 1e-5);
    let start = brdf_atan2(ends.x, w);
    let span = brdf_atan2(ends.y, w) - start;
    let n = select(16u, 32u, brdf.peak.z > 2.0 * brdf.peak.y);
    let azimuth = brdf_atan2(-wo.y, -wo.x);
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < n; i++) {
        let node = gpu_node(n - 1u + i);
        let t = start + span * node.x;
        // Near the pole of the tangent the slope is clamped.
        let slope = clamp(sin(t) / max(cos(t), 1e-7), ends.x / w, ends.y / w);
        let phi = azimuth + w * slope;
        sum += (node.y * (1.0 + slope * slope)) * brdf_value(vec3<f32>(level * cos(phi), level * sin(phi), up), wo);
    }
    return sum * (span * w);
}

// The largest elevation at which a panel that begins at elevation e may end.
fn gpu_panel(e: f32, wo: vec3<f32>) -> f32 {
    let above = sin(e) - wo.z;
    return min(max(4.0 * e, max(wo.z, 1e-5)), e + max(max(-0.5 * above, above), max(4.0 * brdf.peak.y, 1e-6)));
}

// Elevation and weight of node i of 16 of a panel.
fn gpu_rung(a: f32, b: f32, i: u32) -> vec2<f32> {
    let node = gpu_node(15u + i);
    let e = a + 0.5 * (b - a) * (1.0 - cos(BRDF_PI * node.x));
    return vec2<f32>(e, node.y * 0.5 * BRDF_PI * (b - a) * sin(BRDF_PI * node.x) * cos(e));
}

// A disk.
fn gpu_horizon_disk(c: vec3<f32>, radius: f32, wo: vec3<f32>) -> vec3<f32> {
    let middle = brdf_asin(c.z);
    let off = gpu_wrap(brdf_atan2(c.y, c.x) - brdf_atan2(-wo.y, -wo.x));
    let s = sin(0.5 * radius);
    var sum = vec3<f32>(0.0);
    var a = max(middle - radius, 0.0);
    let end = middle + radius;
    while a < end {
        let b = min(gpu_panel(a, wo), end);
        for (var i = 0u; i < 16u; i++) {
            let rung = gpu_rung(a, b, i);
            let d = sin(0.5 * (rung.x - middle));
            let square = max((s - d) * (s + d), 0.0) / max(cos(rung.x) * cos(middle), 1e-12);
            let half = 2.0 * brdf_asin(min(sqrt(square), 1.0));
            sum += rung.y * gpu_wedge(rung.x, vec2<f32>(off - half, off + half), wo);
        }
        a = b;
    }
    return sum;
}

// A texel between the angles `theta` from `pole`, `half` radians to both sides of `meridian`.
fn gpu_horizon_cell(pole: vec3<f32>, meridian: vec3<f32>, theta: vec2<f32>, half: f32, wo: vec3<f32>) -> vec3<f32> {
    let side = cross(pole, meridian);
    let azimuth = brdf_atan2(-wo.y, -wo.x);
    // It is where d . sides[k].xyz >= sides[k].w for all k.
    var sides = array<vec4<f32>, 4>(
        vec4<f32>(side * cos(half) + meridian * sin(half), 0.0),
        vec4<f32>(meridian * sin(half) - side * cos(half), 0.0),
        vec4<f32>(pole, cos(theta.y)),
        vec4<f32>(-pole, -cos(theta.x)),
    );
    // Elevations at which the outline has a corner or an extremum; at most 18.
    var breaks: array<f32, 18>;
    var count = 0u;
    let highest = brdf_atan2(side.z, meridian.z);
    for (var i = 0u; i < 2u; i++) {
        let t = select(theta.x, theta.y, i == 1u);
        var phis = array<f32, 5>(-half, half, highest, highest - BRDF_PI, highest + BRDF_PI);
        for (var j = 0u; j < 5u; j++) {
            let phi = phis[j];
            if abs(phi) <= half {
                breaks[count] = brdf_asin(pole.z * cos(t) + (meridian.z * cos(phi) + side.z * sin(phi)) * sin(t));
                count++;
            }
        }
        let phi = select(-half, half, i == 1u);
        let equator = meridian.z * cos(phi) + side.z * sin(phi);
        for (var j = 0u; j < 2u; j++) {
            let u = brdf_atan2(equator, pole.z) + BRDF_PI * f32(j);
            if u > theta.x && u < theta.y {
                breaks[count] = brdf_asin(pole.z * cos(u) + equator * sin(u));
                count++;
            }
        }
    }
    var end = breaks[0];
    var a = breaks[0];
    for (var k = 1u; k < count; k++) {
        end = max(end, breaks[k]);
        a = min(a, breaks[k]);
    }
    a = max(a, 0.0);
    var sum = vec3<f32>(0.0);
    while a < end {
        var b = min(gpu_panel(a, wo), end);
        for (var k = 0u; k < count; k++) {
            if breaks[k] > a {
                b = min(b, breaks[k]);
            }
        }
        for (var i = 0u; i < 16u; i++) {
            let rung = gpu_rung(a, b, i);
            let up = sin(rung.x);
            let level = cos(rung.x);
            // Where the circle of this elevation crosses sides, ascending.
            var at: array<f32, 10>;
            at[0] = -BRDF_PI;
            at[1] = BRDF_PI;
            var crossings = 2u;
            for (var k = 0u; k < 4u; k++) {
                let s = sides[k];
                let q = (s.w - s.z * up) / max(level * length(s.xy), 1e-30);
                if abs(q) < 1.0 {
                    let middle = brdf_atan2(s.y, s.x) - azimuth;
                    let width = brdf_atan2(sqrt((1.0 - q) * (1.0 + q)), q);
                    for (var j = 0u; j < 2u; j++) {
                        let x = gpu_wrap(middle + select(-width, width, j == 1u));
                        var place = crossings;
                        while place > 0u && at[place - 1u] > x {
                            at[place] = at[place - 1u];
                            place--;
                        }
                        at[place] = x;
                        crossings++;
                    }
                }
            }
            for (var k = 1u; k < crossings; k++) {
                let ends = vec2<f32>(at[k - 1u], at[k]);
                let phi = azimuth + 0.5 * (ends.x + ends.y);
                let d = vec3<f32>(level * cos(phi), level * sin(phi), up);
                var inside = ends.y > ends.x;
                for (var j = 0u; j < 4u; j++) {
                    inside = inside && dot(sides[j].xyz, d) >= sides[j].w;
                }
                if inside {
                    sum += rung.y * gpu_wedge(rung.x, ends, wo);
                }
            }
        }
        a = b;
    }
    return sum;
}
