// The twin of hemisphere.rs.
fn local_azimuth(code: f32, x: f32, y: f32) -> f32 {
    let sum = abs(x) + abs(y);
    let p = select(0.0, abs(y) / max(sum, 1e-37), sum > 0.0);
    let above = select(p, 2.0 - p, x < 0.0);
    if code < 0.5 {
        return 0.0;
    }
    if code < 1.5 {
        return 0.25 * select(above, 4.0 - above, y < 0.0);
    }
    if code < 2.5 {
        return 0.5 * above;
    }
    if code < 3.5 {
        return 0.5 * select(above, 2.0 - above, y < 0.0);
    }
    return p;
}

// Rows dense at the pole.
fn local_from_pole(code: f32, w: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(local_azimuth(code, w.x, w.y), sqrt(max(length(w.xy) / (1.0 + w.z), 0.0)));
}

// Rows dense at the horizon.
fn local_from_horizon(code: f32, w: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(local_azimuth(code, w.x, w.y), sqrt(max(w.z / (1.0 + length(w.xy)), 0.0)));
}
