//! From names to a picture and a certificate.

#![allow(clippy::print_stdout, reason = "an example says what it found")]

use std::path::Path;
use steradian::session::{Error, Scene, Session};

/// Writes `picture.png` into `folder`; the certified error.
pub fn run(folder: &Path) -> Result<f64, Error> {
    let mut session = Session::new();
    let mut scene = Scene::of("torus", Some("ggx:alpha=0.3,f0=1/0.8/0.4"), "sky:elevation=30", &mut session)?;
    (scene.settings.width, scene.settings.height) = (96, 72);
    scene.tolerance = Some(0.6);
    let picture = session.render(&scene)?.met()?;
    let (error, slug) = (picture.error(), picture.materials[0].method.slug());
    println!(
        "{slug}: certified {:.1} %, in this picture {:?}",
        100.0 * error,
        picture.materials[0].picture_error.map(|e| e.relative_rms)
    );
    session.write_film(&folder.join("picture.png"), picture.film, picture.develop)?;
    Ok(error)
}

#[allow(dead_code, reason = "the test calls run()")]
fn main() -> Result<(), Error> {
    run(&std::env::temp_dir()).map(|_| ())
}
