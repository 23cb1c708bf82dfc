// Half and difference vectors (Rusinkiewicz 1998): the twin of half_angles in grid.rs.
struct BrdfHalf {
    // Cosine and sine of the half vector's azimuth.
    turn: vec2<f32>,
    // Cosine and sine of its polar angle.
    tilt: vec2<f32>,
    // The light in the frame whose normal is the half vector, which lies in the plane of its first axis and n.
    light: vec3<f32>,
}

fn brdf_halved(wi: vec3<f32>, wo: vec3<f32>) -> BrdfHalf {
    // Near the mirror direction sums, near the view differences of directions are exact in singles.
    let sum = wi + wo;
    let across = length(sum.xy);
    let size = max(length(sum), BRDF_TINY);
    let turn = select(vec2<f32>(1.0, 0.0), sum.xy / max(across, 1e-37), across > 0.0);
    let tilt = vec2<f32>(sum.z, across) / size;
    let d = 0.5 * (wi - wo);
    let x = dot(vec3<f32>(tilt.x * turn, -tilt.y), d);
    let y = d.y * turn.x - d.x * turn.y;
    return BrdfHalf(turn, tilt, vec3<f32>(x, y, 0.5 * size));
}

fn brdf_theta_h(h: BrdfHalf) -> f32 {
    return brdf_atan2(h.tilt.y, h.tilt.x);
}

fn brdf_theta_d(h: BrdfHalf) -> f32 {
    return brdf_atan2(length(h.light.xy), h.light.z);
}
