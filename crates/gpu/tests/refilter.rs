//! Refiltering on the GPU against the CPU's exact filter, and techniques lit by it against techniques baked
//! anew.
//!
//! Without an adapter the tests show as ignored; `STERADIAN_REQUIRE_GPU=1` (CI sets it) makes that a failure.

mod common;
#[path = "common/light.rs"]
mod light;

use common::gpu;
use glam::{DVec3, Mat3, Vec3};
use libtest_mimic::{Arguments, Failed, Trial};
use steradian_base::{ParamValues, Task};
use steradian_gpu::refilter::{Budget, Follower, Level, Method, Plan, Refilter, Surroundings, ggx_levels};
use steradian_gpu::scene::{Backdrop, Filter, Scene, Settings};
use steradian_gpu::{ComputeTechnique, Gpu, Renderer};
use steradian_light::{Environment, Lights};
use steradian_prefilter::{Cosine, EdgeCube, Source, Zonal};
use steradian_scene::Camera;
use steradian_sphere::{Frame, Layout, SphereImage};
use steradian_techniques::gpu::{Kernel, LightCube, LightTables, Shape};
use steradian_techniques::{AnyBake, Material, PointsBuf, View};

fn main() {
    let arguments = Arguments::from_args();
    let required = std::env::var_os("STERADIAN_REQUIRE_GPU").is_some();
    let ignored = gpu().is_err() && !required;
    type Test = (&'static str, fn() -> Result<(), Failed>);
    let tests: [Test; 17] = [
        ("convolution_is_within_a_percent_of_exact", convolution_is_within_a_percent_of_exact),
        ("phong_and_lambert_are_near_exact", phong_and_lambert_are_near_exact),
        ("gaussians_are_near_exact", gaussians_are_near_exact),
        ("a_real_probe_with_its_sun_is_near_exact", a_real_probe_with_its_sun_is_near_exact),
        ("suns_add_their_kernel_exactly", suns_add_their_kernel_exactly),
        ("low_bands_are_exact_by_frequency", low_bands_are_exact_by_frequency),
        ("older_ways_are_within_their_bounds", older_ways_are_within_their_bounds),
        ("a_furnace_stays_one", a_furnace_stays_one),
        ("faces_agree_on_their_edges", faces_agree_on_their_edges),
        ("harmonics_are_the_cpu_s", harmonics_are_the_cpu_s),
        ("steps_end_in_the_bits_of_one_pass", steps_end_in_the_bits_of_one_pass),
        ("the_finished_chain_stays_until_the_next", the_finished_chain_stays_until_the_next),
        ("captures_are_oriented", captures_are_oriented),
        ("split_sum_is_lit_as_by_a_new_bake", split_sum_is_lit_as_by_a_new_bake),
        ("mirrors_and_irradiance_follow", mirrors_and_irradiance_follow),
        ("whatever_is_filtered_light_follows_the_sun", whatever_is_filtered_light_follows_the_sun),
        ("what_cannot_be_is_an_error", what_cannot_be_is_an_error),
    ];
    let trials = tests.map(|(name, test)| Trial::test(name, test).with_ignored_flag(ignored));
    libtest_mimic::run(&arguments, trials.into()).exit();
}

fn level(size: u32, kernel: Kernel) -> Level {
    Level { size, kernel, gain: 1.0 }
}

fn ggx(size: u32, alpha: f64) -> Level {
    level(size, Kernel::Ggx { alpha })
}

/// The chain of `lights` in one pass.
fn refiltered(gpu: &Gpu, way: Method, levels: &[Level], lights: &Lights) -> Result<Refilter, Failed> {
    let mut refilter = Refilter::new(gpu, Plan::new(way, levels)?)?;
    refilter.set_light(Surroundings::from_lights(gpu, lights)?);
    refilter.run(gpu)?;
    Ok(refilter)
}

/// Every level's error, and a failure where one exceeds its bound.
fn within(way: Method, levels: &[Level], lights: &Lights, bounds: &[f64]) -> Result<(), Failed> {
    within_at(250, way, levels, lights, bounds)
}

/// The error over `most` samples of a level.
fn within_at(
    most: usize,
    way: Method,
    levels: &[Level],
    lights: &Lights,
    bounds: &[f64],
) -> Result<(), Failed> {
    let gpu = gpu()?;
    let cubes = refiltered(gpu, way, levels, lights)?.read(gpu)?;
    let tree = light::tree(lights);
    let errors = levels.iter().zip(&cubes).map(|(l, c)| light::error(c, l, &tree, most));
    let errors: Vec<_> = errors.map(Option::unwrap_or_default).collect();
    if errors.iter().zip(bounds).all(|(e, b)| e <= b) { Ok(()) } else { Err(format!("{errors:?}").into()) }
}

fn convolution_is_within_a_percent_of_exact() -> Result<(), Failed> {
    let levels = [ggx(64, 0.04), ggx(32, 0.16), ggx(16, 0.36), ggx(16, 0.64), ggx(16, 1.0)];
    within(Method::Convolution, &levels, &light::room_with_window(), &[0.006; 5])
}

fn phong_and_lambert_are_near_exact() -> Result<(), Failed> {
    let phong = |n| level(32, Kernel::Phong { n });
    let levels = [phong(200.0), phong(20.0), level(16, Kernel::Lambert)];
    within(Method::Convolution, &levels, &light::room_with_window(), &[0.015, 0.005, 0.005])
}

/// The chain of Green, Kautz & Durand 2007, widths doubling from a degree, with a sun.
fn gaussians_are_near_exact() -> Result<(), Failed> {
    let gaussian = |degrees: f64| Kernel::Gaussian { sigma: degrees.to_radians() };
    let levels = [(128, 1.0), (128, 2.0), (64, 4.0), (32, 8.0), (16, 16.0), (16, 32.0), (16, 64.0)];
    let levels = levels.map(|(size, degrees)| level(size, gaussian(degrees)));
    // The first two take software adapters most of the time.
    let few = gpu()?.is_software() && !steradian_testkit::full();
    let levels = if few { &levels[2..] } else { &levels };
    if !few {
        within(Method::Convolution, levels, &light::room_with_window(), &[0.02; 7])?;
    }
    within(Method::Convolution, levels, &light::with_sun(light::room_with_window()), &[0.02; 7])
}

/// A beach whose sun is a handful of texels ten thousand times as bright as all others.
fn a_real_probe_with_its_sun_is_near_exact() -> Result<(), Failed> {
    let Some(path) = steradian_testkit::data("environments/spiaggia_1024x512.exr") else { return Ok(()) };
    let lights = steradian_light::load::load(&path, &Default::default())?.into_environment().into();
    let levels = [ggx(64, 0.04), ggx(32, 0.16), ggx(16, 0.36), ggx(16, 1.0)];
    // The samples next to the sun hold most of the energy: over 8000 samples the errors are 0.009 to 0.010.
    within_at(750, Method::Convolution, &levels, &lights, &[0.015; 4])
}

fn suns_add_their_kernel_exactly() -> Result<(), Failed> {
    let dark = SphereImage::new(Layout::LatLong, 16, 8);
    let lights = light::with_sun(Environment { image: dark }.into());
    let levels = [ggx(32, 0.04), ggx(16, 0.3), level(16, Kernel::Lambert)];
    within(Method::Box, &levels, &lights, &[1e-3; 3])
}

/// Light of bands 0 to 2: nothing is left out.
fn low_bands_are_exact_by_frequency() -> Result<(), Failed> {
    let image = SphereImage::from_fn(Layout::LatLong, 512, 256, |d| {
        [2.0 + d.x, 1.5 + d.y * d.z, 3.0 - d.z + 0.5 * d.x * d.y].map(|x| x as f32)
    });
    let levels = [ggx(32, 0.1), level(16, Kernel::Phong { n: 30.0 }), level(16, Kernel::Lambert)];
    within(Method::Frequency, &levels, &Environment { image }.into(), &[1e-3; 3])
}

fn older_ways_are_within_their_bounds() -> Result<(), Failed> {
    let lights = light::room_with_window();
    within(Method::Frequency, &[ggx(16, 0.36), ggx(16, 1.0)], &lights, &[0.02, 0.005])?;
    let levels = [ggx(64, 0.04), ggx(32, 0.16), ggx(16, 0.36)];
    within(Method::Box, &levels, &lights, &[0.16, 0.25, 0.3])?;
    within(Method::Paraboloid, &levels, &lights, &[0.1, 0.1, 0.1])
}

fn a_furnace_stays_one() -> Result<(), Failed> {
    let gpu = gpu()?;
    let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |_| [2.0, 1.0, 0.5]);
    for way in [Method::Box, Method::Convolution, Method::Paraboloid, Method::Frequency] {
        let lights = Environment { image: image.clone() }.into();
        for cube in refiltered(gpu, way, &ggx_levels(32, 4), &lights)?.read(gpu)? {
            let off =
                |t: &[f32; 4]| (t[0] / 2.0 - 1.0).abs().max((t[1] - 1.0).abs()).max((t[2] * 2.0 - 1.0).abs());
            let worst = cube.texels().iter().map(off).fold(0.0, f32::max);
            if worst > 5e-4 {
                return Err(format!("{way:?}, {}²: {worst}", cube.size()).into());
            }
        }
    }
    Ok(())
}

/// Samples that faces share have the same bits.
fn faces_agree_on_their_edges() -> Result<(), Failed> {
    let gpu = gpu()?;
    let levels = [level(32, Kernel::Mirror), ggx(16, 0.2)];
    for way in [Method::Box, Method::Convolution, Method::Paraboloid, Method::Frequency] {
        for cube in refiltered(gpu, way, &levels, &light::with_sun(light::room_with_window()))?.read(gpu)? {
            let (n, row) = (cube.size(), cube.size() + 1);
            let mut seen = std::collections::HashMap::new();
            for (k, t) in cube.texels().iter().enumerate() {
                let d = steradian_prefilter::edge_cube::direction(n, k / (row * row), k % row, k / row % row);
                let key = d.to_array().map(f64::to_bits);
                if *seen.entry(key).or_insert(t) != t {
                    return Err(format!("{way:?}, {n}²: {d} has two values").into());
                }
            }
        }
    }
    Ok(())
}

fn harmonics_are_the_cpu_s() -> Result<(), Failed> {
    let gpu = gpu()?;
    let lights = light::with_sun(light::room_with_window());
    let order = 15;
    for way in [Method::Convolution, Method::Frequency] {
        let got = refiltered(gpu, way, &[ggx(16, 0.2)], &lights)?.harmonics(gpu)?;
        let exact = Source::new(&lights, order, &Task::quiet())?.coefficients(order);
        if got.order != order {
            return Err(format!("{way:?}: order {}", got.order).into());
        }
        // RMS over the sphere, and over normals for irradiance.
        let cosine = Cosine.coefficients(order);
        for (what, a) in [("radiance", vec![1.0; order + 1]), ("irradiance", cosine)] {
            let (mut off, mut all) = (0.0, 0.0);
            for c in 0..3 {
                for i in 0..exact.c[c].len() {
                    let w = a[i.isqrt()].powi(2);
                    off += w * (got.c[c][i] - exact.c[c][i]).powi(2);
                    all += w * exact.c[c][i].powi(2);
                }
            }
            let off = (off / all).sqrt();
            if off > 3e-3 {
                return Err(format!("{way:?}, {what}: {off}").into());
            }
        }
    }
    Ok(())
}

fn bits(cubes: &[EdgeCube]) -> Vec<u32> {
    cubes.iter().flat_map(|c| c.texels().as_flattened()).map(|x| x.to_bits()).collect()
}

fn steps_end_in_the_bits_of_one_pass() -> Result<(), Failed> {
    let gpu = gpu()?;
    let lights = light::with_sun(light::room_with_window());
    let levels = [level(16, Kernel::Mirror), ggx(16, 0.06), ggx(16, 0.5)];
    for way in [Method::Box, Method::Convolution, Method::Paraboloid, Method::Frequency] {
        let whole = refiltered(gpu, way, &levels, &lights)?;
        let expected = bits(&whole.read(gpu)?);
        let reads: u64 = whole.plan().reads().iter().map(|r| r.2).sum();
        for budget in [Budget::Texels(reads / 7), Budget::Texels(1), Budget::Milliseconds(15.0)] {
            let mut refilter = Refilter::new(gpu, Plan::new(way, &levels)?)?;
            refilter.set_light(Surroundings::from_lights(gpu, &lights)?);
            let mut steps = 1;
            while !refilter.step(gpu, budget)? {
                steps += 1;
                if steps > 10_000 {
                    return Err("it never ends".into());
                }
            }
            if matches!(budget, Budget::Texels(1)) && way != Method::Frequency && steps < 8 {
                return Err(format!("{way:?}: {steps} steps of one tile").into());
            }
            if bits(&refilter.read(gpu)?) != expected || refilter.is_busy() {
                return Err(format!("{way:?} within {budget:?}: other bits").into());
            }
        }
    }
    Ok(())
}

fn the_finished_chain_stays_until_the_next() -> Result<(), Failed> {
    let gpu = gpu()?;
    let grey =
        |v: f32| Surroundings::from_image(gpu, &SphereImage::from_fn(Layout::LatLong, 16, 8, |_| [v; 3]));
    let mut refilter = Refilter::new(gpu, Plan::new(Method::Convolution, &ggx_levels(32, 3))?)?;
    let shown = |r: &Refilter| -> Result<f32, Failed> { Ok(r.read(gpu)?[1].texels()[7][0]) };
    let is = |r: &Refilter, v: f32| -> Result<(), Failed> {
        let shown = shown(r)?;
        if (shown - v).abs() < 1e-3 { Ok(()) } else { Err(format!("{shown}, not {v}").into()) }
    };
    if refilter.is_ready() || shown(&refilter).is_ok() {
        return Err("a chain before any light".into());
    }
    refilter.set_light(grey(1.0)?);
    refilter.run(gpu)?;
    is(&refilter, 1.0)?;
    refilter.set_light(grey(2.0)?);
    refilter.step(gpu, Budget::Texels(1))?;
    // Light that comes while another's chain is being made waits for its turn.
    refilter.set_light(grey(4.0)?);
    is(&refilter, 1.0)?;
    while !refilter.step(gpu, Budget::Texels(1))? {
        is(&refilter, 1.0)?;
    }
    is(&refilter, 2.0)?;
    refilter.run(gpu)?;
    is(&refilter, 4.0)?;
    if refilter.is_busy() || refilter.step(gpu, Budget::All)? {
        return Err("work without light".into());
    }
    Ok(())
}

/// The renderer's own backdrop, which other tests hold to the CPU's, captured from inside: every direction
/// keeps its colour.
fn captures_are_oriented() -> Result<(), Failed> {
    let gpu = gpu()?;
    let colour = |d: DVec3| [0.5 + 0.45 * d.x, 0.5 + 0.45 * d.y, 0.5 + 0.45 * d.z].map(|x| x as f32);
    let (width, height) = (256, 128);
    let image = SphereImage::from_fn(Layout::LatLong, width, height, colour);
    let texels = (0..width * height).map(|k| std::array::from_fn(|c| image.planes[c][k])).collect();
    let backdrop = steradian_gpu::scene::Level { width, height, texels };
    let camera = Camera::Pinhole { from: Vec3::ONE, at: Vec3::ZERO, up: Vec3::Y, fov_y: 0.3 };
    let scene = Scene {
        objects: Vec::new(),
        direct: Default::default(),
        volumes: None,
        backdrop: Backdrop { image: Some(backdrop), ..Backdrop::default() },
        camera,
        light_rotation: Mat3::IDENTITY,
    };
    let settings = Settings { filter: Filter::Mean, ..Settings::new(64, 64) };
    let mut renderer = Renderer::new(gpu, scene, &settings)?;
    let captured = Surroundings::captured(gpu, &mut renderer, Vec3::new(3.0, 1.0, -2.0))?;
    assert_eq!(renderer.camera(), camera);
    let mut refilter =
        Refilter::new(gpu, Plan::new(Method::Convolution, &[level(32, Kernel::Mirror), ggx(16, 0.1)])?)?;
    refilter.set_light(captured);
    refilter.run(gpu)?;
    let cubes = refilter.read(gpu)?;
    for (cube, bound) in cubes.iter().zip([0.01, 0.03]) {
        for k in 0..500 {
            let d = steradian_prefilter::probe::direction(k, 500);
            let (got, want) = (cube.sample(d.as_vec3().to_array()), colour(d));
            if (0..3).any(|c| (got[c] - want[c]).abs() > bound) {
                return Err(format!("{}²: {d} shows {got:?}, not {want:?}", cube.size()).into());
            }
        }
    }
    let settings = Settings { filter: Filter::Mean, ..Settings::new(32, 16) };
    let scene = Scene {
        objects: vec![],
        direct: Default::default(),
        volumes: None,
        backdrop: Backdrop::default(),
        camera,
        light_rotation: Mat3::IDENTITY,
    };
    let oblong = Surroundings::captured(gpu, &mut Renderer::new(gpu, scene, &settings)?, Vec3::ZERO);
    assert!(oblong.err().is_some_and(|e| e.to_string().contains("square")));
    Ok(())
}

/// Points over a sphere seen from many sides.
fn points() -> PointsBuf {
    let mut out = PointsBuf::default();
    for k in 0..1500 {
        let n = steradian_prefilter::probe::direction(k, 1500);
        let f = Frame::from_normal(n);
        let (theta, phi) = (0.2 + 1.1 * f64::from(k as u32 % 7) / 6.0, k as f64);
        let wo = f.to_world(DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()));
        out.push(n.as_vec3(), f.t.as_vec3(), wo.as_vec3(), Vec3::ZERO);
    }
    out
}

/// Relative RMS difference over all channels.
fn apart(a: &[Vec<f32>; 3], b: &[Vec<f32>; 3]) -> f64 {
    let pairs = || a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (f64::from(*a), f64::from(*b)));
    let (off, all) = pairs().fold((0.0, 0.0), |(o, w), (a, b)| (o + (a - b).powi(2), w + b * b));
    (off / all).sqrt()
}

fn bake(slug: &str, spec: &str, lights: &Lights) -> Result<Box<dyn AnyBake>, Failed> {
    bake_with(slug, spec, lights, &ParamValues::default())
}

fn bake_with(
    slug: &str,
    spec: &str,
    lights: &Lights,
    values: &ParamValues,
) -> Result<Box<dyn AnyBake>, Failed> {
    let t = steradian_techniques::find(slug).ok_or("no such technique")?;
    let material = Material::new(steradian_brdf::parse(spec)?);
    Ok(t.draft(lights, &material, None, values, &Task::quiet())?)
}

/// A technique baked for a plain sky, given the chain that the GPU makes of other light, shades as one baked
/// for that.
fn split_sum_is_lit_as_by_a_new_bake() -> Result<(), Failed> {
    let gpu = gpu()?;
    let (before, after) = (steradian_light::sky::by_name("overcast", 128, 64)?, light::room_with_window());
    let before: Lights = Environment { image: before.image }.into();
    let points = points();
    let kinds = [("ggx:alpha=0.09,f0=1/0.8/0.4", true), ("ggx:alpha=0.25,f0=0.9/0.6/0.3", false)];
    // Software adapters filter the sharper one, under a sun.
    let count = if gpu.is_software() && !steradian_testkit::full() { 1 } else { 2 };
    for (spec, sun) in kinds.into_iter().take(count) {
        let after = if sun { light::with_sun(after.clone()) } else { after.clone() };
        // Level 0 is as fine as the sky otherwise, on which software adapters take most of the time.
        let few = gpu.is_software() && !steradian_testkit::full();
        let (size, count) = if few { (64, 5.0) } else { (128, 10.0) };
        let values: ParamValues = [("size", f64::from(size)), ("levels", count)].into_iter().collect();
        let mut baked = bake_with("split_sum", spec, &before, &values)?;
        let mut technique = baked.gpu();
        let chain =
            technique.tables.iter().find(|t| matches!(t.shape, Shape::EdgeCubeChain(_))).ok_or("no chain")?;
        let Shape::EdgeCubeChain(places) = &chain.shape else { return Err("no chain".into()) };
        let (name, count) = (chain.name, places.len());
        let levels = ggx_levels(size, count);
        let plan = Plan::new(Method::Convolution, &levels)?;
        plan.install(&mut technique, name)?;
        let twin = ComputeTechnique::new(gpu, &technique)?;
        let mut refilter = Refilter::new(gpu, plan)?;
        refilter.set_light(Surroundings::from_lights(gpu, &after)?);
        while !refilter.step(gpu, Budget::Texels(5_000_000))? {}
        refilter.deliver(gpu, twin.data(), name)?;
        let lit = twin.shade(gpu, &points)?;
        baked = baked.preview(Some(&after), None, &Task::quiet())?;
        let expected = ComputeTechnique::new(gpu, &baked.gpu())?.shade(gpu, &points)?;
        let off = apart(&lit, &expected);
        if off > 0.01 || off.is_nan() {
            return Err(format!("{spec}: {off} apart").into());
        }
    }
    Ok(())
}

fn mirrors_and_irradiance_follow() -> Result<(), Failed> {
    let gpu = gpu()?;
    let plain: Lights =
        Environment { image: SphereImage::from_fn(Layout::LatLong, 64, 32, |_| [1.0; 3]) }.into();
    let after = light::with_sun(light::room_with_window());
    let points = points();
    // The technique's own table, as large as its bake made it.
    let mut mirror = bake("mirror_map", "ggx:alpha=0.002,f0=0.9/0.6/0.3", &plain)?;
    let technique = mirror.gpu();
    let name = technique.tables[0].name;
    let size = technique.tables[0].level.width;
    let plan =
        Plan::of_table(Method::Convolution, &technique, &LightTables::cube(name, Kernel::Mirror, 1.0))?;
    let twin = ComputeTechnique::new(gpu, &technique)?;
    let mut refilter = Refilter::new(gpu, plan)?;
    refilter.set_light(Surroundings::from_lights(gpu, &after)?);
    refilter.run(gpu)?;
    refilter.deliver(gpu, twin.data(), name)?;
    let lit = twin.shade(gpu, &points)?;
    mirror = mirror.preview(Some(&after), None, &Task::quiet())?;
    let renewed = mirror.gpu();
    if renewed.tables[0].level.width != size {
        return Err("another size, another test".into());
    }
    let off = apart(&lit, &ComputeTechnique::new(gpu, &renewed)?.shade(gpu, &points)?);
    if off > 0.01 || off.is_nan() {
        return Err(format!("mirror: {off} apart").into());
    }
    // Nine coefficients, into uniforms, under a turned light.
    let albedo = [0.8f32, 0.5, 0.2];
    let mut diffuse = bake("sh_irradiance", "lambert:albedo=0.8/0.5/0.2", &plain)?;
    let twin = ComputeTechnique::new(gpu, &diffuse.gpu())?;
    let light_rotation = Mat3::from_rotation_y(0.8) * Mat3::from_rotation_x(0.4);
    let gain = albedo.map(|a| a / std::f32::consts::PI);
    refilter.deliver_irradiance(gpu, twin.data(), ["red", "green", "blue"], gain, light_rotation)?;
    let lit = twin.shade(gpu, &points)?;
    diffuse = diffuse.preview(Some(&after), None, &Task::quiet())?;
    diffuse.frame(&View { light_rotation, ..View::default() });
    let off = apart(&lit, &ComputeTechnique::new(gpu, &diffuse.gpu())?.shade(gpu, &points)?);
    if off > 3e-3 || off.is_nan() { Err(format!("irradiance: {off} apart").into()) } else { Ok(()) }
}

/// Every technique that says which of its data are filtered light, given another hour's by its refilters,
/// shades as one baked for that.
fn whatever_is_filtered_light_follows_the_sun() -> Result<(), Failed> {
    let gpu = gpu()?;
    let sky = |spec: &str| Lights::of_sky(spec, (128, 64));
    let (before, after) = (sky("sky:elevation=50,azimuth=20")?, sky("sky:elevation=35,azimuth=80")?);
    let light_rotation = Mat3::from_rotation_y(0.7);
    let view = View { light_rotation, ..View::default() };
    let points = points();
    let mut seen = Vec::new();
    for technique in steradian_techniques::registry() {
        let card = technique.card();
        if card.needs.sites || card.needs.view {
            continue;
        }
        // Reflectances of one technique differ in the widths of their levels, or share its chain.
        let count = if steradian_testkit::full() { card.specimens.len() } else { 1 };
        // Narrow kernels of many texels take software adapters most of the time.
        let fewer: &[(&str, &str, f64)] = match gpu.is_software() && !steradian_testkit::full() {
            true => {
                &[("gaussian_lobes", "sigma", 8.0), ("split_sum", "size", 64.0), ("split_sum", "levels", 5.0)]
            }
            false => &[],
        };
        let of_this = fewer.iter().filter(|f| f.0 == card.slug).map(|f| (f.1, f.2));
        let values: ParamValues = of_this.collect();
        for spec in card.specimens.iter().take(count) {
            let mut baked = bake_with(card.slug, spec, &before, &values)?.with_view(&view);
            let Some(tables) = baked.light_tables(false) else { break };
            let described = baked.gpu();
            let twin = ComputeTechnique::new(gpu, &described)?;
            let mut follower = Follower::new(gpu, &described, &tables)?;
            follower.set_light(&Surroundings::from_lights(gpu, &after)?);
            let mut delivered = false;
            while follower.is_busy() {
                delivered |= follower.step(gpu, Budget::Texels(5_000_000), twin.data(), light_rotation)?;
            }
            let lit = twin.shade(gpu, &points)?;
            baked = baked.preview(Some(&after), None, &Task::quiet())?;
            let off = apart(&lit, &ComputeTechnique::new(gpu, &baked.gpu())?.shade(gpu, &points)?);
            if !delivered || off > 0.02 || off.is_nan() {
                return Err(format!("{} of {spec}: {off} apart", card.slug).into());
            }
            seen.push(card.slug);
        }
    }
    seen.dedup();
    let all =
        ["sh_irradiance", "diffuse_map", "phong_diffuse_maps", "split_sum", "mirror_map", "gaussian_lobes"];
    if all.iter().all(|slug| seen.contains(slug)) { Ok(()) } else { Err(format!("only {seen:?}").into()) }
}

fn what_cannot_be_is_an_error() -> Result<(), Failed> {
    let gpu = gpu()?;
    let says = |e: Option<steradian_gpu::GpuError>, what: &str| match e {
        Some(e) if e.to_string().contains(what) => Ok(()),
        other => Err(format!("{other:?} does not say '{what}'")),
    };
    let plain: Lights =
        Environment { image: SphereImage::from_fn(Layout::LatLong, 64, 32, |_| [1.0; 3]) }.into();
    let technique = bake("mirror_map", "ggx:alpha=0.002", &plain)?.gpu();
    let twin = ComputeTechnique::new(gpu, &technique)?;
    let mut refilter = Refilter::new(gpu, Plan::new(Method::Box, &[ggx(16, 0.2)])?)?;
    says(refilter.deliver(gpu, twin.data(), technique.tables[0].name).err(), "no chain")?;
    let mut points = plain.clone();
    points.points.push(steradian_light::PointLight { position: Vec3::ONE, intensity: [1.0; 3] });
    says(Surroundings::from_lights(gpu, &points).err(), "point lights")?;
    let nan = SphereImage::from_fn(Layout::LatLong, 8, 4, |_| [f32::NAN; 3]);
    says(Surroundings::from_image(gpu, &nan).err(), "finite")?;
    let cube = SphereImage::from_fn(Layout::Cube, 8, 8, |_| [1.0; 3]);
    says(Surroundings::from_image(gpu, &cube).err(), "lat-long")?;
    refilter.set_light(Surroundings::from_lights(gpu, &plain)?);
    refilter.run(gpu)?;
    says(refilter.deliver(gpu, twin.data(), technique.tables[0].name).err(), "size")?;
    says(refilter.deliver(gpu, twin.data(), "nonsense").err(), "nonsense")?;
    says(refilter.harmonics(gpu).err(), "harmonics")?;
    let cube = |table| LightCube { table, levels: Vec::new() };
    says(Plan::of_table(Method::Box, &technique, &cube(technique.tables[0].name)).err(), "levels")?;
    says(Plan::of_table(Method::Box, &technique, &cube("nonsense")).err(), "nonsense")?;
    Ok(())
}
