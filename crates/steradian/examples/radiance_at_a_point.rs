//! The radiance that leaves one point, by the reference and by a technique with its certificate.

#![allow(clippy::print_stdout, reason = "an example says what it found")]

use steradian::session::eval::{Points, Request};
use steradian::session::{Adjust, Error, Method, Session};
use steradian::sphere::glam::DVec3;

/// Reference, technique, and what the technique certifies.
pub fn run() -> Result<[f64; 3], Error> {
    let mut session = Session::new();
    let sky = session.light("sky:elevation=40", &Adjust::default())?;
    let mut request = Request::new(sky, session.brdf("lambert:albedo=0.5")?, Method::Reference);
    request.tolerance = Some(1e-3);
    let floor = Points::new(vec![DVec3::Y], vec![DVec3::new(0.6, 0.8, 0.0)]);
    let exact = session.eval(&request, &floor)?.met()?;

    let fast = Request { method: Method::find("sh_irradiance")?, tolerance: Some(0.1), ..request };
    let fast = session.eval(&fast, &floor)?.met()?;
    println!(
        "reference {:?}, technique {:?} (certified RMS error {:.3})",
        exact.rows[0].0, fast.rows[0].0, fast.error
    );
    Ok([exact.rows[0].0[1], fast.rows[0].0[1], fast.error])
}

#[allow(dead_code, reason = "the test calls run()")]
fn main() -> Result<(), Error> {
    run().map(|_| ())
}
