// atan2 to 2e-7 (WGSL allows 4096 ulp). Moshier 1992, Cephes, atanf: reduction at tan(pi/8), odd polynomial
// of degree 9.
fn brdf_atan2(y: f32, x: f32) -> f32 {
    let a = abs(x);
    let b = abs(y);
    let t = min(a, b) / max(max(a, b), 1e-37);
    let steep = t > 0.41421356;
    let u = select(t, (t - 1.0) / (t + 1.0), steep);
    let z = u * u;
    let p = ((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1;
    var r = p * z * u + u + select(0.0, 0.785398163397, steep);
    r = select(r, 1.57079632679 - r, b > a);
    r = select(r, 3.14159265359 - r, x < 0.0);
    return select(r, -r, y < 0.0);
}
