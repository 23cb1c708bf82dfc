//! How long a window waits for a change: milliseconds to the rebaked scene by [`Session::live`], of techniques that need no
//! sites of a mesh.
//!
//!     cargo bench -p steradian-session --features gpu --bench live
//!     cargo bench -p steradian-session --features gpu --bench live -- split_sum shrm
#![allow(clippy::print_stdout)]

use std::time::Instant;
use steradian_session::live::{Live, Names};
use steradian_session::{Adjust, Error, Material, Method, Scene, Session};

const FIRST: &str = "ggx:alpha=0.2,f0=1/0.77/0.34";
const SECOND: &str = "ggx:alpha=0.3,f0=1/0.77/0.34";

/// Milliseconds to a scene of these materials and lights.
fn time(session: &Session, scene: &Scene, light: &str, before: Option<&Live>) -> Result<(f64, Live), Error> {
    let names = Names { mesh: "teapot".into(), light: light.into() };
    let start = Instant::now();
    let live = session.live(scene, names, before)?;
    Ok((1e3 * start.elapsed().as_secs_f64(), live))
}

/// Milliseconds to a preview of them.
fn preview(session: &Session, scene: &Scene, light: &str, before: &Live) -> Result<f64, Error> {
    let names = Names { mesh: "teapot".into(), light: light.into() };
    let start = Instant::now();
    let live = session.preview(scene, names, before)?;
    Ok(live.map_or(f64::NAN, |_| 1e3 * start.elapsed().as_secs_f64()))
}

fn main() -> Result<(), Error> {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let mut session = Session::new();
    let (first, second) = (session.brdf(FIRST)?, session.brdf(SECOND)?);
    let (sky, studio) =
        (session.light("sky", &Adjust::default())?, session.light("studio", &Adjust::default())?);
    let mut scene = Scene::of("teapot", Some(FIRST), "studio", &mut session)?;
    println!("milliseconds until the scene is baked; lights of 1024 x 512 texels");
    println!(
        "{:26} {:>9} {:>11} {:>9} {:>14} {:>9} {:>9}",
        "technique", "at first", "other alpha", "preview", "other light", "preview", "again"
    );
    for t in steradian_techniques::registry() {
        let card = t.card();
        if card.needs.sites
            || (card.materials)(&*first).is_err()
            || !(asked.is_empty() || asked.iter().any(|a| a == card.slug))
        {
            continue;
        }
        scene.materials = vec![Material::new(first.clone()).with(Method::Technique(*t))];
        scene.lights = studio.clone();
        let (cold, a) = time(&session, &scene, "studio", None)?;
        scene.materials = vec![Material::new(second.clone()).with(Method::Technique(*t))];
        let early = preview(&session, &scene, "studio", &a)?;
        let (alpha, b) = time(&session, &scene, "studio", Some(&a))?;
        scene.lights = sky.clone();
        let early_light = preview(&session, &scene, "sky", &b)?;
        let (light, c) = time(&session, &scene, "sky", Some(&b))?;
        let (again, _) = time(&session, &scene, "sky", Some(&c))?;
        println!(
            "{:26} {cold:9.0} {alpha:11.0} {early:9.0} {light:14.0} {early_light:9.0} {again:9.1}",
            card.slug
        );
    }
    Ok(())
}
