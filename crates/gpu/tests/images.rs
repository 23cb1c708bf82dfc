//! Whole pictures, GPU against CPU: the demo's materials and skies, every technique that takes them, both
//! paths.
//!
//! Without an adapter the tests show as ignored; `STERADIAN_REQUIRE_GPU=1` (CI sets it) makes that a failure.
//! `STERADIAN_KEEP=FOLDER` keeps the pictures.

mod common;

use common::{Case, SCENES, case, cpu, gpu, scene};
use glam::{Affine3A, Mat3, Quat, Vec3};
use libtest_mimic::{Arguments, Failed, Trial};
use std::collections::BTreeMap;
use std::sync::Arc;
use steradian_base::Task;
use steradian_gpu::Renderer;
use steradian_gpu::scene::{Depth, Filter, Path, Picture, Rate, Settings};
use steradian_render::metrics::{DEFAULT_PPD, flip_displays};
use steradian_render::tone::auto_exposure;
use steradian_render::{Develop, Film, ToneMapper};
use steradian_scene::Camera;
use steradian_techniques::{AnyBake, Material, View, registry};

/// Mean FLIP between the CPU's and the GPU's picture.
const BOUND: f32 = 0.01;

/// A mirror's picture changes within a pixel, and so does a product of factors: shaded once, they alias.
fn is_sharp(slug: &str) -> bool {
    matches!(slug, "mirror_map" | "factored_lighting")
}

/// Width and height of a technique's pictures.
fn side(slug: &str) -> usize {
    if is_sharp(slug) || steradian_testkit::full() { 256 } else { 128 }
}

fn film(p: &Picture) -> Film {
    Film::without_background(p.width, p.height, p.rgb.clone(), p.alpha.clone())
}

/// Mean FLIP under the exposure of the first picture.
fn flip(name: &str, a: &Film, b: &Film) -> f32 {
    let covered = a.alpha.iter().any(|x| *x > 0.0);
    let ev = auto_exposure(a, |i| if covered { a.alpha[i] } else { 1.0 });
    let develop = Develop { ev, mapper: ToneMapper::Aces };
    let (a, b) = (develop.film(a), develop.film(b));
    if let Some(folder) = std::env::var_os("STERADIAN_KEEP") {
        for (picture, side) in [(&a, "cpu"), (&b, "gpu")] {
            common::keep(std::path::Path::new(&folder), &format!("{name}-{side}"), picture);
        }
    }
    flip_displays(&a, &b, DEFAULT_PPD).mean as f32
}

fn within(what: impl std::fmt::Debug, flip: f32, bound: f32) -> Result<(), Failed> {
    if flip <= bound { Ok(()) } else { Err(format!("{what:?}: FLIP {flip:.4}").into()) }
}

/// Both paths, both rates of shading. A technique's first scene is drawn in all four ways, a second one in
/// the first or the last (all scenes in all ways with STERADIAN_FULL=1).
const WAYS: [(Path, Rate); 4] = [
    (Path::Raster, Rate::Sample),
    (Path::Raster, Rate::Pixel),
    (Path::Compute, Rate::Sample),
    (Path::Compute, Rate::Pixel),
];

fn pictures(case: &Case, bake: Box<dyn AnyBake>, name: &str, ways: &[(Path, Rate)]) -> Result<(), Failed> {
    let gpu = gpu()?;
    let technique = bake.gpu();
    let side = side(technique.slug);
    let truth = cpu(case, bake, side);
    for &(path, rate) in ways {
        let settings = Settings { path, rate, ..Settings::new(side, side) };
        let (picture, _) = Renderer::new(gpu, scene(case, technique.clone()), &settings)?.render(gpu)?;
        let picture = film(&picture);
        let covered = |f: &Film| f.alpha.iter().sum::<f32>() / f.len() as f32;
        let (a, b) = (covered(&truth), covered(&picture));
        if (a - b).abs() > 2e-3 {
            return Err(format!("{path:?}: coverage {b}, on the CPU {a}").into());
        }
        let off = flip(&format!("{name}-{path:?}-{rate:?}"), &truth, &picture);
        let bound = if is_sharp(technique.slug) && rate == Rate::Pixel { 0.02 } else { BOUND };
        within((path, rate), off, bound)?;
    }
    Ok(())
}

fn technique(k: usize, slug: &'static str, ways: &[(Path, Rate)]) -> Result<(), Failed> {
    let case = case(k, side(slug));
    let technique = steradian_techniques::find(slug).ok_or("no such technique")?;
    let bake = technique.draft(
        &case.lights,
        &Material::new(case.brdf.clone()),
        None,
        &Default::default(),
        &Task::quiet(),
    )?;
    pictures(&case, bake, &format!("{k}-{slug}"), ways)
}

fn main() {
    let arguments = Arguments::from_args();
    let required = std::env::var_os("STERADIAN_REQUIRE_GPU").is_some();
    let ignored = gpu().is_err() && !required;
    let (mut trials, mut scenes) = (Vec::new(), BTreeMap::new());
    for (k, s) in SCENES.iter().enumerate() {
        let brdf = steradian_brdf::parse(s.brdf).expect("the demo's own");
        for t in registry().iter().filter(|t| !t.card().needs.sites && (t.card().materials)(&*brdf).is_ok()) {
            let slug = t.card().slug;
            let seen = scenes.entry(slug).or_insert(0);
            *seen += 1;
            let ways = match seen {
                _ if *seen == 1 || steradian_testkit::full() => &WAYS[..],
                2 if k % 2 == 0 => &WAYS[..1],
                2 => &WAYS[WAYS.len() - 1..],
                _ => continue,
            };
            trials.push(
                Trial::test(format!("{}::{slug}", s.shape), move || technique(k, slug, ways))
                    .with_ignored_flag(ignored),
            );
        }
    }
    type Test = (&'static str, fn() -> Result<(), Failed>);
    let more: [Test; 5] = [
        ("windows_in_the_backdrop_have_no_rims", windows_in_the_backdrop_have_no_rims),
        ("several_objects_and_textures", several_objects_and_textures),
        ("a_turned_light_is_an_update_of_uniforms", a_turned_light_is_an_update_of_uniforms),
        ("a_changed_material_replaces_tables", a_changed_material_replaces_tables),
        ("what_cannot_be_is_an_error", what_cannot_be_is_an_error),
    ];
    for (name, test) in more {
        trials.push(Trial::test(name, test).with_ignored_flag(ignored));
    }
    libtest_mimic::run(&arguments, trials).exit();
}

/// A mesh of two slots with textures, drawn as two objects, one of which is moved by its transform.
fn several_objects_and_textures() -> Result<(), Failed> {
    let gpu = gpu()?;
    const SIDE: usize = 256;
    let mut case = case(2, SIDE);
    let map = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.7), Vec3::new(0.4, 0.3, 0.5))
        * Affine3A::from_scale(Vec3::new(-0.5, 0.7, 0.5));
    let sphere = steradian_scene::shapes::sphere(64);
    let checks: Vec<f32> =
        (0..64 * 32).map(|i| if (i / 4 + i / 64 / 4) % 2 == 0 { 1.0 } else { 0.3 }).collect();
    let texture = steradian_render::Texture::new(64, 32, &[checks.clone(), checks, vec![0.8; 64 * 32]])
        .ok_or("empty")?;
    let texture = Arc::new(texture);
    let bake = |slug: &str| -> Result<Box<dyn AnyBake>, Failed> {
        let t = steradian_techniques::find(slug).ok_or("no such technique")?;
        let brdf = steradian_brdf::parse("lambert:albedo=0.8/0.5/0.2")?;
        Ok(t.draft(&case.lights, &Material::new(brdf), None, &Default::default(), &Task::quiet())?)
    };
    let techniques = [bake("diffuse_map")?, bake("sh_irradiance")?];
    let mut shown = scene(&case, techniques[0].gpu());
    shown.objects[0].base_colour = Some(texture.clone());
    let triangles = steradian_gpu::scene::Triangles::of(&sphere, |_| true);
    shown.objects.push(steradian_gpu::scene::Object {
        triangles: Arc::new(triangles),
        technique: techniques[1].gpu(),
        brdf: None,
        folds_suns: false,
        base_colour: Some(texture.clone()),
        maps: Default::default(),
        transform: map,
    });
    let mut first = case.mesh.0.clone();
    first.tangents.clear();
    let mut second = sphere.transformed(&map).with_material(1);
    second.tangents.clear();
    let mesh = steradian_scene::Mesh::merged(&[first, second]);
    let bvh = steradian_scene::Bvh::build(&mesh);
    case.mesh = (mesh, bvh);
    let textured = Some(texture);
    let techniques = techniques.into_iter().map(|b| (b, textured.clone())).collect();
    let fine = steradian_render::Settings { inner: 4, ..steradian_render::Settings::new(SIDE, SIDE) };
    let truth = common::cpu_of(&case, techniques, &fine);
    for path in [Path::Raster, Path::Compute] {
        let settings =
            Settings { path, rate: Rate::Sample, scale: 2, depth: Depth::Half, ..Settings::new(SIDE, SIDE) };
        let (picture, _) = Renderer::new(gpu, shown.clone(), &settings)?.render(gpu)?;
        let off = flip(&format!("several-{path:?}"), &truth, &film(&picture));
        within(path, off, BOUND)?;
    }
    Ok(())
}

fn split_sum(case: &Case, brdf: &str) -> Result<Box<dyn AnyBake>, Failed> {
    let t = steradian_techniques::find("split_sum").ok_or("no such technique")?;
    let brdf = steradian_brdf::parse(brdf)?;
    Ok(t.draft(&case.lights, &Material::new(brdf), None, &Default::default(), &Task::quiet())?)
}

fn largest_difference(a: &Picture, b: &Picture) -> f32 {
    let scale = a.rgb.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
    let pairs = a.rgb.iter().flatten().zip(b.rgb.iter().flatten());
    pairs.fold(0.0f32, |m, (x, y)| m.max((x - y).abs())) / scale
}

/// A window a thousand times as bright as its wall, in texels of eleven degrees: every pixel as on the CPU,
/// and none beyond the range of the two.
fn windows_in_the_backdrop_have_no_rims() -> Result<(), Failed> {
    let gpu = gpu()?;
    let case = case(1, 16);
    let window =
        |d: glam::DVec3| if d.x < -0.3 && d.y.abs() < 0.4 { [1000.0, 500.0, 1.0] } else { [1.0, 0.5, 100.0] };
    let image = steradian_sphere::SphereImage::from_fn(steradian_sphere::Layout::LatLong, 32, 16, window);
    let environment = Some(Arc::new(steradian_light::Environment { image }));
    let lights = steradian_light::Lights { environment, ..Default::default() };
    let behind = steradian_render::Backdrop::new(&lights, 0.0);
    let camera = Camera::Pinhole { from: Vec3::ZERO, at: Vec3::NEG_X, up: Vec3::Y, fov_y: 1.6 };
    let bake = split_sum(&case, SCENES[1].brdf)?;
    let shown = steradian_gpu::scene::Scene {
        objects: Vec::new(),
        backdrop: common::backdrop(&behind),
        camera,
        ..scene(&case, bake.gpu())
    };
    for path in [Path::Raster, Path::Compute] {
        let settings = Settings { path, filter: Filter::Mean, scale: 1, ..Settings::new(96, 96) };
        let (picture, _) = Renderer::new(gpu, shown.clone(), &settings)?.render(gpu)?;
        for k in 0..96 * 96 {
            let d = camera.ray((k % 96) as f32 + 0.5, (k / 96) as f32 + 0.5, 96, 96).direction;
            let expected = behind.radiance(d);
            for (c, [low, high]) in [[1.0, 1000.0], [0.5, 500.0], [1.0, 100.0]].into_iter().enumerate() {
                let got = picture.rgb[c][k];
                assert!((0.999 * low..=1.001 * high).contains(&got), "{path:?} {k} {c}: {got}");
                assert!((got - expected[c]).abs() < 1e-2 * high, "{path:?} {k} {c}: {got}, {}", expected[c]);
            }
        }
    }
    Ok(())
}

/// A renderer with new uniforms shows the picture of one made from the rotated bake; nothing is uploaded
/// again.
fn a_turned_light_is_an_update_of_uniforms() -> Result<(), Failed> {
    let gpu = gpu()?;
    let case = case(1, 128);
    let mut bake = split_sum(&case, SCENES[1].brdf)?;
    let settings = Settings::new(128, 128);
    let mut live = Renderer::new(gpu, scene(&case, bake.gpu()), &settings)?;
    let (before, _) = live.render(gpu)?;
    let light_rotation = Mat3::from_rotation_y(1.1);
    bake.frame(&View { light_rotation, ..common::view(&case) });
    live.update_technique(gpu, 0, &bake.gpu())?;
    live.set_light_rotation(gpu, light_rotation);
    let (turned, _) = live.render(gpu)?;
    let mut fresh = scene(&case, bake.gpu());
    fresh.light_rotation = light_rotation;
    let (expected, _) = Renderer::new(gpu, fresh, &settings)?.render(gpu)?;
    let (same, moved) = (largest_difference(&turned, &expected), largest_difference(&turned, &before));
    if same > 0.0 || moved < 0.05 {
        return Err(format!("turned light: {same} from a fresh renderer, {moved} from the unturned").into());
    }
    Ok(())
}

/// A rebaked factor replaces the tables of a running renderer, and the pipelines stay.
fn a_changed_material_replaces_tables() -> Result<(), Failed> {
    let gpu = gpu()?;
    let case = case(1, 128);
    let other = "ggx:alpha=0.4,f0=0.3/0.5/0.9";
    let mut bake = split_sum(&case, SCENES[1].brdf)?;
    let settings = Settings::new(128, 128);
    let mut live = Renderer::new(gpu, scene(&case, bake.gpu()), &settings)?;
    bake = bake.preview(None, Some(&Material::new(steradian_brdf::parse(other)?)), &Task::quiet())?;
    live.set_technique(gpu, 0, bake.gpu())?;
    let (changed, _) = live.render(gpu)?;
    let fresh = scene(&case, split_sum(&case, other)?.gpu());
    let (expected, _) = Renderer::new(gpu, fresh, &settings)?.render(gpu)?;
    let off = largest_difference(&changed, &expected);
    if off > 1e-6 { Err(format!("{off} from a fresh renderer").into()) } else { Ok(()) }
}

fn what_cannot_be_is_an_error() -> Result<(), Failed> {
    let gpu = gpu()?;
    let case = case(0, 16);
    let t = steradian_techniques::find("sh_irradiance").ok_or("no such technique")?;
    let bake =
        t.draft(&case.lights, &Material::new(case.brdf.clone()), None, &Default::default(), &Task::quiet())?;
    let fails = |scene, settings: &Settings| match Renderer::new(gpu, scene, settings) {
        Err(e) => Ok(e.to_string()),
        Ok(_) => Err("made"),
    };
    let good = scene(&case, bake.gpu());
    for (w, h) in [(0, 4), (1 << 20, 4), (16000, 16000)] {
        assert!(fails(good.clone(), &Settings::new(w, h))?.contains("limits"));
    }
    let mut empty = good.clone();
    empty.objects[0].triangles = Arc::default();
    assert!(fails(empty, &Settings::new(8, 8))?.contains("no triangles"));
    let mut broken = good.clone();
    broken.objects[0].technique.modules = vec!["fn shade(".into()];
    assert!(fails(broken, &Settings::new(8, 8))?.contains("refused"));
    let none = steradian_gpu::scene::Scene { objects: Vec::new(), ..good };
    let (picture, _) = Renderer::new(gpu, none, &Settings::new(8, 8))?.render(gpu)?;
    assert!(picture.alpha.iter().all(|a| *a == 0.0) && picture.rgb[2].iter().all(|b| *b > 0.0));
    Ok(())
}
