//! Figure 5.1: a statue of five reflectances under four lights by spherical harmonic reflection maps, beside
//! the reference.
//!
//! CUReT's orange and velvet are not at hand: a fit to an orange paint and lobes fitted to felt stand in. So
//! does Galileo's tomb for St Peter's Basilica, of which only halves with overscan are.

use super::{Options, mesh, percent, save, say};
use anyhow::{Context, Result};
use steradian_render::{Cell, Row, Sheet};
use steradian_session::compare::{Plan, Rendering};
use steradian_session::{Method, Renderer, Scene, Session};
use steradian_testkit::data_dir;

/// What the paper has, what stands here, its light, and whether strands run about +Y.
const COLUMNS: [(&str, &str, &str); 5] = [
    ("microfacet, Grace Cathedral", "microfacet:sigma=0.2", "grace_probe.hdr"),
    ("krylon blue, St Peter's", "lafortune:@krylon-blue", "galileo_probe.hdr"),
    ("orange, Uffizi", "sgd:orange-paint", "../latlong/probulator_uffizi.hdr"),
    ("velvet, Uffizi", "lafortune:@felt", "../latlong/probulator_uffizi.hdr"),
    ("Kajiya-Kay, eucalyptus", "kajiya-kay:s=32", "rnl_probe.hdr"),
];
/// Stands in for lights that are missing.
const STUDIO: &str = "studio";
/// Of the reference, relative.
const TRUTH: f64 = 2e-3;

pub fn run(o: &Options) -> Result<()> {
    let side = o.side.unwrap_or(256);
    say("RH02 figure 5.1: a statue by `shrm`, errors of the picture (relative RMS) beside the reference");
    let mut rows = [Vec::new(), Vec::new()];
    for (what, spec, file) in COLUMNS {
        let light = o.light.clone().or_else(|| {
            let path = data_dir()?.join("environments/angular").join(file);
            path.exists().then(|| path.display().to_string())
        });
        let light = light.unwrap_or_else(|| STUDIO.into());
        let mut session = Session::new();
        let mut scene = Scene::of("knot", Some(spec), &light, &mut session)?;
        scene.mesh = mesh::brushed(mesh::of("armadillo.obj", mesh::knot)?, glam::Vec3::Y);
        [scene.settings.width, scene.settings.height] = [side, side];
        let plan = Plan { reference_tolerance: TRUTH, paths: false, ev: 0.0, certificates: true };
        let answers = session.compare(&scene, &[Method::find("shrm")?], &[Renderer::Cpu], &plan)?.met()?;
        let [truth, shrm] = [0, 1].map(|i| answers.get(i).and_then(|a| a.rendering()));
        let (truth, shrm) =
            (truth.context("no reference")?, shrm.with_context(|| format!("{spec} was refused"))?);
        let error = percent(shrm.errors.context("no errors")?.0.relative_rms);
        let name =
            std::path::Path::new(&light).file_name().map_or(light.clone().into(), |n| n.to_string_lossy());
        say(&format!(
            "{what}: {spec} under {name}: {error}, {} stated; bake {:.2} s, picture {:.3} s, {} bytes",
            shrm.certificate.as_ref().map_or_else(String::new, super::picture::certified),
            shrm.bake_seconds,
            shrm.shade_seconds,
            shrm.bytes
        ));
        let cell = |r: &Rendering, caption| Some(Cell { picture: r.picture.clone(), caption: vec![caption] });
        rows[0].push(cell(shrm, format!("error {error}")));
        rows[1].push(cell(truth, format!("{spec}, {name}")));
    }
    let [ours, truth] = rows;
    let row = |label: &str, cells| Row { label: vec![label.into()], cells };
    let sheet = Sheet {
        title: "Reflectances and lights".into(),
        subtitle: "spherical harmonic reflection maps as they come; the paper has CUReT's orange and velvet"
            .into(),
        columns: COLUMNS.map(|c| c.0.to_string()).into(),
        rows: vec![row("SHRM", ours), row("integral", truth)],
        text_size: 12.5,
    };
    save(o, "figure-5.1.png", &sheet.draw())
}
