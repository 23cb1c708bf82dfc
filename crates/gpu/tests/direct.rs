//! Pictures lit by a sun and point lights in addition to a sunless sky, GPU against CPU, and lights that
//! change live.
//!
//! Without an adapter the tests show as ignored; `STERADIAN_REQUIRE_GPU=1` (CI sets it) makes that a failure.
//! `STERADIAN_KEEP=FOLDER` keeps the pictures.

mod common;
#[path = "direct/volumes.rs"]
mod volumes;

use common::{case, gpu, scene, tabulated};
use glam::{Affine3A, DVec3, Mat3, Vec3};
use libtest_mimic::{Arguments, Failed, Trial};
use std::sync::Arc;
use steradian_base::Task;
use steradian_gpu::Renderer;
use steradian_gpu::scene::{Path, Picture, Rate, Scene, Settings};
use steradian_light::{DirectionalLight, DiskLight, Environment, Lights, PointLight};
use steradian_render::metrics::{DEFAULT_PPD, flip_displays};
use steradian_render::tone::auto_exposure;
use steradian_render::{Background, BakeShader, Develop, DirectShader, Film, Stage, Surface, ToneMapper};
use steradian_scene::shadow::{Blocker, Flat, LightAt, MapOptions, ShadowMaps};
use steradian_scene::{Bvh, Camera, Mesh};
use steradian_techniques::direct::{Direct, Suns, split};
use steradian_techniques::gpu::{GpuTechnique, shadow};
use steradian_techniques::local::beside;
use steradian_techniques::{AnyBake, Material};

/// Mean FLIP between the CPU's and the GPU's picture.
const BOUND: f32 = 0.01;
const SIDE: usize = 128;
/// Distance off the surface at which the CPU renderer starts its rays, metres.
const OFFSET: f32 = 1e-4;

/// Scene of the demo, technique, reflectance; `merl ` says that it is measured, as a table.
const CASES: &[(usize, &str, &str)] = &[
    (0, "sh_irradiance", "lambert:albedo=0.65/0.4/0.28"),
    (1, "split_sum", "ggx:alpha=0.15,f0=1.0/0.77/0.34"),
    (1, "split_sum", "ggx:alpha=0.02"),
    (1, "sh_brdf", "merl sgd:gold-metallic-paint"),
    (2, "phong_diffuse_maps", "phong:n=30,scale=0.25/0.4/1"),
];

/// A sun low at one side, two lamps near the object, and a weak directional light.
fn lights(sky: &Lights, centre: Vec3, reach: f32) -> Lights {
    let sun = DiskLight {
        direction: DVec3::new(0.7, 0.5, 0.6).normalize(),
        angular_radius: 0.01,
        radiance: [9000.0, 8000.0, 6000.0],
    };
    let lamp = |offset: Vec3, power: [f32; 3]| PointLight {
        position: centre + offset * reach,
        intensity: power.map(|p| p * reach * reach),
    };
    Lights {
        environment: sky.environment.clone(),
        disks: vec![sun],
        directionals: vec![DirectionalLight {
            direction: DVec3::new(-0.6, 0.64, 0.48),
            irradiance: [0.1, 0.2, 0.4],
        }],
        points: vec![
            lamp(Vec3::new(1.5, 0.8, 0.6), [3.0, 1.0, 0.5]),
            lamp(Vec3::new(0.4, 1.6, -1.2), [0.5, 1.5, 3.0]),
        ],
        ..Lights::default()
    }
}

struct Lit {
    case: common::Case,
    direct: Direct,
    bake: Arc<BakeShader>,
    /// A technique for directional and point lights, in place of their exact shading.
    local: Option<GpuTechnique>,
}

fn lit(mut case: common::Case, slug: &str, spec: &str) -> Result<Lit, Failed> {
    case.brdf = match spec.strip_prefix("merl ") {
        Some(formula) => tabulated(formula),
        None => steradian_brdf::parse(spec)?,
    };
    let (low, high) = case.mesh.0.bounds().ok_or("no triangles")?;
    case.lights = lights(&case.lights, 0.5 * (low + high), 0.5 * (high - low).length());
    case.backdrop = steradian_render::Backdrop::new(&case.lights, 2f64.to_radians());
    let (baked, direct) = split(&case.lights, Suns::Exact);
    let t = steradian_techniques::find(slug).ok_or("no such technique")?;
    let mut bake: Box<dyn AnyBake> =
        t.draft(&baked, &Material::new(case.brdf.clone()), None, &Default::default(), &Task::quiet())?;
    bake.frame(&common::view(&case));
    Ok(Lit { case, direct, bake: Arc::new(BakeShader(bake)), local: None })
}

impl Lit {
    fn scene(&self) -> Scene {
        self.scene_behind(None)
    }

    fn scene_behind(&self, by: Option<&Flat>) -> Scene {
        let mut technique = self.bake.0.gpu();
        if let Some(local) = &self.local {
            technique = beside(technique, local.clone());
        }
        let technique = match by {
            Some(by) => shadow::behind(technique, by, OFFSET),
            None => technique,
        };
        let mut scene = scene(&self.case, technique);
        if let Some(Flat::Volumes(drawn)) = by {
            scene.volumes = Some(drawn.clone());
        }
        scene.objects[0].brdf = self.case.brdf.shader();
        scene.direct = self.direct.clone();
        scene
    }

    fn cpu(&self, side: usize, shadows: Option<Arc<dyn Blocker>>) -> Film {
        let shader = DirectShader {
            bake: self.bake.clone(),
            direct: self.direct.clone(),
            brdf: self.case.brdf.clone(),
            local: None,
            shadows,
        };
        let surfaces = [surface(Arc::new(shader))];
        let background = Background::Sky(self.case.backdrop.clone());
        let stage = Stage {
            mesh: &self.case.mesh.0,
            bvh: &self.case.mesh.1,
            surfaces: &surfaces,
            background: &background,
            camera: self.case.camera,
        };
        let settings = steradian_render::Settings::new(side, side);
        steradian_render::render(&stage, &settings, &Task::quiet()).expect("nobody cancels")
    }
}

fn surface(shader: Arc<dyn steradian_render::Shader>) -> Surface {
    Surface { shader, base_colour: None, maps: steradian_render::SurfaceMaps::default() }
}

fn film(p: &Picture) -> Film {
    Film::without_background(p.width, p.height, p.rgb.clone(), p.alpha.clone())
}

fn flip(name: &str, a: &Film, b: &Film) -> f32 {
    let develop = Develop { ev: auto_exposure(a, |i| a.alpha[i]), mapper: ToneMapper::Aces };
    let (a, b) = (develop.film(a), develop.film(b));
    if let Some(folder) = std::env::var_os("STERADIAN_KEEP") {
        for (picture, side) in [(&a, "cpu"), (&b, "gpu")] {
            common::keep(std::path::Path::new(&folder), &format!("direct-{name}-{side}"), picture);
        }
    }
    flip_displays(&a, &b, DEFAULT_PPD).mean as f32
}

fn picture(k: usize, slug: &str, spec: &str) -> Result<(), Failed> {
    let gpu = gpu()?;
    let lit = lit(case(k, SIDE), slug, spec)?;
    let truth = lit.cpu(SIDE, None);
    for path in [Path::Raster, Path::Compute] {
        let settings = Settings { path, rate: Rate::Sample, ..Settings::new(SIDE, SIDE) };
        let (picture, _) = Renderer::new(gpu, lit.scene(), &settings)?.render(gpu)?;
        let off = flip(&format!("{k}-{slug}-{path:?}"), &truth, &film(&picture));
        if off > BOUND {
            return Err(format!("{path:?}: FLIP {off:.4}").into());
        }
    }
    Ok(())
}

/// A sun, lamps and a directional light over a box on a floor, by rays and by shadow maps. The meshes have
/// few triangles, since software adapters shade whole blocks of pixels for each one.
fn shadows() -> Result<(), Failed> {
    let gpu = gpu()?;
    let mut case = case(1, SIDE);
    let lift = Affine3A::from_translation(Vec3::new(0.1, 0.7, 0.0)) * Affine3A::from_rotation_y(0.6);
    let mesh = Mesh::merged(&[
        steradian_scene::shapes::by_name("plane:size=3")?,
        steradian_scene::shapes::by_name("box:x=0.8,y=0.8,z=0.8")?.transformed(&lift),
    ]);
    case.camera = Camera::Pinhole {
        from: Vec3::new(-1.5, 2.4, 1.8),
        at: Vec3::new(0.0, 0.3, 0.0),
        up: Vec3::Y,
        fov_y: 0.9,
    };
    case.mesh = (mesh.clone(), Bvh::build(&mesh));
    // Almost all light is that of the lamps.
    case.lights.environment = steradian_light::sky::by_name("furnace", 64, 32)
        .map(|s| Arc::new(Environment { image: s.image }))
        .ok();
    let lit = lit(case, "split_sum", "ggx:alpha=0.3,f0=1.0/0.77/0.34")?;
    let (mesh, bvh) = &lit.case.mesh;
    let d = &lit.direct;
    let far = d.disks.iter().map(|l| l.direction).chain(d.directionals.iter().map(|l| l.direction));
    let far = far.map(|d| LightAt::Far(d.as_vec3()));
    let places: Vec<_> = far.chain(d.points.iter().map(|p| LightAt::Near(p.position))).collect();
    let maps = ShadowMaps::new(mesh, bvh, &places, MapOptions { size: 512, taps: 3 });
    let open = lit.cpu(SIDE, None);
    for (name, by) in [("rays", Arc::new(bvh.clone()) as Arc<dyn Blocker>), ("maps", Arc::new(maps))] {
        let truth = lit.cpu(SIDE, Some(by.clone()));
        let shadow = flip(&format!("{name}-open"), &truth, &open);
        let flat = by.flat().ok_or("no form for GPUs")?;
        for path in [Path::Raster, Path::Compute] {
            let settings = Settings { path, rate: Rate::Sample, ..Settings::new(SIDE, SIDE) };
            let scene = lit.scene_behind(Some(&flat));
            let (picture, _) = Renderer::new(gpu, scene, &settings)?.render(gpu)?;
            let off = flip(&format!("{name}-{path:?}"), &truth, &film(&picture));
            if off > BOUND || shadow < 3.0 * BOUND {
                return Err(format!("{name}, {path:?}: FLIP {off:.4}; {shadow:.4} without shadows").into());
            }
        }
    }
    Ok(())
}

fn largest_difference(a: &Picture, b: &Picture) -> f32 {
    let scale = a.rgb.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
    let pairs = a.rgb.iter().flatten().zip(b.rgb.iter().flatten());
    pairs.fold(0.0f32, |m, (x, y)| m.max((x - y).abs())) / scale
}

/// Lights that are replaced or turned in a running renderer give the picture of a fresh one.
fn lights_change_live() -> Result<(), Failed> {
    let gpu = gpu()?;
    let lit = lit(case(1, 64), "split_sum", "ggx:alpha=0.15")?;
    let settings = Settings::new(64, 64);
    let mut live = Renderer::new(gpu, lit.scene(), &settings)?;
    let (before, _) = live.render(gpu)?;
    let mut other = lit.direct.clone();
    other.points.truncate(1);
    other.points[0].intensity = [0.0, 20.0, 5.0];
    let light_rotation = Mat3::from_rotation_y(0.9);
    live.set_direct(gpu, other.clone())?;
    live.set_light_rotation(gpu, light_rotation);
    let (changed, _) = live.render(gpu)?;
    let fresh = Scene { direct: other, light_rotation, ..lit.scene() };
    let (expected, _) = Renderer::new(gpu, fresh, &settings)?.render(gpu)?;
    let (same, moved) = (largest_difference(&changed, &expected), largest_difference(&changed, &before));
    if same > 0.0 || moved < 1e-3 {
        return Err(format!("{same} from a fresh renderer, {moved} from before").into());
    }
    Ok(())
}

/// An object whose data hold the suns gets the point lights alone, also where other objects get all lights,
/// and after live changes.
fn folded_suns_are_not_added_twice() -> Result<(), Failed> {
    let gpu = gpu()?;
    let lit = lit(case(0, 48), "sh_irradiance", "lambert")?;
    let settings = Settings::new(48, 48);
    let points = Direct { points: lit.direct.points.clone(), ..Direct::default() };
    let mut folded = lit.scene();
    folded.objects[0].folds_suns = true;
    let expected = Scene { direct: points, ..lit.scene() };
    let [expected, all] = [expected, lit.scene()].map(|s| Renderer::new(gpu, s, &settings)?.render(gpu));
    let ((expected, _), (all, _)) = (expected?, all?);
    let mut live = Renderer::new(gpu, folded, &settings)?;
    let (first, _) = live.render(gpu)?;
    live.set_direct(gpu, lit.direct.clone())?;
    let (again, _) = live.render(gpu)?;
    let (same, others) = (largest_difference(&first, &expected), largest_difference(&first, &all));
    if same > 0.0 || others < 1e-2 || largest_difference(&again, &first) > 0.0 {
        return Err(format!("{same} from the points alone, {others} from all lights").into());
    }
    Ok(())
}

fn what_cannot_be_is_an_error() -> Result<(), Failed> {
    let gpu = gpu()?;
    let lit = lit(case(0, 16), "sh_irradiance", "lambert")?;
    let settings = Settings::new(8, 8);
    // An object without a reflectance is lit by its technique alone.
    let mut bare = lit.scene();
    bare.objects[0].brdf = None;
    let mut dark = lit.scene();
    dark.direct = Direct::default();
    let [bare, dark] = [bare, dark].map(|s| Renderer::new(gpu, s, &settings));
    let ((bare, _), (dark, _)) = (bare?.render(gpu)?, dark?.render(gpu)?);
    assert!(largest_difference(&bare, &dark) < 1e-6);
    let mut many = lit.scene();
    many.direct.points = vec![many.direct.points[0]; 65];
    let why =
        Renderer::new(gpu, many.clone(), &settings).map(|_| ()).expect_err("there are too many").to_string();
    assert!(why.contains("direct lights; 64 at most"), "{why}");
    let mut live = Renderer::new(gpu, lit.scene(), &settings)?;
    assert!(live.set_direct(gpu, many.direct).is_err());
    Ok(())
}

fn main() {
    let arguments = Arguments::from_args();
    let required = std::env::var_os("STERADIAN_REQUIRE_GPU").is_some();
    let ignored = gpu().is_err() && !required;
    let mut trials: Vec<Trial> = CASES
        .iter()
        .map(|&(k, slug, spec)| Trial::test(format!("{slug}::{spec}"), move || picture(k, slug, spec)))
        .collect();
    trials.push(Trial::test("shadows", shadows));
    trials.push(Trial::test("volumes", || volumes::against_rays(None)));
    for (slug, spec) in volumes::LOCALS {
        let name = format!("volumes under {slug}::{spec}");
        trials.push(Trial::test(name, move || volumes::against_rays(Some((slug, spec)))));
    }
    trials.push(Trial::test("lights_change_live", lights_change_live));
    trials.push(Trial::test("folded_suns_are_not_added_twice", folded_suns_are_not_added_twice));
    trials.push(Trial::test("what_cannot_be_is_an_error", what_cannot_be_is_an_error));
    let trials = trials.into_iter().map(|t| t.with_ignored_flag(ignored)).collect();
    libtest_mimic::run(&arguments, trials).exit();
}
