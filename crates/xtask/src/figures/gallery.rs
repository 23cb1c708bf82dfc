//! The gallery: every technique beside the reference, and the numbers that its page says.

use super::{Options, say};
use crate::gallery::{self, ComparedWith, NUMBERS, Row, picture_name};
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use steradian_render::Display;
use steradian_session::atlas::{LIGHT, SCATTERED, scatters, three_lights, usual_specimen};
use steradian_session::compare::Plan;
use steradian_session::{Local, Method, Paths, Renderer, Scene, Session};
use steradian_techniques::local::AnyLocal;
use steradian_techniques::shared::trials::specimens;
use steradian_techniques::{AnyTechnique, locals, registry};

/// Pixels of one picture.
const SIZE: [usize; 2] = [240, 180];
/// Relative noise of traced references.
const NOISE: f64 = 0.05;

/// A technique's slug, and what shades.
type Named = (&'static str, Method);

/// Two pictures side by side.
fn side_by_side(a: &Display, b: &Display) -> Display {
    let rows = a.rgb.chunks_exact(3 * a.width).zip(b.rgb.chunks_exact(3 * b.width));
    Display {
        width: a.width + b.width,
        height: a.height,
        rgb: rows.flat_map(|(a, b)| [a, b].concat()).collect(),
    }
}

/// Draws every technique's picture that is not there yet, and writes their numbers: to draw one again, remove
/// it.
pub fn run(o: &Options) -> Result<()> {
    let path = o.out.join(NUMBERS);
    let mut rows = if path.exists() { gallery::rows(&path)? } else { Vec::new() };
    rows.retain(|r| o.out.join(picture_name(&r.slug)).exists());
    let is_there = |slug: &str| rows.iter().any(|r| r.slug == slug);
    // Those that share material and reference share the reference's picture.
    let mut groups: BTreeMap<(bool, &str), Vec<Named>> = BTreeMap::new();
    for t in registry().iter().filter(|t| !is_there(t.card().slug)) {
        let named = (t.card().slug, Method::Technique(*t));
        groups.entry((t.card().needs.sites, usual_specimen(t.card()))).or_default().push(named);
    }
    let near: Vec<_> = locals().iter().filter(|t| !is_there(t.card().slug)).collect();
    let mut keep = |more: Vec<Row>| {
        rows.extend(more);
        let text: String = std::iter::once(Row::HEAD.to_string()).chain(rows.iter().map(Row::line)).collect();
        std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    };
    for ((sites, spec), named) in groups {
        keep(global(o, sites, spec, &named)?)?;
    }
    for t in near {
        keep(local(o, *t)?)?;
    }
    Ok(())
}

fn scene(shape: &str, spec: &str, session: &mut Session) -> Result<Scene> {
    let mut scene = Scene::of(shape, Some(spec), LIGHT, session)?;
    [scene.settings.width, scene.settings.height] = SIZE;
    Ok(scene)
}

/// Techniques for environments.
fn global(o: &Options, sites: bool, spec: &str, named: &[Named]) -> Result<Vec<Row>> {
    let mut session = Session::new();
    let scene = scene("knot", spec, &mut session)?;
    session.paths = Paths { bounces: 1, noise: NOISE };
    let beside = if sites { ComparedWith::Paths } else { ComparedWith::Reference };
    drawn(o, spec, &scene, named, &session, beside)
}

/// A technique for directional and point lights, under three of them.
fn local(o: &Options, technique: &'static dyn AnyLocal) -> Result<Vec<Row>> {
    let (card, mut session) = (technique.card(), Session::new());
    let spec = usual_specimen(card);
    let mut scene = scene("knot", spec, &mut session)?;
    scene.lights = three_lights();
    let planes = specimens::planes(technique.planes());
    let bidirectional = specimens::is_bidirectional(technique.planes());
    session.paths = Paths { bounces: SCATTERED, noise: NOISE };
    let beside = match scatters(technique) {
        true => ComparedWith::Paths,
        false if planes.is_empty() && !bidirectional => ComparedWith::Reference,
        false => ComparedWith::Plain,
    };
    let mut local = Local::parse(card.slug)?.map(|l| l.with_planes(planes));
    if bidirectional {
        local = local.map(|l| l.with_apparent(specimens::apparent()));
    }
    scene.materials.iter_mut().for_each(|m| m.local.clone_from(&local));
    let takes = |t: &&&'static dyn AnyTechnique| {
        let brdf = &scene.materials[0].brdf;
        !t.card().needs.sites && (t.card().materials)(&**brdf).is_ok()
    };
    let other = registry().iter().find(takes).with_context(|| format!("{spec}: no technique takes it"))?;
    drawn(o, spec, &scene, &[(card.slug, Method::Technique(*other))], &session, beside)
}

/// Pictures and numbers of techniques by name.
fn drawn(
    o: &Options,
    spec: &str,
    scene: &Scene,
    named: &[Named],
    session: &Session,
    beside: ComparedWith,
) -> Result<Vec<Row>> {
    let plan =
        Plan { reference_tolerance: 2e-3, paths: beside == ComparedWith::Paths, ev: 0.0, certificates: true };
    let methods: Vec<Method> = named.iter().map(|n| n.1.clone()).collect();
    let answers = session.compare(scene, &methods, &[Renderer::Cpu], &plan)?.met()?;
    let truth = answers[0].rendering().context("no reference")?;
    let mut rows = Vec::new();
    for ((slug, _), answer) in named.iter().zip(&answers[1..]) {
        let r = answer.rendering().with_context(|| format!("{slug}: {spec} was refused"))?;
        let (errors, flip) = r.errors.context("no errors")?;
        super::save(o, &picture_name(slug), &side_by_side(&r.picture, &truth.picture))?;
        let row = Row {
            slug: (*slug).into(),
            brdf: spec.into(),
            beside,
            relative_rms: errors.relative_rms,
            stops: errors.stops,
            flip,
            certified: r.certificate.as_ref().map_or(0.0, |c| c.error),
            bytes: r.bytes,
        };
        say(row.line().trim_end());
        rows.push(row);
    }
    Ok(rows)
}
