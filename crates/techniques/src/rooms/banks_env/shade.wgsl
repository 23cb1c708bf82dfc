fn arccos(x: f32) -> f32 {
    let a = -0.017088126 + x * (0.00667009 - x * 0.0012624911);
    let b = 0.08897899 + x * (-0.050174303 + x * (0.03089188 + x * a));
    return sqrt(max(1.0 - x, 0.0)) * (1.5707963 + x * (-0.2145988 + x * b));
}

fn alpha(t: vec3<f32>, wo: vec3<f32>, y: f32) -> f32 {
    let c = cross(t, wo);
    let s = min(sqrt(dot(c, c)), 1.0);
    return select(1.5707963 - arccos(s), arccos(y), y < s);
}

fn radiance_of(t: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let y = dot(t, wo);
    let d = technique.turn * (select(technique.scale.w, -technique.scale.w, y < 0.0) * t);
    return technique.scale.rgb * fetch_cones(d, alpha(t, wo, min(abs(y), 1.0)) * technique.per_angle);
}

fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    if !(dot(n, wo) > 0.0) {
        return vec3<f32>(0.0);
    }
    return radiance_of(t, wo);
}
