//! The demo's scenes for tests and benchmarks, on the CPU and as plain data for the GPU.

#![allow(dead_code, reason = "each binary uses its part")]

use glam::{Affine3A, Mat3, Vec3};
use std::path::Path;
use std::process::Command;
use std::sync::{Arc, OnceLock};
use steradian_base::Task;
use steradian_brdf::SharedBrdf;
use steradian_gpu::scene::{Backdrop, Disk, Level, Object, Scene, Triangles};
use steradian_gpu::{Gpu, GpuError};
use steradian_light::{Environment, Lights};
use steradian_render::{BakeShader, Display, Film, Settings, Stage, Surface, SurfaceMaps};
use steradian_scene::{Bvh, Camera, Mesh, shapes};
use steradian_techniques::{AnyBake, GpuTechnique, View};

/// The adapter, opened once.
pub fn gpu() -> Result<&'static Gpu, GpuError> {
    static GPU: OnceLock<Result<Gpu, GpuError>> = OnceLock::new();
    GPU.get_or_init(Gpu::open).as_ref().map_err(Clone::clone)
}

/// Runs this program again without the optimisation of shaders by Mesa's software Vulkan, and exits with its
/// status.
///
/// Tests that run hundreds of shaders once each spend most of their time in it: without it, the tests of
/// techniques against their twins take 270 processor seconds in place of 428, maps 67 for 107, reflectances
/// 32 for 97. Programs that draw much gain nothing.
pub fn with_unoptimised_shaders() {
    const OPTIONS: &str = "GALLIVM_PERF";
    if std::env::var_os(OPTIONS).is_some() {
        return;
    }
    let again = std::env::current_exe().and_then(|program| {
        Command::new(program).args(std::env::args_os().skip(1)).env(OPTIONS, "nopt").status()
    });
    // If it cannot be started, this process goes on, slower.
    if let Ok(status) = again {
        std::process::exit(status.code().unwrap_or(1));
    }
}

/// A formula as a table of MERL's size, read from a file.
pub fn tabulated(spec: &str) -> SharedBrdf {
    let formula = steradian_brdf::parse(spec).expect("a spec");
    let table = steradian_brdf::measured::merl::tabulate(&*formula, &Task::quiet()).expect("not cancelled");
    let name = format!("steradian-merl-{}-{}.binary", std::process::id(), spec.replace([':', '='], "-"));
    let path = std::env::temp_dir().join(name);
    steradian_formats::write_merl(&path, &table).expect("written");
    let brdf = steradian_brdf::parse_with(&format!("merl:{}", path.display()), steradian_brdf::Files::Any)
        .expect("valid");
    std::fs::remove_file(path).expect("removed");
    brdf
}

/// A scene of the demo.
pub struct TestScene {
    pub shape: &'static str,
    pub sky: &'static str,
    pub brdf: &'static str,
    /// Azimuth and elevation of the camera, degrees; distance in bounding radii.
    pub view: (f32, f32, f32),
}

pub const SCENES: [TestScene; 4] = [
    TestScene {
        shape: "teapot",
        sky: "sky:elevation=38,azimuth=15,turbidity=2.5,ground=0.2/0.17/0.13",
        brdf: "lambert:albedo=0.65/0.4/0.28",
        view: (75.0, 4.0, 2.5),
    },
    TestScene {
        shape: "knot",
        sky: "studio",
        brdf: "ggx:alpha=0.15,f0=1.0/0.77/0.34",
        view: (75.0, 10.0, 2.3),
    },
    TestScene {
        shape: "knot",
        sky: "overcast:ground=0.25/0.22/0.18",
        brdf: "phong:n=30,scale=0.25/0.4/1",
        view: (75.0, 6.0, 2.3),
    },
    TestScene {
        shape: "teapot",
        sky: "sky:elevation=7,azimuth=140,turbidity=4,ground=0.16/0.14/0.12",
        brdf: "ggx:alpha=0.04,f0=0.9/0.92/0.94",
        view: (75.0, 4.0, 2.5),
    },
];

/// A scene of the demo, loaded.
pub struct Case {
    pub mesh: (Mesh, Bvh),
    pub lights: Lights,
    pub brdf: SharedBrdf,
    pub camera: Camera,
    pub backdrop: steradian_render::Backdrop,
}

pub fn case(k: usize, side: usize) -> Case {
    let s = &SCENES[k];
    let mesh = shapes::by_name(s.shape).expect("a shape of the demo");
    let (low, high) = mesh.bounds().expect("shapes have triangles");
    let (azimuth, elevation, distance) = (s.view.0.to_radians(), s.view.1.to_radians(), s.view.2);
    let away = Vec3::new(elevation.cos() * azimuth.cos(), elevation.sin(), elevation.cos() * azimuth.sin());
    let at = 0.5 * (low + high);
    let from = at + away * (0.5 * (high - low).length() * distance);
    let fov_y = 28f32.to_radians();
    let sky = steradian_light::sky::by_name(s.sky, 256, 128).expect("a sky of the demo");
    let environment = Some(Arc::new(Environment { image: sky.image }));
    let lights = Lights { environment, disks: sky.sun.into_iter().collect(), ..Lights::default() };
    let footprint = 2.0 * f64::from(0.5 * fov_y).tan() / side as f64;
    let bvh = Bvh::build(&mesh);
    Case {
        mesh: (mesh, bvh),
        backdrop: steradian_render::Backdrop::new(&lights, footprint.max(2f64.to_radians())),
        lights,
        brdf: steradian_brdf::parse(s.brdf).expect("a material of the demo"),
        camera: Camera::Pinhole { from, at, up: Vec3::Y, fov_y },
    }
}

pub fn view(case: &Case) -> View {
    let Camera::Pinhole { from, .. } = case.camera else { return View::default() };
    View { eye: from, forward: case.camera.axes()[2], ..View::default() }
}

/// The case with `technique` on its mesh.
pub fn scene(case: &Case, technique: GpuTechnique) -> Scene {
    let triangles = Arc::new(Triangles::of(&case.mesh.0, |_| true));
    Scene {
        objects: vec![Object {
            triangles,
            technique,
            brdf: None,
            folds_suns: false,
            base_colour: None,
            maps: SurfaceMaps::default(),
            transform: Affine3A::IDENTITY,
        }],
        direct: Default::default(),
        volumes: None,
        backdrop: backdrop(&case.backdrop),
        camera: case.camera,
        light_rotation: Mat3::IDENTITY,
    }
}

pub fn backdrop(b: &steradian_render::Backdrop) -> Backdrop {
    let level = |i: &steradian_sphere::SphereImage| Level {
        width: i.width,
        height: i.height,
        texels: (0..i.width * i.height).map(|k| [i.planes[0][k], i.planes[1][k], i.planes[2][k]]).collect(),
    };
    let disk = |&(direction, cosine, radiance): &(Vec3, f32, [f32; 3])| Disk {
        direction,
        angular_radius: cosine.clamp(-1.0, 1.0).acos(),
        radiance,
    };
    Backdrop { colour: [0.0; 3], image: b.image().map(level), disks: b.disks().iter().map(disk).collect() }
}

/// The CPU's picture of one technique.
pub fn cpu(case: &Case, bake: Box<dyn AnyBake>, side: usize) -> Film {
    cpu_of(case, vec![(bake, None)], &Settings::new(side, side))
}

/// A technique and the texture on its surface.
pub type ShadedBy = (Box<dyn AnyBake>, Option<Arc<steradian_render::Texture>>);

/// The CPU's picture of a mesh of several material slots.
pub fn cpu_of(case: &Case, techniques: Vec<ShadedBy>, settings: &Settings) -> Film {
    let surface = |(bake, base_colour)| Surface {
        shader: Arc::new(BakeShader(bake)),
        base_colour,
        maps: SurfaceMaps::default(),
    };
    let surfaces: Vec<_> = techniques.into_iter().map(surface).collect();
    let background = steradian_render::Background::Sky(case.backdrop.clone());
    let stage = Stage {
        mesh: &case.mesh.0,
        bvh: &case.mesh.1,
        surfaces: &surfaces,
        background: &background,
        camera: case.camera,
    };
    steradian_render::render(&stage, settings, &Task::quiet()).expect("nobody cancels")
}

/// Writes a picture as PNG.
pub fn keep(folder: &Path, name: &str, picture: &Display) {
    let plane = |c: usize| picture.rgb.iter().skip(c).step_by(3).map(|v| f32::from(*v) / 255.0).collect();
    let raster =
        steradian_formats::Raster::rgb(picture.width, picture.height, [plane(0), plane(1), plane(2)]);
    let options = steradian_formats::WriteOptions { already_encoded: true, ..Default::default() };
    steradian_formats::write_image(&folder.join(format!("{name}.png")), &raster, &options).expect("writable");
}
