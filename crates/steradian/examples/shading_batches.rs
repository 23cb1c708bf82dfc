//! One bake, and the radiance of batches of points as arrays: what a renderer of one's own calls in every
//! frame.

#![allow(clippy::print_stdout, reason = "an example says what it found")]

use steradian::base::Task;
use steradian::session::{Adjust, Error, Session};
use steradian::sphere::glam::Vec3;
use steradian::techniques::{Material, PointsBuf, Radiance, View, find};

/// Mean radiance over a hemisphere of normals as the light turns, one number a frame.
pub fn run() -> Result<Vec<f32>, Error> {
    let mut session = Session::new();
    let lights = session.light("sky:elevation=20", &Adjust::default())?;
    let material = Material::new(session.brdf("ggx:alpha=0.4")?);
    let technique = find("split_sum").ok_or_else(|| Error::failed("the technique is missing"))?;
    let mut bake = technique.bake(&lights, &material, None, &Default::default(), &Task::quiet())?;
    println!("{} bytes, certified error {:.3}", bake.bytes(), bake.certificate().error);

    // 1024 points that all face the viewer.
    let wo = Vec3::Z;
    let mut points = PointsBuf::with_capacity(1024);
    for k in 0..1024 {
        let (z, phi) = ((k as f32 + 0.5) / 1024.0, 2.399_963 * k as f32);
        let r = (1.0 - z * z).sqrt();
        let n = Vec3::new(r * phi.cos(), r * phi.sin(), z);
        points.push(n, n.any_orthonormal_vector(), wo, Vec3::ZERO);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
    let mut means = Vec::new();
    for frame in 0..8 {
        let turn = steradian::sphere::glam::Mat3::from_rotation_y(frame as f32 * 0.785);
        bake.frame(&View { light_rotation: turn, ..View::default() });
        bake.shade(&points.as_points(), &mut Radiance::of(&mut rgb));
        means.push(rgb[1].iter().sum::<f32>() / points.len() as f32);
    }
    Ok(means)
}

#[allow(dead_code, reason = "the test calls run()")]
fn main() -> Result<(), Error> {
    println!("{:?}", run()?);
    Ok(())
}
