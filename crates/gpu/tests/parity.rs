//! Every registered technique on the GPU against its CPU twin, over grids with edge cases.
//!
//! Without an adapter the tests show as ignored; `STERADIAN_REQUIRE_GPU=1` (CI sets it) makes that a failure.

mod common;

use common::gpu;
use glam::{DVec3, Mat3, Vec2, Vec3};
use libtest_mimic::{Arguments, Failed, Trial};
use std::sync::Arc;
use steradian_base::{Kind, ParamInfo, ParamValues, Task, Value};
use steradian_gpu::{ComputeTechnique, Gpu};
use steradian_light::{DiskLight, Environment, Lights};
use steradian_scene::shadow::{Blocker, LightAt, MapOptions, ShadowMaps};
use steradian_scene::shapes;
use steradian_scene::{Bvh, Mesh};
use steradian_sphere::{Frame, Layout, SphereImage};
use steradian_techniques::direct::Shadows;
use steradian_techniques::gpu::GpuTechnique;
use steradian_techniques::gpu::shadow;
use steradian_techniques::local::{AnyLocal, LocalFrame, LocalLights, LocalShading, beside};
use steradian_techniques::shared::trials::{lights, specimens};
use steradian_techniques::{
    AnyBake, AnyTechnique, Geometry, Material, PointChart, PointsBuf, Radiance, Sites, View, locals, registry,
};

/// Largest |GPU − CPU| over the largest |CPU| of a channel-wise pair: the acceptance bound.
const BOUND: f32 = 1e-3;

/// A smooth sky with one bright window, so that no channel and no direction repeats another.
fn light() -> Lights {
    let image = SphereImage::from_fn(Layout::LatLong, 128, 64, |d| {
        let window = if d.dot(DVec3::new(0.6, 0.64, 0.48)) > 0.97 { 20.0 } else { 0.0 };
        let base = [0.6 + 0.4 * d.y, 0.5 + 0.3 * d.x, 0.7 + 0.2 * d.z * d.x];
        base.map(|b| (b + window) as f32)
    });
    Environment { image }.into()
}

/// [`light`] with a sun.
fn sunny() -> Lights {
    let direction = DVec3::new(0.5, 0.7, -0.45).normalize();
    let sun = DiskLight { direction, angular_radius: 0.02, radiance: [900.0, 800.0, 500.0] };
    Lights { disks: vec![sun], ..light() }
}

/// The parameter of techniques that shade suns separately from their maps.
const SUNS: &str = "lights";

/// The parameter of techniques with interreflection.
const BOUNCES: &str = "bounces";

/// The parameter of techniques with irradiance by normal.
const NORMALS: &str = "normals";

/// The parameter that enables shadows in techniques.
const VISIBILITY: &str = "visibility";

/// A mesh that shadows itself, for techniques with sites.
fn ring() -> Geometry {
    Geometry::new(Arc::new(shapes::torus(0.7, 0.3, 16)), Sites::Vertices)
}

/// Normals over the sphere (poles, cube edges and corners among them), views from facing to grazing and
/// behind.
fn points(sites: Option<&Geometry>) -> PointsBuf {
    let mut normals = vec![
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::X,
        DVec3::NEG_Z,
        DVec3::ONE.normalize(),
        DVec3::new(1.0, 1.0, 0.0).normalize(),
        DVec3::new(-1.0, 0.0, 1.0).normalize(),
    ];
    normals.extend((0..120).map(|i| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / 120.0;
        let phi = f64::from(i) * 2.399_963_229_728_653;
        let r = (1.0 - y * y).sqrt();
        DVec3::new(r * phi.cos(), y, r * phi.sin())
    }));
    let mut out = PointsBuf::default();
    for (i, &n) in normals.iter().enumerate() {
        let f = Frame::from_normal(n);
        for theta in [0.0_f64, 0.3, 0.9, 1.3, 1.5, 1.569, 1.6] {
            let phi = 0.7 + i as f64;
            let wo = f.to_world(DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()));
            out.push(n.as_vec3(), f.t.as_vec3(), wo.as_vec3(), Vec3::new(0.1, 0.2, 0.3));
            if let Some(triangles) = sites.map(|g| &g.mesh.triangles) {
                let corners = triangles[(7 * i) % triangles.len()];
                let weight = 0.9 * (0.37 * phi as f32).fract();
                out.locate(Vec2::new(0.37, -0.61) * phi as f32, corners, [weight, 0.8 * (1.0 - weight)]);
                let side = if i % 3 == 0 { -1.0 } else { 1.0 };
                let footprint = 0.02 * (i % 20) as f32;
                let [n, t] = [n, f.t].map(|v| v.as_vec3().to_array());
                out.chart(PointChart { n, t, side, footprint });
            }
        }
    }
    out
}

/// Views from 3° above the horizon to a tenth of one, which see a sun in `to` at the horizon across from
/// them.
fn grazing(to: DVec3) -> PointsBuf {
    let mut out = PointsBuf::default();
    let aside = to.any_orthonormal_vector();
    for k in 0..240 {
        let u = |by: f64| (f64::from(k) * by + 0.5).fract();
        let cosine = 1.5e-3 * 30f64.powf(u(0.618_033_989));
        let elevation = -0.015 + 0.05 * u(0.754_877_666);
        let across = glam::DQuat::from_axis_angle(to, 6.0 * u(0.569_840_291)) * aside;
        let n = to * elevation.sin() + across * elevation.cos();
        let level = (to - n * n.dot(to)).normalize();
        let level = glam::DQuat::from_axis_angle(n, 0.06 * (u(0.324_717_957) - 0.5)) * level;
        let wo = n * cosine - level * (1.0 - cosine * cosine).sqrt();
        out.push(n.as_vec3(), Frame::from_normal(n).t.as_vec3(), wo.as_vec3(), Vec3::ZERO);
    }
    out
}

/// Suns apart where lobes are narrowest: a disk, and the texel of a photograph.
fn horizon(spec: &str, bound: f32) -> Result<(), Failed> {
    let gpu = gpu()?;
    let mut texel = light();
    let image = &mut Arc::make_mut(texel.environment.as_mut().ok_or("an image")?).image;
    let k = image.index(0, 37, 18);
    image.planes.iter_mut().for_each(|p| p[k] = 2e4);
    let at = image.layout.texel_direction(128, 64, 0, 37, 18).ok_or("a texel")?;
    let disks = sunny();
    let to = disks.disks[0].direction;
    let material = Material::new(steradian_brdf::parse(spec)?);
    let t = steradian_techniques::find("shrm_slices").ok_or("no such technique")?;
    let params: ParamValues = [(SUNS, 1.0), ("order", 64.0), ("size", 32.0)].into_iter().collect();
    let first = t.draft(&disks, &material, None, &params, &Task::quiet())?;
    for (light, to) in [(disks, to), (texel, at)] {
        let bake = first.preview(Some(&light), None, &Task::quiet())?;
        if !bake.gpu().uniforms.iter().any(|u| u.name == "suns") {
            return Err("the sun is not apart: nothing of it was compared".into());
        }
        let points = grazing(to);
        within(bound, gpu, &shaded(&*bake, &points), &bake.gpu(), &points)?;
    }
    Ok(())
}

fn compare(gpu: &Gpu, bake: &dyn AnyBake, points: &PointsBuf) -> Result<(), Failed> {
    within(BOUND, gpu, &shaded(bake, points), &bake.gpu(), points)
}

fn shaded(bake: &dyn AnyBake, points: &PointsBuf) -> [Vec<f32>; 3] {
    let mut cpu: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
    bake.shade(&points.as_points(), &mut Radiance::of(&mut cpu));
    cpu
}

/// Compares the CPU's radiance with a technique on the GPU.
fn same(gpu: &Gpu, cpu: &[Vec<f32>; 3], technique: &GpuTechnique, points: &PointsBuf) -> Result<(), Failed> {
    within(BOUND, gpu, cpu, technique, points)
}

/// [`same`] up to a relative error.
fn within(
    bound: f32,
    gpu: &Gpu,
    cpu: &[Vec<f32>; 3],
    technique: &GpuTechnique,
    points: &PointsBuf,
) -> Result<(), Failed> {
    let twin = ComputeTechnique::new(gpu, technique)?.shade(gpu, points)?;
    let scale = cpu.iter().flatten().fold(0.0_f32, |a, x| a.max(x.abs()));
    if scale == 0.0 {
        return Err("the CPU shades black everywhere: nothing was compared".into());
    }
    for (k, (a, b)) in cpu.iter().zip(&twin).enumerate() {
        for (i, (x, y)) in a.iter().zip(b).enumerate() {
            let off = (x - y).abs() / x.abs().max(1e-2 * scale);
            if off > bound || off.is_nan() {
                return Err(format!("point {i}, channel {k}: CPU {x}, GPU {y} ({off:.1e} apart)").into());
            }
        }
    }
    Ok(())
}

/// A near point light and three directional lights.
fn local_lights() -> LocalLights {
    let l = [lights::near_point(), lights::three_directionals()];
    LocalLights { directionals: l[1].directionals.clone(), points: l[0].points.clone() }
}

/// A technique for local light on CPU and GPU, alone and merged with one for environments.
fn local(t: &dyn AnyLocal, spec: &str, choice: Option<(&'static str, Value)>) -> Result<(), Failed> {
    let gpu = gpu()?;
    let params: ParamValues = choice.into_iter().collect();
    let mesh = ring();
    let points = points(Some(&mesh));
    let material = specimens::material(steradian_brdf::parse(spec)?, t.planes());
    let bake = t.bake(&material, Some(&mesh), &params, &Task::quiet().with_tolerance(Some(0.1)))?;
    let light_rotation = Mat3::from_rotation_y(0.8) * Mat3::from_rotation_x(0.4);
    let view = View { eye: Vec3::new(3.0, 2.0, 1.0), light_rotation, ..View::default() };
    let (lamps, mesh) = (local_lights(), Some(&*mesh.mesh));
    let shading = bake.lit(&LocalFrame { lights: &lamps, view: &view, mesh, shadowed: false })?;
    let mut cpu: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
    shading.add(None, &points.as_points(), &mut Radiance::of(&mut cpu));
    let alone = shading.gpu().ok_or("no text for GPUs")?;
    same(gpu, &cpu, &alone, &points)?;
    let other = steradian_techniques::find("sh_irradiance").ok_or("no such technique")?;
    let material = Material::new(steradian_brdf::parse("lambert")?);
    let distant = other.draft(&light(), &material, None, &ParamValues::default(), &Task::quiet())?;
    distant.shade(&points.as_points(), &mut Radiance::of(&mut cpu));
    shading.add(None, &points.as_points(), &mut Radiance::of(&mut cpu));
    same(gpu, &cpu, &beside(distant.gpu(), alone.clone()), &points)?;
    let mesh = mesh.ok_or("a mesh")?;
    let shading = bake.lit(&LocalFrame { lights: &lamps, view: &view, mesh: Some(mesh), shadowed: true })?;
    let far = lamps.directionals.iter().map(|d| LightAt::Far(light_rotation * d.direction.as_vec3()));
    let near = lamps.points.iter().map(|p| LightAt::Near(p.position));
    shadowed(gpu, &*shading, &far.chain(near).collect::<Vec<_>>(), mesh, &points)
}

/// A technique for local light behind a mesh, by rays and by shadow maps.
fn shadowed(
    gpu: &Gpu,
    shading: &dyn LocalShading,
    places: &[LightAt],
    mesh: &Mesh,
    points: &PointsBuf,
) -> Result<(), Failed> {
    const OFFSET: f64 = 1e-4;
    let shade = |shadows: Option<Shadows<'_>>| {
        let mut cpu: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
        shading.add(shadows, &points.as_points(), &mut Radiance::of(&mut cpu));
        cpu
    };
    let open = shade(None);
    let bvh = Bvh::build(mesh);
    let maps = ShadowMaps::new(mesh, &bvh, places, MapOptions { size: 128, taps: 3 });
    for by in [&bvh as &dyn Blocker, &maps] {
        let cpu = shade(Some(Shadows { by, offset: OFFSET, reference: false }));
        if cpu == open {
            return Err("nothing is shadowed: nothing was compared".into());
        }
        let flat = by.flat().ok_or("no form for GPUs")?;
        let technique = shading.gpu().ok_or("no text for GPUs")?;
        if !shadow::knows_shadows(&technique) {
            return Err("its text asks for no shadows".into());
        }
        same(gpu, &cpu, &shadow::behind(technique, &flat, OFFSET as f32), points)?;
    }
    Ok(())
}

/// Every other value of every parameter of few values: the branches of a technique's shader.
fn choices(params: &'static [ParamInfo]) -> Vec<(&'static str, Value)> {
    let values = |i: &ParamInfo| -> Vec<Value> {
        match i.kind {
            Kind::Switch => vec![false.into(), true.into()],
            Kind::Choice(words) => words.iter().map(|w| (*w).into()).collect(),
            Kind::Whole if i.max - i.min <= 2.0 => vec![i.min.into(), i.max.into()],
            _ => Vec::new(),
        }
    };
    let others = |i: &'static ParamInfo| {
        values(i).into_iter().filter(|v| Some(v) != i.default_value().as_ref()).map(|v| (i.name, v))
    };
    params.iter().flat_map(others).collect()
}

/// Small tables, coarse fits and few rays: shaders are the same. (Of the tests of `gaussian_lobes` alone,
/// data of the usual sizes took three quarters.)
fn small(technique: &dyn AnyTechnique) -> ParamValues {
    let sizes = [("size", 24.0), ("nodes", 3.0), ("views", 6.0), ("azimuths", 6.0), ("precision", 0.02)];
    let taken = |(name, value): &(&'static str, f64)| {
        technique.params().iter().any(|i| i.name == *name && i.check(&(*value).into()).is_ok())
    };
    sizes.into_iter().filter(taken).collect()
}

/// A technique whose reflectance varies by texel, by both.
fn textured(technique: &'static dyn AnyTechnique, spec: &str) -> Result<(), Failed> {
    let gpu = gpu()?;
    let params = small(technique);
    let material = specimens::material(steradian_brdf::parse(spec)?, technique.planes());
    let mut bake = technique.draft(&light(), &material, None, &params, &Task::quiet())?;
    if !bake.is_textured() {
        return Err("reads no textures: nothing of them was compared".into());
    }
    let points = points(Some(&ring()));
    compare(gpu, &*bake, &points)?;
    bake.frame(&View { light_rotation: Mat3::from_rotation_y(0.8), ..View::default() });
    compare(gpu, &*bake, &points)
}

/// Gaussian lobes of anisotropic reflectance, about half vectors and swept, on CPU and GPU, with and without
/// visibility.
fn turned_lobes(form: &'static str, visibility: &'static str) -> Result<(), Failed> {
    let gpu = gpu()?;
    let technique = steradian_techniques::find("gaussian_lobes").ok_or("no such technique")?;
    let mut params = small(technique);
    params.0.insert("visibility".into(), visibility.into());
    params.0.insert("anisotropic".into(), form.into());
    let geometry = technique.needs_sites(&params).then(ring);
    let material = Material::new(steradian_brdf::parse("ward:ax=0.1,ay=0.4")?);
    let bake = technique.draft(&light(), &material, geometry.as_ref(), &params, &Task::quiet())?;
    compare(gpu, &*bake, &points(geometry.as_ref()))
}

/// Shades by both, with the first of `specs` that the choice takes: a central direction along the tangent,
/// say, is for strands alone.
fn technique(
    technique: &'static dyn AnyTechnique,
    specs: &[&'static str],
    choice: Option<(&'static str, Value)>,
) -> Result<(), Failed> {
    let gpu = gpu()?;
    let is = |name: &str| choice.as_ref().is_some_and(|c| c.0 == name);
    let (sun, bumpy) = (is(SUNS), is(NORMALS));
    let mut params = small(technique);
    params.0.extend(choice.map(|(name, value)| (name.into(), value)));
    let light = if sun { sunny() } else { light() };
    let geometry = technique.needs_sites(&params).then(ring);
    let mut refused = Failed::without_message();
    let mut taken = None;
    for spec in specs {
        let material = Material::new(steradian_brdf::parse(spec)?);
        match technique.draft(&light, &material, geometry.as_ref(), &params, &Task::quiet()) {
            Ok(bake) => {
                taken = Some(bake);
                break;
            }
            Err(e) => refused = e.into(),
        }
    }
    let Some(mut bake) = taken else { return Err(refused) };
    let mut points = points(geometry.as_ref());
    if bumpy {
        // The surface's own normals lean away from those that are shaded.
        for i in 0..points.len() {
            let own = Vec3::from_array([0, 1, 2].map(|k| points.chart[k][i]));
            let t = Vec3::from_array([3, 4, 5].map(|k| points.chart[k][i]));
            let leant = (own + (0.1 * (i % 9) as f32 - 0.4) * t).normalize().to_array();
            (0..3).for_each(|k| points.chart[k][i] = leant[k]);
        }
    }
    if sun && !bake.gpu().uniforms.iter().any(|u| u.name == "suns") {
        return Err("the sun is not apart: nothing of it was compared".into());
    }
    compare(gpu, &*bake, &points)?;
    let light_rotation = Mat3::from_rotation_y(0.8) * Mat3::from_rotation_x(0.4);
    bake.frame(&View { light_rotation, ..View::default() });
    compare(gpu, &*bake, &points)
}

fn main() {
    common::with_unoptimised_shaders();
    let arguments = Arguments::from_args();
    let required = std::env::var_os("STERADIAN_REQUIRE_GPU").is_some();
    let ignored = gpu().is_err() && !required;
    let trials = registry()
        .iter()
        .flat_map(|t| {
            let specimens = t.card().specimens;
            let each = || specimens.chunks(1);
            let plain = each().map(|spec| (spec, None));
            let chosen = choices(t.params()).into_iter().map(|choice| (specimens, Some(choice)));
            let suns = t.params().iter().any(|i| i.name == SUNS);
            let sunny = each().filter(move |_| suns).map(|spec| (spec, Some((SUNS, 1.0.into()))));
            let bounces = t.params().iter().any(|i| i.name == BOUNCES);
            let reflected = each().filter(move |_| bounces).map(|spec| (spec, Some((BOUNCES, 3.0.into()))));
            let seen = t.params().iter().any(|i| i.name == VISIBILITY);
            let shadowed =
                each().filter(move |_| seen).map(|spec| (spec, Some((VISIBILITY, "published".into()))));
            plain
                .chain(chosen)
                .chain(shadowed)
                .chain(sunny)
                .chain(reflected)
                .map(|(specs, choice)| (*t, specs, choice))
                .collect::<Vec<_>>()
        })
        .map(|(t, specs, choice)| {
            let with = choice.as_ref().map(|(name, value)| format!(" {name}={value}")).unwrap_or_default();
            let of = if let [spec] = specs { spec } else { "first that takes it" };
            let name = format!("{}::{of}{with}", t.card().slug);
            Trial::test(name, move || technique(t, specs, choice)).with_ignored_flag(ignored)
        });
    let near = locals()
        .iter()
        .flat_map(|t| {
            let specs = t.card().specimens.iter();
            let chosen = choices(t.params()).into_iter().map(|c| (t.card().specimens[0], Some(c)));
            let bounces = t.params().iter().any(|i| i.name == BOUNCES);
            let reflected =
                t.card().specimens.iter().filter(move |_| bounces).map(|s| (*s, Some((BOUNCES, 3.0.into()))));
            specs
                .map(|s| (*s, None))
                .chain(chosen)
                .chain(reflected)
                .map(|(s, c)| (*t, s, c))
                .collect::<Vec<_>>()
        })
        .map(|(t, spec, choice)| {
            let with = choice.as_ref().map(|(name, value)| format!(" {name}={value}")).unwrap_or_default();
            let name = format!("{}::{spec}{with}", t.card().slug);
            Trial::test(name, move || local(t, spec, choice)).with_ignored_flag(ignored)
        });
    // The last two are hundreds of times narrower than the suns: in azimuth single precision hardly tells
    // apart the directions of a lobe of 1e-4 at grazing views.
    let low = [
        ("ggx:alpha=0.1,f0=0.9", BOUND),
        ("cook-torrance:m=0.127,f0=0.25", BOUND),
        ("ggx:alpha=1e-4", 0.1),
        ("sgd:chrome-steel", 5e-3),
    ];
    let low = low.into_iter().map(|(spec, bound)| {
        Trial::test(format!("suns at the horizon::{spec}"), move || horizon(spec, bound))
            .with_ignored_flag(ignored)
    });
    let varied = registry().iter().filter(|t| !t.planes().is_empty()).flat_map(|t| {
        let widths = t.planes().iter().any(|p| p.name == "widths");
        let varies =
            |s: &str| steradian_brdf::parse(s).is_ok_and(|b| steradian_brdf::width_names(&*b).is_some());
        let taken = t.card().specimens.iter().filter(move |s| !widths || varies(s));
        taken.map(move |spec| {
            let name = format!("{}::{spec} by texel", t.card().slug);
            Trial::test(name, move || textured(*t, spec)).with_ignored_flag(ignored)
        })
    });
    let forms = [
        ("swept", "none"),
        ("swept", "published"),
        ("swept", "convolved"),
        ("half-vectors", "none"),
        ("half-vectors", "convolved"),
    ];
    let turned = forms.into_iter().map(|(form, visibility)| {
        let name = format!("gaussian_lobes::ward:ax=0.1,ay=0.4 anisotropic={form} visibility={visibility}");
        Trial::test(name, move || turned_lobes(form, visibility)).with_ignored_flag(ignored)
    });
    let trials = trials.chain(near).chain(low).chain(varied).chain(turned).collect();
    libtest_mimic::run(&arguments, trials).exit();
}
