// The twin of angle.rs.
fn local_arccos(x: f32) -> f32 {
    let a = -0.017088126 + x * (0.00667009 - x * 0.0012624911);
    let b = 0.08897899 + x * (-0.050174303 + x * (0.03089188 + x * a));
    return sqrt(max(1.0 - x, 0.0)) * (1.5707963 + x * (-0.2145988 + x * b));
}

fn local_angle(sine: f32, cosine: f32) -> f32 {
    return select(1.5707963 - local_arccos(sine), local_arccos(cosine), cosine < sine);
}
