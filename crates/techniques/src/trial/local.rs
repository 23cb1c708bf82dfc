//! Common code of the tests of techniques for local light: directions, a groove in closed form, bakes.

use crate::{LocalBake, Material, find_local};
use glam::DVec3;
use steradian_base::Task;
use steradian_scene::surface::Planes;

/// Direction `k` of many over the hemisphere, n·d at least `low`.
pub fn direction(k: u32, low: f64) -> DVec3 {
    let (z, phi) = (low + (1.0 - low) * (f64::from(k) * 0.618_034).fract(), f64::from(k) * 2.4);
    let s = (1.0 - z * z).sqrt();
    DVec3::new(s * phi.cos(), s * phi.sin(), z)
}

/// Mean irradiance over a wall of a groove whose walls make an angle of cosine `c` and are evenly lit with
/// irradiance 1, after 0, 1, 2 … reflections of albedo 1: the part of the other wall from the bottom to the
/// distance y is seen from the distance x with the form factor ½ (1 − (x − y c)/√(x² + y² − 2 x y c)).
pub fn groove(c: f64) -> [f64; 5] {
    const N: usize = 400;
    let seen = |x: f64, y: f64| 0.5 * (1.0 - (x - y * c) / (x * x + y * y - 2.0 * x * y * c).sqrt());
    let middle = |k: usize| (k as f64 + 0.5) / N as f64;
    let strip = |x: usize, y: usize| {
        seen(middle(x), (y + 1) as f64 / N as f64) - seen(middle(x), y as f64 / N as f64)
    };
    let mut e = vec![1.0; N];
    std::array::from_fn(|_| {
        let mean = e.iter().sum::<f64>() / N as f64;
        e = (0..N).map(|x| (0..N).map(|y| strip(x, y) * e[y]).sum()).collect();
        mean
    })
}

/// In single precision.
pub fn single(d: DVec3) -> [f32; 3] {
    d.as_vec3().to_array()
}

/// A local technique's bake of a reflectance and textures.
pub fn bake(slug: &str, spec: &str, textures: Planes) -> Box<dyn LocalBake> {
    bake_with(slug, spec, textures, &[])
}

/// [`bake`] with parameters.
pub fn bake_with(slug: &str, spec: &str, textures: Planes, params: &[(&str, f64)]) -> Box<dyn LocalBake> {
    let t = find_local(slug).expect("a technique");
    let material = Material::new(steradian_brdf::parse(spec).expect("a spec")).with_textures(textures);
    t.bake(&material, None, &params.iter().copied().collect(), &Task::quiet()).expect("bakes")
}
