// A point's own lobe.
struct Lobe {
    // Width in place of the material's; negative keeps the material's.
    alpha: f32,
    // Added to alpha^2.
    widen: f32,
    // Least alpha of the lookup.
    least: f32,
    // Covariance of the normals in the frame (t, n x t): tt, tb, bb.
    spread: vec3<f32>,
    // Diffuse albedo and reflectance at normal incidence in place of the material's; negative keeps the material's.
    albedo: vec3<f32>,
    f0: vec3<f32>,
}

