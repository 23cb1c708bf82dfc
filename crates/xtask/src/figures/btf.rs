//! What compression takes from bidirectional texture functions: the survey's two sentences on Sattler's and
//! Müller's ratios, and the one on what a chain of factors loses (STAR04 6.4.5), on surfaces that the path
//! tracer photographs. Direct light, 81 views, 81 lights.

use super::{Options, percent, say};
use anyhow::{Context, Result};
use std::time::Instant;
use steradian_relight::btf::{Btf, Compressed, Method};
use steradian_session::Session;
use steradian_session::btf::{Pattern, Shape, Surface};

/// Texels a side, where `--side` says nothing.
const SIDE: usize = 64;
/// Reflectance, where `--brdf` says nothing.
const BRDF: &str = "ggx:alpha=0.4,f0=0.3";
/// Components of clusters.
const COMPONENTS: usize = 8;
/// Difference vectors, and terms of a chain.
const CHAIN: [usize; 2] = [128, 3];
/// Rings of views that errors are told of: degrees from the normal.
const RINGS: [f64; 4] = [0.0, 30.0, 60.0, 75.0];

/// The table.
pub fn run(o: &Options) -> Result<()> {
    let side = o.side.unwrap_or(SIDE);
    let spec = o.brdfs.first().map_or(BRDF, String::as_str);
    say(&format!(
        "synthetic pictures of {side} x {side} texels, {spec}: relative RMS error of all pairs, and of views off the normal by"
    ));
    say("surface      relief  method   ratio    all     0°     30°    60°    75°   seconds");
    for (pattern, relief) in Pattern::ALL.into_iter().map(|p| (p, 0.1)).chain([(Pattern::Hemispheres, 0.0)]) {
        let mut session = Session::new();
        let surface = Surface {
            shape: Shape::Pattern(pattern, side),
            relief,
            brdf: session.brdf(spec)?,
            base_colour: None,
            views: 81,
            lights: 81,
            bounces: 1,
            samples: 1,
            seed: 0,
            format: "exr",
        };
        let start = Instant::now();
        let btf = session.photographed(&surface)?;
        let name = format!("{:12} {relief:6}", pattern.name());
        say(&format!("{name}  captured{:47}{:.1}", "", start.elapsed().as_secs_f64()));
        for (word, method) in methods(&btf) {
            let start = Instant::now();
            let small = Compressed::new(&btf, method, &|| true).context("nobody stops it")?;
            let seconds = start.elapsed().as_secs_f64();
            let rings = rings(&btf, &small);
            let all: Vec<String> = std::iter::once(small.error()).chain(rings).map(percent).collect();
            say(&format!("{name}  {word:8} 1:{:<5.0} {}  {seconds:.1}", small.ratio(), all.join(" ")));
        }
    }
    Ok(())
}

/// Sattler's, Müller's and Suykens's methods, of the survey's ratios: 1:6, and twice about 1:100.
fn methods(of: &Btf) -> Vec<(&'static str, Method)> {
    let (texels, d) = (of.texels() as f64, of.dimension() as f64);
    let left = texels * d / 100.0 - texels * (COMPONENTS as f64 + 0.5);
    let clusters = (left / ((COMPONENTS + 1) as f64 * d)).floor().max(1.0) as usize;
    let [differences, terms] = CHAIN;
    let halves = (d / 100.0 / (3 * terms) as f64).floor().max(1.0) as usize;
    vec![
        ("view", Method::View { components: 12 }),
        ("local", Method::Local { clusters, components: COMPONENTS }),
        ("chained", Method::Chained { terms, halves, differences }),
    ]
}

/// Relative errors of the views of each ring.
fn rings(of: &Btf, small: &Compressed) -> Vec<f64> {
    let by_view = small.by_view(of);
    let ring = |theta: &f64| {
        let near = |v: &glam::DVec3| (v.z.min(1.0).acos().to_degrees() - theta).abs() < 0.1;
        let own = of.views().iter().zip(&by_view).filter(|(v, _)| near(v));
        let [off, all] = own.fold([0.0; 2], |s, (_, e)| [s[0] + e[0], s[1] + e[1]]);
        if all > 0.0 { (off / all).sqrt() } else { 0.0 }
    };
    RINGS.iter().map(ring).collect()
}
