//! Sentences of Kautz 2004, *Hardware Lighting and Shading: a Survey*, on local light, measured: ours beside
//! the text. Those on compressed texture functions are `figures btf`.

use super::survey::{BUMPS, Shading, bump_scene, film};
use super::{Options, percent, say};
use anyhow::{Context, Result};
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;
use steradian_base::{ParamValues, Task};
use steradian_brdf::measured::expand;
use steradian_brdf::{Files, SharedBrdf, parse};
use steradian_formats::{Limits, read_image};
use steradian_light::{DirectionalLight, Lights};
use steradian_relight::height::{Ellipses, HeightField, Horizons, Pattern};
use steradian_render::{Film, Settings, errors};
use steradian_scene::shapes;
use steradian_scene::surface::Planes;
use steradian_session::{Material, Scene};
use steradian_techniques::{LocalBake, find_local};

/// The error that counts as enough, relative to f · ⟨n·wi⟩.
const ENOUGH: f64 = 0.05;
/// Errors no farther than this from each other are one: what is matte is held to rounding by both.
const TIE: f64 = 1e-5;
/// Models of every kind, isotropic and not.
const MODELS: [&str; 15] = [
    "lambert",
    "oren-nayar:sigma=0.5",
    "minnaert:k=0.65",
    "phong:n=20",
    "blinn-phong:n=40",
    "ggx:alpha=0.2",
    "cook-torrance:m=0.2",
    "microfacet:sigma=0.2",
    "dielectric:alpha=0.2,f0=0.04,albedo=0.5",
    "charlie:alpha=0.4",
    "lafortune:@skin",
    "ward:ax=0.15,ay=0.4,rs=0.3,rd=0.4,variant=1992",
    "ggx:ax=0.2,ay=0.4",
    "ashikhmin-shirley:nu=12,nv=4",
    "poulin-fournier:n=20,d=3,h=0.3",
];

/// All of them.
pub fn run(o: &Options) -> Result<()> {
    decompositions(o)?;
    directions(o)?;
    shadows()?;
    gouraud(o)
}

fn local(slug: &str, brdf: &SharedBrdf, params: &[(&str, f64)]) -> Result<Box<dyn LocalBake>> {
    let technique = find_local(slug).with_context(|| format!("no technique {slug}"))?;
    let values: ParamValues = params.iter().copied().collect();
    let material = steradian_techniques::Material::new(brdf.clone());
    technique.bake(&material, None, &values, &Task::quiet()).map_err(|e| anyhow::anyhow!("{e}"))
}

/// "For many materials only a single product between two functions is needed" (6.2.3), and homomorphic
/// factorization is "better than the approximation using singular value decomposition" (6.2.3), at as many
/// bytes.
fn decompositions(o: &Options) -> Result<()> {
    say(
        "STAR04 6.2.3: error of f cos by one to four terms of the best parametrisation, and homomorphic beside the SVD of as many bytes",
    );
    let sets = if o.brdfs.is_empty() {
        let hundred = expand("sgd:*", Files::Any)?;
        vec![("models", MODELS.map(String::from).to_vec()), ("fits to MERL's hundred (sgd)", hundred)]
    } else {
        vec![("given", o.brdfs.clone())]
    };
    for (name, specs) in sets {
        let (mut by_terms, mut better, mut refused) = ([0; 4], 0, 0);
        for spec in &specs {
            let brdf = parse(spec)?;
            let svd = |terms: usize| local("separable_svd", &brdf, &[("terms", terms as f64)]);
            let one = svd(1)?;
            let mut found = vec![one.certificate().error];
            while found.len() < 4 && found.last().is_some_and(|e| *e > ENOUGH) {
                found.push(svd(found.len() + 1)?.certificate().error);
            }
            if let Some(k) = found.iter().position(|e| *e <= ENOUGH) {
                by_terms[k] += 1;
            }
            let listed = found.iter().map(|e| format!("{:>8}", percent(*e))).collect::<String>();
            let beside = match local("homomorphic", &brdf, &[]) {
                Ok(h) => {
                    // As many terms as fit into its bytes; bytes grow linearly with terms.
                    let terms = (h.bytes() / one.bytes().max(1)).clamp(1, 32);
                    let equal = match found.get(terms - 1) {
                        Some(known) => *known,
                        None => svd(terms)?.certificate().error,
                    };
                    better += usize::from(h.certificate().error < equal - TIE);
                    let own = percent(h.certificate().error);
                    format!(
                        "homomorphic {own:>8} ({} kB), SVD of {terms:>2} {:>8}",
                        h.bytes() / 1000,
                        percent(equal)
                    )
                }
                Err(e) => {
                    refused += 1;
                    format!("homomorphic refuses: {e}")
                }
            };
            say(&format!("{spec:<46} {listed:<32} {beside}"));
        }
        let [one, two, three, four] = by_terms;
        let count = specs.len();
        say(&format!(
            "{name}: within {} by one term {one} of {count}, by two {two} more, by three {three}, by four {four}; homomorphic better at as many bytes for {better} of {}",
            percent(ENOUGH),
            count - refused
        ));
    }
    Ok(())
}

/// "More than 50 directions" (6.4.2, on scattering between bumps).
fn directions(o: &Options) -> Result<()> {
    const COUNTS: [usize; 6] = [8, 16, 32, 64, 128, 256];
    say(
        "STAR04 6.4.2: two reflections between bumps by the number of directions, against 256, and the same beside paths",
    );
    // Of the matte surface of figure 9, whatever materials are given.
    let o = Options { out: o.out.clone(), light: None, brdfs: Vec::new(), side: o.side };
    let (flat, truth, planes) = bump_scene(&o, o.side.unwrap_or(128), (40.0, 30.0))?;
    let by = |n: usize| {
        let spec = format!("bump_horizon:relief={BUMPS},shadow=horizon,azimuths=32,bounces=2,directions={n}");
        film(&flat, &Shading::Local(&spec, planes.clone()))
    };
    let films: Vec<Film> = COUNTS.iter().map(|n| by(*n)).collect::<Result<_>>()?;
    let truth = film(&truth, &Shading::Paths(3))?;
    let most = &films[films.len() - 1];
    for (n, f) in COUNTS.iter().zip(&films) {
        let all = |i: usize| f.alpha[i] >= 1.0;
        let [own, paths] = [most, &truth].map(|t| percent(errors(f, t, all).relative_rms));
        say(&format!("{n:>4} directions: {own:>7}, beside paths {paths:>7}"));
    }
    Ok(())
}

/// Ellipses and horizons give "similar" results (6.4.2).
fn shadows() -> Result<()> {
    const SIDE: usize = 256;
    const LIGHTS: usize = 16;
    say("STAR04 6.4.2: texels lit wrongly, lights at 16 azimuths so many degrees off the normal, relief 8 %");
    let mut fields: Vec<(String, Vec<f32>)> = Vec::new();
    match steradian_testkit::data("meshes/textures") {
        Some(dir) => {
            for name in ["rocks_NM_height.tga", "stones_NM_height.tga"] {
                let raster = read_image(&dir.join(name), &Limits::default())?;
                let (w, alpha) = (raster.width, raster.channel("A").context("no heights in alpha")?);
                let z = (0..SIDE * SIDE).map(|k| {
                    let at = |x: usize| x * w / SIDE;
                    0.08 * SIDE as f32 * alpha[at(k / SIDE) * w + at(k % SIDE)]
                });
                fields.push((name.into(), z.collect()));
            }
        }
        None => {
            say("no meshes/textures (STERADIAN_DATA): patterns by formula stand in");
            for p in [Pattern::Hemispheres, Pattern::Cracks] {
                let z = p.heights(SIDE).iter().map(|z| 0.08 * SIDE as f32 * z).collect();
                fields.push((p.name().into(), z));
            }
        }
    }
    for (name, z) in fields {
        let field = HeightField::new(SIDE, SIDE, z)?;
        let go_on = || true;
        let horizons: Vec<(usize, Horizons)> = [8, 16, 32]
            .iter()
            .map(|n| Ok((*n, Horizons::new(&field, *n, &go_on).context("nobody stops it")?)))
            .collect::<Result<_>>()?;
        let ellipses = Ellipses::new(&field, &go_on).context("nobody stops it")?;
        for degrees in [60.0f64, 75.0] {
            let (s, c) = degrees.to_radians().sin_cos();
            let mut wrong = [0usize; 4];
            for l in 0..LIGHTS {
                // Each light at another place between two azimuths of the tables, in another direction.
                let place = (l as f64 + 0.5) / LIGHTS as f64;
                let phi = TAU * ((5 * l % LIGHTS) as f64 + place) / LIGHTS as f64;
                let d = DVec3::new(s * phi.cos(), s * phi.sin(), c);
                for k in 0..SIDE * SIDE {
                    let (i, j) = (k % SIDE, k / SIDE);
                    let seen = field.sees(i, j, d);
                    let single: Vec3 = d.as_vec3();
                    for (w, (_, h)) in wrong.iter_mut().zip(&horizons) {
                        *w += usize::from((h.visible(k, single, 0.0) > 0.5) != seen);
                    }
                    wrong[3] += usize::from(ellipses.0[k].lit(single) != seen);
                }
            }
            let share = |w: usize| percent(w as f64 / (LIGHTS * SIDE * SIDE) as f64);
            let [a, b, c, e] = wrong.map(share);
            say(&format!("{name:<22} {degrees}°: 8 azimuths {a}, 16 {b}, 32 {c}; ellipses {e}"));
        }
    }
    Ok(())
}

/// Highlights that shading at vertices misses (6.1).
fn gouraud(o: &Options) -> Result<()> {
    say(
        "STAR04 6.1: a highlight by vertices of a sphere, light and view apart: energy of it that is found, and error, by segments",
    );
    let side = o.side.unwrap_or(160);
    let spec = "phong-normalized:s=60";
    let direction = DVec3::new(0.5, 0.45, 0.74).normalize();
    let lights = Lights {
        directionals: vec![DirectionalLight { direction, irradiance: [1.0; 3] }],
        ..Lights::default()
    };
    for segments in [6, 12, 24, 48, 96] {
        let mesh = shapes::sphere(segments);
        let scene = Scene {
            settings: Settings { inner: 1, share: true, ..Settings::new(side, side) },
            ..Scene::new(mesh, vec![Material::new(parse(spec)?)], lights.clone())
        };
        let none = Planes::default;
        let [vertex, pixel] = ["vertex", "pixel"]
            .map(|rate| film(&scene, &Shading::Local(&format!("vertex_analytic:rate={rate}"), none())));
        let (vertex, pixel) = (vertex?, pixel?);
        let all = |i: usize| pixel.alpha[i] >= 1.0 && vertex.alpha[i] >= 1.0;
        let sum = |f: &Film| (0..f.len()).filter(|i| all(*i)).map(|i| f64::from(f.rgb[1][i])).sum::<f64>();
        let peak = |f: &Film| (0..f.len()).filter(|i| all(*i)).fold(0.0f32, |m, i| m.max(f.rgb[1][i]));
        say(&format!(
            "{segments:>4} segments: energy {:>8}, peak {:>8}, error {:>8}",
            percent(sum(&vertex) / sum(&pixel)),
            percent(f64::from(peak(&vertex) / peak(&pixel))),
            percent(errors(&vertex, &pixel, all).relative_rms)
        ));
    }
    Ok(())
}
