struct LocalFrame {
    t: vec3<f32>,
    b: vec3<f32>,
}

// Tangent and bitangent across a bumped normal, in the frame of the surface itself.
fn local_frame(n: vec3<f32>) -> LocalFrame {
    let along = vec3<f32>(1.0 - n.x * n.x, -n.x * n.y, -n.x * n.z);
    let square = dot(along, along);
    var t = vec3<f32>(0.0, 0.0, -1.0);
    if square > 1e-12 {
        t = along / sqrt(square);
    }
    return LocalFrame(t, cross(n, t));
}

fn local_unit(mean: vec3<f32>) -> vec3<f32> {
    let size = length(mean);
    return select(vec3<f32>(0.0, 0.0, 1.0), mean / max(size, 1e-30), size > 0.0);
}

// The normal bent towards the viewer.
fn local_facing(n: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return local_facing_by(n, wo, min(wo.z, 0.01));
}

// As local_facing, for one bump seen from another.
fn local_facing_bump(n: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return local_facing_by(n, wo, 0.01);
}

fn local_facing_by(n: vec3<f32>, wo: vec3<f32>, least: f32) -> vec3<f32> {
    let c = dot(n, wo);
    if c >= least {
        return n;
    }
    let across = n - wo * c;
    return wo * least + across * (sqrt(1.0 - least * least) / max(length(across), 1e-30));
}

// ln(1 - x)
fn local_log_less(x: f32) -> f32 {
    if x < 0.02 {
        return -x * (1.0 + x * (0.5 + x * (0.33333334 + x * 0.25)));
    }
    return log(max(1.0 - x, 1e-37));
}
