//! Figures 6, 7, 8, 9, 15 and 23 of Kautz 2004, *Hardware Lighting and Shading: a Survey*: what its
//! techniques for local light and for self-shadowing draw, each beside the truth.
//!
//! Figures 6 and 7 are held against the model itself, which casts no shadows, and with shadows by rays
//! against paths, 8 and 9 against paths on the surface that the bumps stand for, 15 and 23 against paths of
//! one reflection. Errors are relative RMS errors of radiance over the pixels that all pictures of a row
//! cover wholly.

use super::{Options, light, mesh, percent, save, say};
use anyhow::{Context, Result};
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_light::{DirectionalLight, Lights};
use steradian_render::scenefile::SceneBackground;
use steradian_render::tone::auto_exposure;
use steradian_render::{Cell, Develop, Film, Row, Settings, Sheet, Texture, ToneMapper, errors};
use steradian_scene::surface::Planes;
use steradian_scene::{Camera, Framing, Mesh, shapes};
use steradian_session::atlas::three_lights;
use steradian_session::{Local, Material, Method, Paths, Scene, Session, Shadows};

/// Pixels a side.
const SIDE: usize = 256;
/// Stops below the automatic exposure: highlights of small lights.
const DARKER: f32 = 1.0;
/// The same where nothing but highlights is seen.
const HIGHLIGHTS: f32 = 3.5;
/// Height of the largest bump over the width of a tile.
pub const BUMPS: f32 = 0.16;
/// Noise of paths, relative.
const NOISE: f64 = 0.02;

/// What shades a picture.
pub enum Shading<'a> {
    /// A technique for directional and point lights, with data per texel.
    Local(&'a str, Planes),
    /// The same without data per texel, with shadows by rays.
    Shadowed(&'a str),
    /// A technique for environments, with its parameters.
    Global(&'a str, &'a str),
    /// The reflectance itself.
    Model,
    /// Paths with so many reflections.
    Paths(u32),
}

/// The picture of a scene that is shaded so.
pub fn film(scene: &Scene, shading: &Shading<'_>) -> Result<Film> {
    let (mut scene, mut session) = (scene.clone(), Session::new());
    // No shadows but those that a technique knows: the models know none.
    session.shadows = if matches!(shading, Shading::Shadowed(_)) { Shadows::Ray } else { Shadows::Off };
    let method = match shading {
        Shading::Local(..) | Shading::Shadowed(_) => Method::find("sh_irradiance")?,
        Shading::Global(slug, _) => Method::find(slug)?,
        Shading::Model => Method::Reference,
        Shading::Paths(bounces) => {
            session.paths = Paths { bounces: *bounces, noise: NOISE };
            Method::Path
        }
    };
    for m in &mut scene.materials {
        let local = match shading {
            Shading::Local(spec, planes) => Some((spec, planes.clone())),
            Shading::Shadowed(spec) => Some((spec, Planes::default())),
            _ => None,
        };
        if let Some((spec, planes)) = local {
            m.local = Local::parse(spec)?.map(|l| l.with_planes(planes));
            // Lights near by are all there is: what shades the dark environment is any technique that takes
            // the reflectance.
            m.method = Some(any_global(m)?);
        } else {
            m.method = Some(method.clone());
            if let (Shading::Global(_, params), Method::Technique(t)) = (shading, &method) {
                m.params = ParamValues::parse(params, t.params())?;
            }
        }
    }
    Ok(session.render(&scene)?.even_if_missed().0.film)
}

/// A technique for environments that takes a material.
fn any_global(m: &Material) -> Result<Method> {
    let takes = |t: &&&'static dyn steradian_techniques::AnyTechnique| {
        !t.card().needs.sites && (t.card().materials)(&*m.brdf).is_ok()
    };
    let found = steradian_techniques::registry().iter().find(takes);
    Ok(Method::Technique(*found.with_context(|| format!("{}: no technique takes it", m.brdf.spec()))?))
}

/// The pictures of a scene that is shaded by each in turn.
fn films(scene: &Scene, each: &[(&str, Shading<'_>)]) -> Result<Vec<(String, Film)>> {
    each.iter().map(|(name, shading)| Ok(((*name).to_string(), film(scene, shading)?))).collect()
}

/// Pictures of a row, the last of them true, with the errors of the others; so many stops darker than usual.
pub fn row(label: &str, films: &[(String, Film)], darker: f32) -> Result<Row> {
    let (_, truth) = films.last().context("an empty row")?;
    let covered = |i: usize| films.iter().all(|f| f.1.alpha[i] >= 1.0);
    let ev = auto_exposure(truth, |i| truth.alpha[i]) - darker;
    let develop = Develop { ev, mapper: ToneMapper::Aces };
    let mut cells = Vec::new();
    for (k, (name, film)) in films.iter().enumerate() {
        let mut caption = vec![name.clone()];
        if k + 1 < films.len() {
            let error = percent(errors(film, truth, covered).relative_rms);
            say(&format!("{label:<28} {name:<34} {error:>8}"));
            caption.push(format!("error {error}"));
        }
        cells.push(Some(Cell { picture: develop.film(film), caption }));
    }
    Ok(Row { label: vec![label.into()], cells })
}

pub fn sheet(title: &str, subtitle: &str, rows: Vec<Row>) -> Sheet {
    let most = rows.iter().map(|r| r.cells.len()).max().unwrap_or(0);
    Sheet {
        title: title.into(),
        subtitle: subtitle.into(),
        columns: vec![String::new(); most],
        rows,
        text_size: 12.5,
    }
}

/// A scene on black.
fn scene(o: &Options, mesh: Mesh, spec: &str, lights: Lights) -> Result<Scene> {
    let side = o.side.unwrap_or(SIDE);
    let material = Material::new(steradian_brdf::parse(spec)?);
    Ok(Scene {
        camera: Framing { share: 0.9, ..Framing::default() }.camera(&mesh.positions),
        // One point a pixel, as pictures of the reference have.
        settings: Settings { inner: 1, share: true, ..Settings::new(side, side) },
        background: SceneBackground::Colour([0.0; 3]),
        ..Scene::new(mesh, vec![material], lights)
    })
}

/// Figure 6: the analytical decompositions of Cook and Torrance's model and of Banks's.
pub fn analytical(o: &Options) -> Result<()> {
    say("STAR04 figure 6: analytical decompositions under three directional lights, relative RMS error");
    let mut rows = Vec::new();
    for (spec, slug) in [
        ("cook-torrance:m=0.25,g=smith,f0=0.95/0.64/0.54", "analytic_decomposition"),
        ("banks:n=40", "banks_table"),
    ] {
        let spec = o.brdfs.first().map_or(spec, String::as_str);
        let scene = scene(o, shapes::teapot(24, true), spec, three_lights())?;
        let name = spec.split(':').next().unwrap_or(spec);
        let plain = [(slug, Shading::Local(slug, Planes::default())), ("the model", Shading::Model)];
        let mut all = row(name, &films(&scene, &plain)?, HIGHLIGHTS)?;
        let shadowed =
            [("with shadows", Shading::Shadowed(slug)), ("paths, direct light", Shading::Paths(1))];
        all.cells.extend(row(name, &films(&scene, &shadowed)?, HIGHLIGHTS)?.cells);
        rows.push(all);
    }
    let subtitle =
        "two-dimensional tables against the models, and with shadows against paths, under three lights";
    save(o, "star04-6.png", &sheet("Analytical decomposition", subtitle, rows).draw())
}

/// White with dark veins: |Σ noise| over octaves of sines, 0 in a vein and 1 away from it.
fn veins(p: Vec3) -> f32 {
    let turbulence: f32 = (0..5)
        .map(|k| {
            let f = 2f32.powi(k);
            let q = p * f + Vec3::splat(1.7 * k as f32);
            (((1.9 * q.x + 0.7 * q.z).sin() + (2.3 * q.y - 0.9 * q.x).sin() + (1.7 * q.z + 1.1 * q.y).sin())
                / 3.0)
                .abs()
                / f
        })
        .sum();
    let wave = (5.0 * p.x + 3.0 * p.y + 4.5 * turbulence).sin().abs();
    (3.0 * wave - 0.35).clamp(0.0, 1.0)
}

/// Colour of marble.
fn marble(v: f32) -> [f32; 3] {
    let (white, vein) = ([0.85, 0.82, 0.76], [0.16, 0.11, 0.09]);
    std::array::from_fn(|c| vein[c] + (white[c] - vein[c]) * v)
}

/// Figure 7: a decomposed anisotropic reflectance under a marble texture, by terms.
pub fn teapot(o: &Options) -> Result<()> {
    const SPEC: &str = "ward:ax=0.1,ay=0.35,rs=0.25,rd=0.6,variant=1992";
    say("STAR04 figure 7: an anisotropic marble teapot by separable decomposition, relative RMS error");
    let mut mesh = shapes::teapot(96, true);
    mesh.colors = mesh.positions.iter().map(|p| Vec3::from(marble(veins(1.6 * *p)))).collect();
    let scene = scene(o, mesh, o.brdfs.first().map_or(SPEC, String::as_str), three_lights())?;
    let none = Planes::default;
    let ways = [
        ("one term of (h, d)", Shading::Local("separable_svd:terms=1,parametrisation=hd", none())),
        ("two terms of (h, d)", Shading::Local("separable_svd:terms=2,parametrisation=hd", none())),
        ("eight terms of (v, l)", Shading::Local("separable_svd:terms=8,parametrisation=vl", none())),
        ("homomorphic", Shading::Local("homomorphic", none())),
        ("the model", Shading::Model),
    ];
    let shadowed = [
        ("one term of (h, d)", Shading::Shadowed("separable_svd:terms=1,parametrisation=hd")),
        ("two terms of (h, d)", Shading::Shadowed("separable_svd:terms=2,parametrisation=hd")),
        ("eight terms of (v, l)", Shading::Shadowed("separable_svd:terms=8,parametrisation=vl")),
        ("homomorphic", Shading::Shadowed("homomorphic")),
        ("paths, direct light", Shading::Paths(1)),
    ];
    let rows = vec![
        row("marble", &films(&scene, &ways)?, DARKER)?,
        row("with shadows", &films(&scene, &shadowed)?, DARKER)?,
    ];
    let subtitle = "Ward's model over marble, numerically decomposed, under three directional lights";
    save(o, "star04-7.png", &sheet("Anisotropic marble", subtitle, rows).draw())
}

/// One directional light; `elevation` and `azimuth` in degrees about +Y from +X.
fn from(elevation: f64, azimuth: f64) -> Lights {
    let ((se, ce), (sa, ca)) = (elevation.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
    let direction = DVec3::new(ce * ca, se, ce * sa);
    let directionals = vec![DirectionalLight { direction, irradiance: [3.0; 3] }];
    Lights { directionals, ..Lights::default() }
}

fn texture(width: usize, height: usize, at: impl Fn(f32, f32) -> [f32; 3]) -> Result<Arc<Texture>> {
    let texel = |k: usize| {
        let (i, j) = (k % width, k / width);
        at((i as f32 + 0.5) / width as f32, (j as f32 + 0.5) / height as f32)
    };
    let all: Vec<[f32; 3]> = (0..width * height).map(texel).collect();
    let planes = std::array::from_fn(|c| all.iter().map(|v| v[c]).collect());
    Ok(Arc::new(Texture::new(width, height, &planes).context("a texture without texels")?))
}

/// Normals of a surface from its triangles, weighed by area.
fn smoothed(mesh: &mut Mesh) {
    let mut sum = vec![Vec3::ZERO; mesh.positions.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let n = (b - a).cross(c - a);
        t.iter().for_each(|i| sum[*i as usize] += n);
    }
    for (n, old) in sum.iter().zip(&mut mesh.normals) {
        *old = n.try_normalize().unwrap_or(*old);
    }
}

/// The place on the sphere of texture coordinates of [`shapes::sphere`].
fn on_sphere(u: f32, v: f32) -> Vec3 {
    let (phi, theta) = (TAU * (0.5 - u), PI * v);
    Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
}

/// Figure 8: a sphere of marble with raised veins, by Kautz and Seidel's technique, against paths on the
/// displaced sphere.
pub fn sphere(o: &Options) -> Result<()> {
    // Height of a vein over the circumference.
    const RELIEF: f32 = 0.003;
    const SIZE: (usize, usize) = (1024, 512);
    let specs = ["ward:ax=0.35,ay=0.35,rs=0.05,rd=0.8", "ward:ax=0.08,ay=0.3,rs=0.35,rd=0.1"];
    let raised = |d: Vec3| 1.0 - veins(1.2 * d);
    let vein = |u: f32, v: f32| raised(on_sphere(u, v)) > 0.5;
    let pick = |u: f32, v: f32, plain: [f32; 3], rich: [f32; 3]| if vein(u, v) { rich } else { plain };
    let planes = Planes::default()
        .with("height", texture(SIZE.0, SIZE.1, |u, v| [raised(on_sphere(u, v)); 3])?)
        .with("widths", texture(SIZE.0, SIZE.1, |u, v| pick(u, v, [0.35, 0.35, 0.0], [0.08, 0.3, 0.0]))?)
        .with("specular", texture(SIZE.0, SIZE.1, |u, v| pick(u, v, [0.05; 3], [0.35, 0.28, 0.16]))?)
        .with("albedo", texture(SIZE.0, SIZE.1, |u, v| pick(u, v, [0.8, 0.78, 0.74], [0.1, 0.06, 0.04]))?);
    let mut smooth = scene(o, shapes::sphere(192), specs[0], from(35.0, 60.0))?;
    let mut displaced = shapes::sphere(640);
    for (p, n) in displaced.positions.iter_mut().zip(&displaced.normals) {
        *p += RELIEF * TAU * raised(*n) * *n;
    }
    displaced.materials = displaced
        .triangles
        .iter()
        .map(|t| {
            let centre: Vec3 = t.iter().map(|i| displaced.normals[*i as usize]).sum();
            u32::from(raised(centre.normalize_or_zero()) > 0.5)
        })
        .collect();
    smoothed(&mut displaced);
    let rich = steradian_brdf::parse("ward:ax=0.08,ay=0.3,rs=0.35/0.28/0.16,rd=0.1/0.06/0.04")?;
    let plain = steradian_brdf::parse("ward:ax=0.35,ay=0.35,rs=0.05,rd=0.8/0.78/0.74")?;
    let mut truth = scene(o, displaced, specs[0], smooth.lights.clone())?;
    truth.materials = vec![Material::new(plain), Material::new(rich)];
    let camera = Camera::Pinhole { from: Vec3::new(0.3, 0.6, 4.0), at: Vec3::ZERO, up: Vec3::Y, fov_y: 0.56 };
    (smooth.camera, truth.camera) = (Some(camera), Some(camera));
    say(
        "STAR04 figure 8: marble with raised veins, the light turning, relative RMS error beside paths on the displaced sphere",
    );
    let spec = format!("shift_variant:relief={RELIEF}");
    let mut rows = Vec::new();
    for azimuth in [100.0, 60.0, 20.0] {
        (smooth.lights, truth.lights) = (from(35.0, azimuth), from(35.0, azimuth));
        let films = [
            ("shift_variant".to_string(), film(&smooth, &Shading::Local(&spec, planes.clone()))?),
            ("paths on the displaced sphere".into(), film(&truth, &Shading::Paths(1))?),
        ];
        rows.push(row(&format!("light at {azimuth}°"), &films, DARKER)?);
    }
    let subtitle = "Ward's model with widths, factors and normals by texel; shadows are left out";
    save(o, "star04-8.png", &sheet("Raised veins", subtitle, rows).draw())
}

/// Bumps on a plane and the displaced plane, seen from above, under a light at (elevation, azimuth); with
/// their heights.
pub fn bump_scene(o: &Options, side: usize, light: (f64, f64)) -> Result<(Scene, Scene, Planes)> {
    const TILES: f64 = 3.0;
    const TEXELS: usize = 128;
    const SPEC: &str = "lambert:albedo=0.75/0.7/0.6";
    // Nine hemispheres a tile, of three sizes.
    let height = |u: f32, v: f32| -> f32 {
        let bump = |k: usize| {
            let centre = Vec2::new((k % 3) as f32 + 0.5, (k / 3) as f32 + 0.5) / 3.0;
            let radius = [0.155, 0.11, 0.135][(k * 7 + k / 3) % 3];
            let d = (Vec2::new(u.rem_euclid(1.0), v.rem_euclid(1.0)) - centre).length() / radius;
            if d < 1.0 { (1.0 - d * d).sqrt() * radius / 0.155 } else { 0.0 }
        };
        (0..9).map(bump).fold(0.0, f32::max)
    };
    let planes = Planes::default().with("height", texture(TEXELS, TEXELS, |u, v| [height(u, v); 3])?);
    let tiled = |segments: u32| {
        let mut mesh = shapes::plane(TILES, 0.0, segments);
        mesh.uvs.iter_mut().for_each(|uv| *uv *= TILES as f32);
        mesh
    };
    let spec = o.brdfs.first().map_or(SPEC, String::as_str);
    let mut flat = scene(o, tiled(8), spec, from(light.0, light.1))?;
    [flat.settings.width, flat.settings.height] = [side; 2];
    // Seen from above nothing hides behind a bump, which no technique on the plane would know.
    let above = Vec3::new(0.0, 3.0, 0.0);
    flat.camera = Some(Camera::Orthographic { from: above, at: Vec3::ZERO, up: Vec3::NEG_Z, height: 1.2 });
    let mut displaced = tiled(3 * 2 * TEXELS as u32);
    for (p, uv) in displaced.positions.iter_mut().zip(&displaced.uvs) {
        p.y += BUMPS * height(uv.x, uv.y);
    }
    smoothed(&mut displaced);
    let truth = Scene { mesh: displaced, ..flat.clone() };
    Ok((flat, truth, planes))
}

/// Figure 9: bumps under a light that moves; without shadows, with them, with light from bump to bump.
pub fn bumps(o: &Options) -> Result<()> {
    say(
        "STAR04 figure 9: bumps under a light that moves, relative RMS error beside paths on the displaced plane",
    );
    let way = |more: &str| format!("bump_horizon:relief={BUMPS},{more}");
    let ways = [
        ("no shadows", way("shadow=none"), 1),
        ("ellipses", way("shadow=ellipse"), 1),
        ("horizons", way("shadow=horizon,azimuths=32"), 1),
        ("horizons, two reflections more", way("shadow=horizon,azimuths=32,bounces=2,directions=128"), 3),
    ];
    let mut rows = Vec::new();
    for (elevation, azimuth) in [(70.0, 0.0), (40.0, 30.0), (20.0, 60.0)] {
        let (flat, truth, planes) = bump_scene(o, o.side.unwrap_or(SIDE), (elevation, azimuth))?;
        let mut shown: Vec<Option<Cell>> = Vec::new();
        let label = format!("{elevation}° high");
        for bounces in [1, 3] {
            let mut films = Vec::new();
            for (name, spec, _) in ways.iter().filter(|w| w.2 == bounces) {
                films.push(((*name).to_string(), film(&flat, &Shading::Local(spec, planes.clone()))?));
            }
            let name = if bounces == 1 { "paths, direct light" } else { "paths, three reflections" };
            films.push((name.into(), film(&truth, &Shading::Paths(bounces))?));
            shown.extend(row(&label, &films, DARKER)?.cells);
        }
        rows.push(Row { label: vec![label], cells: shown });
    }
    let subtitle = "height field on a plane against the displaced plane, one directional light";
    save(o, "star04-9.png", &sheet("Bumps in moving light", subtitle, rows).draw())
}

/// Figures 15 and 23: a bust in a diffuse environment map, and with self-shadowing.
pub fn bust(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, "environments/latlong/probulator_ennis.hdr")?;
    let scene =
        scene(o, mesh::bust()?, o.brdfs.first().map_or("lambert:albedo=0.8", String::as_str), lights)?;
    say(&format!(
        "STAR04 figures 15 and 23: a bust under {name}, relative RMS error beside paths of one reflection"
    ));
    let ways = [
        ("figure 15: diffuse_map", Shading::Global("diffuse_map", "")),
        ("figure 23: prt_diffuse", Shading::Global("prt_diffuse", "")),
        ("paths, direct light", Shading::Paths(1)),
    ];
    let films = films(&scene, &ways)?;
    let rows = vec![row("bust", &films, 0.0)?];
    let subtitle =
        format!("Lambert's reflectance under {name}: the same vertices without and with what the bust hides");
    save(o, "star04-15.png", &sheet("Self-shadowing", &subtitle, rows).draw())
}
