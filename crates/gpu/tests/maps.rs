//! Lobes per point, and pictures of surfaces with normal, roughness and colour maps: GPU against CPU.
//!
//! Without an adapter the tests show as ignored; `STERADIAN_REQUIRE_GPU=1` (CI sets it) makes that a failure.
//! `STERADIAN_KEEP=FOLDER` keeps the pictures.

mod common;

use common::{Case, case, gpu, scene};
use glam::{Affine3A, DVec3, Quat, Vec3};
use libtest_mimic::{Arguments, Failed, Trial};
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_formats::mesh::Wrap;
use steradian_gpu::scene::{self as shown, Path, Rate};
use steradian_gpu::{ComputeTechnique, Renderer};
use steradian_render::metrics::{DEFAULT_PPD, flip_displays};
use steradian_render::tone::auto_exposure;
use steradian_render::{
    Background, BakeShader, Develop, Film, NormalFiltering, NormalMap, Settings, Stage, Surface, SurfaceMaps,
    Texture, ToneMapper,
};
use steradian_scene::{Bvh, Mesh, shapes};
use steradian_sphere::Frame;
use steradian_techniques::{AnyBake, Material, PointLobe, PointsBuf, Radiance, find, registry};

/// Largest |GPU − CPU| over |CPU|, or over a hundredth of the brightest where that is more.
const POINT_BOUND: f32 = 1e-3;
/// Mean FLIP between the CPU's and the GPU's picture: the raster path of an H100 places samples of unfiltered
/// bumps .0102 away.
const BOUND: f32 = 0.012;
const SIDE: usize = 128;

fn bake(slug: &str, case: &Case, spec: &str) -> Result<Box<dyn AnyBake>, Failed> {
    let technique = find(slug).ok_or("no such technique")?;
    let material = Material::new(steradian_brdf::parse(spec)?);
    Ok(technique.draft(&case.lights, &material, None, &ParamValues::default(), &Task::quiet())?)
}

/// Lobes of every kind: plain, sharp, rough, round and long spreads.
fn lobes() -> Vec<PointLobe> {
    let mut out = vec![PointLobe::PLAIN];
    for alpha in [-1.0, 0.0009, 0.04, 0.3, 1.0] {
        for spread in [[0.0; 3], [1e-4, 5e-5, 4e-5], [0.02, 0.0, 0.0], [0.01, -0.015, 0.03], [0.2, 0.1, 0.15]]
        {
            out.push(PointLobe { alpha, spread, ..PointLobe::PLAIN });
        }
        out.push(PointLobe { alpha, widen: 0.05, least: 0.02, ..PointLobe::PLAIN });
        out.push(PointLobe { alpha, least: 0.4, spread: [0.0, 0.0, 0.004], ..PointLobe::PLAIN });
    }
    out
}

fn points() -> PointsBuf {
    let mut out = PointsBuf::default();
    let lobes = lobes();
    let mut k = 0;
    for i in 0..97 {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / 97.0;
        let r = (1.0 - y * y).sqrt();
        let phi = 2.399_963_229_728_653 * f64::from(i);
        let n = DVec3::new(r * phi.cos(), y, r * phi.sin());
        let f = Frame::from_normal(n);
        for theta in [0.0_f64, 0.4, 1.0, 1.4, 1.55, 1.6] {
            let a = 0.7 + f64::from(i);
            let wo = f.to_world(DVec3::new(theta.sin() * a.cos(), theta.sin() * a.sin(), theta.cos()));
            for _ in 0..3 {
                let at = [n, f.t, wo, DVec3::ZERO].map(|v| v.as_vec3());
                out.push_lobe(at, lobes[k % lobes.len()]);
                k += 1;
            }
        }
    }
    // Through every switch of the number of taps.
    let f = Frame::from_normal(DVec3::new(0.36, 0.48, 0.8));
    for i in 0..3000 {
        let theta = 1.56 * f64::from(i) / 3000.0;
        let wo = f.to_world(DVec3::new(theta.sin() * 0.8, theta.sin() * 0.6, theta.cos()));
        let spread = [[0.01, 0.0, 0.01], [0.002, 0.001, 0.004], [0.2, 0.02, 0.15]][i as usize % 3];
        let lobe = PointLobe { spread, ..PointLobe::PLAIN };
        out.push_lobe([f.n, f.t, wo, DVec3::ZERO].map(|v| v.as_vec3()), lobe);
    }
    out
}

fn parity(slug: &str, spec: &str) -> Result<(), Failed> {
    let gpu = gpu()?;
    let bake = bake(slug, &case(1, SIDE), spec)?;
    let Some(technique) = bake.gpu_varied() else { return Ok(()) };
    let points = points();
    let mut cpu: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
    bake.shade(&points.as_points(), &mut Radiance::of(&mut cpu));
    let twin = ComputeTechnique::new(gpu, &technique)?.shade(gpu, &points)?;
    let scale = cpu.iter().flatten().fold(0.0_f32, |a, x| a.max(x.abs()));
    let mut worst = (0.0, String::new());
    for (k, (a, b)) in cpu.iter().zip(&twin).enumerate() {
        for (i, (x, y)) in a.iter().zip(b).enumerate() {
            let off = (x - y).abs() / x.abs().max(1e-2 * scale);
            if off > worst.0 || off.is_nan() {
                worst = (off, format!("point {i}, channel {k}: CPU {x}, GPU {y} ({off:.1e} apart)"));
            }
        }
    }
    if scale > 0.0 && worst.0 <= POINT_BOUND { Ok(()) } else { Err(worst.1.into()) }
}

/// Bumps of 64² texels that tile.
fn normals(wrap: [Wrap; 2], scale: f32) -> Arc<NormalMap> {
    let height = |i: usize| {
        let (u, v) = ((i % 64) as f32 / 64.0, (i / 64) as f32 / 64.0);
        let wave = |a: f32, b: f32| (std::f32::consts::TAU * (a * u + b * v)).sin() / a.hypot(b);
        3.0 * wave(3.0, 1.0) + 3.0 * wave(2.0, -4.0) + 2.0 * wave(9.0, 1.0)
    };
    let heights: Vec<f32> = (0..64 * 64).map(height).collect();
    Arc::new(NormalMap::from_heights(64, 64, &heights, scale).expect("a square of heights").with_wrap(wrap))
}

fn texture(f: impl Fn(usize, usize) -> [f32; 3], wrap: [Wrap; 2]) -> Arc<Texture> {
    let texels: Vec<[f32; 3]> = (0..32 * 32).map(|i| f(i % 32, i / 32)).collect();
    let planes = [0, 1, 2].map(|c| texels.iter().map(|t| t[c]).collect());
    Arc::new(Texture::new(32, 32, &planes).expect("a square").with_wrap(wrap))
}

/// The CPU's picture of `mesh` moved by `map`, and the GPU's, at 16 samples a pixel: maps vary within a
/// pixel, and the two place their samples differently.
fn pictures(
    name: &str,
    slug: &str,
    spec: &str,
    (mesh, map): (Mesh, Affine3A),
    base_colour: Option<Arc<Texture>>,
    maps: &SurfaceMaps,
) -> Result<(), Failed> {
    let gpu = gpu()?;
    // The studio's edges, mirrored by bumps, show where each renderer places its samples: there the overcast
    // sky is the light.
    let smooth = slug == "mirror_map" || name == "everything";
    let mut case = case(if smooth { 2 } else { 1 }, SIDE);
    let bake = bake(slug, &case, spec)?;
    let technique = bake.gpu_varied().unwrap_or_else(|| bake.gpu());
    let world = mesh.clone().transformed(&map);
    case.mesh = (world.clone(), Bvh::build(&world));
    let mut drawn = scene(&case, technique);
    drawn.objects[0] = shown::Object {
        triangles: Arc::new(shown::Triangles::of(&mesh, |_| true)),
        base_colour: base_colour.clone(),
        maps: maps.clone(),
        transform: map,
        ..drawn.objects[0].clone()
    };
    let surfaces = [Surface { shader: Arc::new(BakeShader(bake)), base_colour, maps: maps.clone() }];
    let background = Background::Sky(case.backdrop.clone());
    let stage = Stage {
        mesh: &case.mesh.0,
        bvh: &case.mesh.1,
        surfaces: &surfaces,
        background: &background,
        camera: case.camera,
    };
    let truth = steradian_render::render(
        &stage,
        &Settings { inner: 4, ..Settings::new(SIDE, SIDE) },
        &Task::quiet(),
    )?;
    let mut off = Vec::new();
    for path in [Path::Raster, Path::Compute] {
        let settings =
            shown::Settings { path, rate: Rate::Sample, scale: 2, ..shown::Settings::new(SIDE, SIDE) };
        let (p, _) = Renderer::new(gpu, drawn.clone(), &settings)?.render(gpu)?;
        let film = Film::without_background(p.width, p.height, p.rgb, p.alpha);
        let develop = Develop { ev: auto_exposure(&truth, |i| truth.alpha[i]), mapper: ToneMapper::Aces };
        let (a, b) = (develop.film(&truth), develop.film(&film));
        if let Some(folder) = std::env::var_os("STERADIAN_KEEP") {
            for (picture, side) in [(&a, "cpu"), (&b, "gpu")] {
                common::keep(std::path::Path::new(&folder), &format!("{name}-{path:?}-{side}"), picture);
            }
        }
        let flip = flip_displays(&a, &b, DEFAULT_PPD).mean as f32;
        if flip > BOUND || flip.is_nan() {
            off.push(format!("{path:?}: FLIP {flip:.4}"));
        }
    }
    if off.is_empty() { Ok(()) } else { Err(off.join(", ").into()) }
}

/// A bumpy ball whose bumps are finer than samples, so that filtering decides the picture.
fn ball(slug: &str, spec: &str, filtering: NormalFiltering) -> Result<(), Failed> {
    let mut mesh = shapes::sphere(64);
    mesh.uvs.iter_mut().for_each(|uv| *uv *= glam::Vec2::new(1024.0, 512.0));
    let maps =
        SurfaceMaps { normal: Some(normals([Wrap::Repeat; 2], 1.0)), filtering, ..SurfaceMaps::default() };
    let name = format!("ball-{slug}-{filtering:?}");
    pictures(&name, slug, spec, (mesh, Affine3A::IDENTITY), None, &maps)
}

/// A mirrored, sheared copy with maps that repeat, mirror and end, roughness that varies, and vertex colours.
fn everything() -> Result<(), Failed> {
    let mut mesh = shapes::by_name("knot").map_err(|e| e.to_string())?;
    mesh.uvs.iter_mut().for_each(|uv| *uv = *uv * glam::Vec2::new(4.0, 1.5) - 0.3);
    mesh.colors = mesh.positions.iter().map(|p| (*p * 0.5 + 0.5).clamp(Vec3::ZERO, Vec3::ONE)).collect();
    let map = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.7), Vec3::new(0.1, 0.0, 0.0))
        * Affine3A::from_scale(Vec3::new(-1.0, 1.2, 0.8));
    let checks = texture(
        |x, y| if (x / 8 + y / 8) % 2 == 0 { [1.0; 3] } else { [0.7, 0.8, 0.9] },
        [Wrap::Mirror, Wrap::Clamp],
    );
    let alpha2 = texture(|x, _| [(0.1 + 0.3 * x as f32 / 31.0f32).powi(2); 3], [Wrap::Mirror, Wrap::Repeat]);
    let maps = SurfaceMaps {
        normal: Some(normals([Wrap::Repeat, Wrap::Mirror], 0.3)),
        alpha2: Some(alpha2),
        ..SurfaceMaps::default()
    };
    pictures("everything", "split_sum", "ggx:alpha=0.15,f0=1.0/0.77/0.34", (mesh, map), Some(checks), &maps)
}

/// Vertex colours alone.
fn colours() -> Result<(), Failed> {
    let mut mesh = shapes::sphere(48);
    mesh.colors = mesh.positions.iter().map(|p| (*p * 0.5 + 0.5).clamp(Vec3::ZERO, Vec3::ONE)).collect();
    let maps = SurfaceMaps::default();
    pictures("colours", "sh_irradiance", "lambert:albedo=0.8", (mesh, Affine3A::IDENTITY), None, &maps)
}

fn main() {
    common::with_unoptimised_shaders();
    let arguments = Arguments::from_args();
    let required = std::env::var_os("STERADIAN_REQUIRE_GPU").is_some();
    let ignored = gpu().is_err() && !required;
    let mut trials = vec![Trial::test("everything", everything), Trial::test("colours", colours)];
    for t in registry().iter().filter(|t| !t.card().needs.sites) {
        for spec in t.card().specimens {
            let slug = t.card().slug;
            trials.push(Trial::test(format!("lobes::{slug}::{spec}"), move || parity(slug, spec)));
        }
    }
    for (slug, spec) in [
        ("split_sum", "ggx:alpha=0.04,f0=0.9/0.92/0.94"),
        ("mirror_map", "ggx:alpha=0.002,f0=0.9/0.6/0.3"),
        ("phong_diffuse_maps", "phong:n=50"),
        ("diffuse_map", "lambert:albedo=0.8"),
    ] {
        for (name, filtering) in NormalFiltering::ALL {
            let test = move || ball(slug, spec, filtering);
            trials.push(Trial::test(format!("ball::{slug}::{name}"), test));
        }
    }
    let trials = trials.into_iter().map(|t| t.with_ignored_flag(ignored)).collect();
    libtest_mimic::run(&arguments, trials).exit();
}
