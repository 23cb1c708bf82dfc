//! A running renderer after each change shows what a fresh one shows, on both paths; data per site reach the
//! shader.
//!
//! Without an adapter the tests show as ignored; `STERADIAN_REQUIRE_GPU=1` (CI sets it) makes that a failure.

mod common;

use common::{Case, case, gpu, view};
use glam::{Affine3A, Mat3, Quat, Vec3};
use libtest_mimic::{Arguments, Failed, Trial};
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_gpu::scene::{Path, Picture, Rate, Scene, Settings, Triangles};
use steradian_gpu::{ComputeTechnique, Gpu, Renderer};
use steradian_scene::Camera;
use steradian_techniques::gpu::{Buffer, Entry, Uniform, Value};
use steradian_techniques::{AnyBake, GpuTechnique, Material, Points, SitesAt, View};

const SIDE: usize = 96;

/// Inputs of a picture.
struct Setup {
    case: Case,
    bake: Box<dyn AnyBake>,
    transform: Affine3A,
    light_rotation: Mat3,
}

impl Setup {
    fn new() -> Result<Self, Failed> {
        let case = case(1, SIDE);
        let bake = bake(&case, &ParamValues::default())?;
        Ok(Self { case, bake, transform: Affine3A::IDENTITY, light_rotation: Mat3::IDENTITY })
    }

    fn scene(&self) -> Scene {
        let mut scene = common::scene(&self.case, self.bake.gpu());
        scene.objects[0].transform = self.transform;
        Scene { light_rotation: self.light_rotation, ..scene }
    }
}

/// A bake from nothing.
fn bake(case: &Case, params: &ParamValues) -> Result<Box<dyn AnyBake>, Failed> {
    let t = steradian_techniques::find("split_sum").ok_or("no such technique")?;
    Ok(t.draft(&case.lights, &Material::new(case.brdf.clone()), None, params, &Task::quiet())?)
}

/// Largest difference over the largest value.
fn apart(a: &Picture, b: &Picture) -> f32 {
    let scale = a.rgb.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
    let pairs = a.rgb.iter().flatten().zip(b.rgb.iter().flatten());
    pairs.fold(0.0f32, |m, (x, y)| m.max((x - y).abs())) / scale
}

type Change = fn(&Gpu, &mut Renderer, &mut Setup) -> Result<(), Failed>;

/// `change` makes the running picture equal to a fresh one, and different from the one before.
fn follows(change: Change) -> Result<(), Failed> {
    let gpu = gpu()?;
    for path in [Path::Raster, Path::Compute] {
        let mut setup = Setup::new()?;
        let settings = Settings { path, ..Settings::new(SIDE, SIDE) };
        let mut live = Renderer::new(gpu, setup.scene(), &settings)?;
        let (before, _) = live.render(gpu)?;
        change(gpu, &mut live, &mut setup)?;
        let (changed, _) = live.render(gpu)?;
        let (fresh, _) = Renderer::new(gpu, setup.scene(), &settings)?.render(gpu)?;
        let (off, moved) = (apart(&fresh, &changed), apart(&fresh, &before));
        if off > 1e-6 || moved < 0.01 {
            return Err(format!("{path:?}: {off} from a fresh picture, {moved} from the one before").into());
        }
    }
    Ok(())
}

fn object(gpu: &Gpu, live: &mut Renderer, s: &mut Setup) -> Result<(), Failed> {
    s.transform = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.4), Vec3::new(0.1, 0.2, 0.0));
    Ok(live.set_transform(gpu, 0, s.transform)?)
}

fn camera(gpu: &Gpu, live: &mut Renderer, s: &mut Setup) -> Result<(), Failed> {
    let Camera::Pinhole { from, at, up, .. } = s.case.camera else { return Err("another camera".into()) };
    s.case.camera = Camera::Pinhole { from: Mat3::from_rotation_y(0.5) * from, at, up, fov_y: 0.4 };
    live.set_camera(gpu, s.case.camera);
    Ok(())
}

/// Uniforms only: no table is copied.
fn rotation(gpu: &Gpu, live: &mut Renderer, s: &mut Setup) -> Result<(), Failed> {
    s.light_rotation = Mat3::from_rotation_y(1.1) * Mat3::from_rotation_x(0.3);
    s.bake.frame(&View { light_rotation: s.light_rotation, ..view(&s.case) });
    live.update_uniforms(gpu, 0, &s.bake.gpu_frame().ok_or("its frames change tables")?)?;
    live.set_light_rotation(gpu, s.light_rotation);
    Ok(())
}

/// Only the light's factor is baked again; the fresh picture bakes everything.
fn light(gpu: &Gpu, live: &mut Renderer, s: &mut Setup) -> Result<(), Failed> {
    let other = case(0, SIDE);
    s.bake = s.bake.preview(Some(&other.lights), None, &Task::quiet())?;
    live.set_technique(gpu, 0, s.bake.gpu())?;
    live.set_backdrop(gpu, common::backdrop(&other.backdrop))?;
    (s.case.lights, s.case.backdrop) = (other.lights, other.backdrop);
    s.bake = bake(&s.case, &ParamValues::default())?;
    Ok(())
}

/// Only the material's factor is baked again; the tables of the light stay on the device.
fn material(gpu: &Gpu, live: &mut Renderer, s: &mut Setup) -> Result<(), Failed> {
    s.case.brdf = steradian_brdf::parse("ggx:alpha=0.4,f0=0.3/0.5/0.9")?;
    s.bake = s.bake.preview(None, Some(&Material::new(s.case.brdf.clone())), &Task::quiet())?;
    live.set_technique(gpu, 0, s.bake.gpu())?;
    s.bake = bake(&s.case, &ParamValues::default())?;
    Ok(())
}

fn params(gpu: &Gpu, live: &mut Renderer, s: &mut Setup) -> Result<(), Failed> {
    let mut params = ParamValues::default();
    params.0.insert("levels".into(), 3.0.into());
    params.0.insert("size".into(), 16.0.into());
    s.bake = bake(&s.case, &params)?;
    Ok(live.set_technique(gpu, 0, s.bake.gpu())?)
}

/// Another technique: its pipelines are made again.
fn technique(gpu: &Gpu, live: &mut Renderer, s: &mut Setup) -> Result<(), Failed> {
    let t = steradian_techniques::find("diffuse_map").ok_or("no such technique")?;
    let lambert = Material::new(steradian_brdf::parse("lambert:albedo=0.8/0.5/0.2")?);
    s.bake = t.draft(&s.case.lights, &lambert, None, &ParamValues::default(), &Task::quiet())?;
    Ok(live.set_technique(gpu, 0, s.bake.gpu())?)
}

/// A technique without tables whose radiance is `body`, and whose sites hold `data`.
fn described(wgsl: &'static str, buffers: Vec<Buffer>) -> GpuTechnique {
    let uniforms = vec![Uniform { name: "scale", value: Value::F32(2.0) }];
    let entry = if buffers.is_empty() { Entry::PLAIN } else { Entry::SITE };
    GpuTechnique { slug: "test", modules: vec![wgsl.into()], entry, tables: Vec::new(), uniforms, buffers }
}

const PLAIN: &str = "fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    return technique.scale * abs(p);
}";
const SITED: &str =
    "fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    let at = vec3<f32>(fetch_place_at(site, 0u), fetch_place_at(site, 1u), fetch_place_at(site, 2u));
    return technique.scale * abs(at);
}";
const UV: &str =
    "fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    return vec3<f32>(abs(site.uv - vec2<f32>(fetch_place_at(site, 3u), fetch_place_at(site, 4u))), 0.0);
}";

/// Position and texture coordinates of every vertex, as data per site.
fn places(mesh: &steradian_scene::Mesh) -> Vec<Buffer> {
    let uv = |v: usize| mesh.uvs.get(v).copied().unwrap_or_default();
    let data = mesh.positions.iter().enumerate().flat_map(|(v, p)| [p.x, p.y, p.z, uv(v).x, uv(v).y]);
    vec![Buffer::new("place", 5, data.collect())]
}

/// Data of the vertices, interpolated, are the position that the shader has; so are texture coordinates. The
/// object is the second of two slots, so that its vertices are not the mesh's first.
fn sites_reach_the_shader() -> Result<(), Failed> {
    let gpu = gpu()?;
    let mut case = case(1, SIDE);
    let sphere = steradian_scene::shapes::sphere(24);
    let mesh = steradian_scene::Mesh::merged(&[sphere.clone(), case.mesh.0.clone().with_material(1)]);
    case.mesh.0 = mesh;
    let picture = |technique: GpuTechnique, path, rate| -> Result<Picture, Failed> {
        let mut scene = common::scene(&case, technique);
        scene.objects[0].triangles = Arc::new(Triangles::of(&case.mesh.0, |slot| slot == 1));
        scene.backdrop = Default::default();
        let settings = Settings { path, rate, ..Settings::new(SIDE, SIDE) };
        Ok(Renderer::new(gpu, scene, &settings)?.render(gpu)?.0)
    };
    let data = places(&case.mesh.0);
    for path in [Path::Raster, Path::Compute] {
        for rate in [Rate::Sample, Rate::Pixel] {
            let plain = picture(described(PLAIN, Vec::new()), path, rate)?;
            let off = apart(&plain, &picture(described(SITED, data.clone()), path, rate)?);
            let uv = picture(described(UV, data.clone()), path, rate)?;
            let most = uv.rgb.iter().flatten().fold(0.0f32, |m, x| m.max(*x));
            // Two interpolations of a rasteriser, each with its own rounding.
            if off > 1e-4 || most > 2e-3 {
                return Err(format!("{path:?}, {rate:?}: positions {off} off, uv {most}").into());
            }
        }
    }
    let mut scene = common::scene(&case, described(SITED, data));
    let mut without = (*scene.objects[0].triangles).clone();
    without.sites.clear();
    scene.objects[0].triangles = Arc::new(without);
    match Renderer::new(gpu, scene, &Settings::new(8, 8)) {
        Err(e) if e.to_string().contains("site for every vertex") => Ok(()),
        Err(e) => Err(e.into()),
        Ok(_) => Err("drawn without sites".into()),
    }
}

/// Batches of points among sites, against the closed form.
fn batches_lie_among_sites() -> Result<(), Failed> {
    let gpu = gpu()?;
    let mesh = steradian_scene::shapes::sphere(12);
    let twin = ComputeTechnique::new(gpu, &described(SITED, places(&mesh)))?;
    let count = mesh.triangles.len();
    let index: [Vec<u32>; 3] = std::array::from_fn(|k| mesh.triangles.iter().map(|t| t[k]).collect());
    let weight = [vec![0.25f32; count], vec![0.375; count]];
    let zero = vec![0.0f32; count];
    let points = Points {
        n: [&zero; 3],
        wo: [&zero; 3],
        site: SitesAt {
            index: index.each_ref().map(Vec::as_slice),
            weight: weight.each_ref().map(Vec::as_slice),
        },
        ..Points::default()
    };
    let l = twin.shade_points(gpu, &points)?;
    for (i, t) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        let expected = 2.0 * (0.375 * a + 0.25 * b + 0.375 * c).abs();
        let off = (Vec3::new(l[0][i], l[1][i], l[2][i]) - expected).abs().max_element();
        if off.is_nan() || off > 1e-6 {
            return Err(format!("triangle {i}: {off} off").into());
        }
    }
    Ok(())
}

fn main() {
    let arguments = Arguments::from_args();
    let ignored = gpu().is_err() && std::env::var_os("STERADIAN_REQUIRE_GPU").is_none();
    let changes: [(&str, Change); 7] = [
        ("object", object),
        ("camera", camera),
        ("rotation", rotation),
        ("light", light),
        ("material", material),
        ("params", params),
        ("technique", technique),
    ];
    let mut trials: Vec<Trial> = changes
        .into_iter()
        .map(|(name, change)| Trial::test(format!("live::{name}"), move || follows(change)))
        .collect();
    trials.push(Trial::test("sites_reach_the_shader", sites_reach_the_shader));
    trials.push(Trial::test("batches_lie_among_sites", batches_lie_among_sites));
    let trials = trials.into_iter().map(|t| t.with_ignored_flag(ignored)).collect();
    libtest_mimic::run(&arguments, trials).exit();
}
