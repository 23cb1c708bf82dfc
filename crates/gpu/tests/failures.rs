//! No adapter, a lost device, missing features and limits, too much memory: an error of one line that says
//! what to do, never a panic.
//!
//! Without an adapter the tests show as ignored, but for the one of a missing adapter;
//! `STERADIAN_REQUIRE_GPU=1` (CI sets it) makes that a failure.

mod common;

use common::{case, gpu, scene};
use libtest_mimic::{Arguments, Failed, Trial};
use steradian_base::Task;
use steradian_gpu::scene::{Backdrop, Path, Settings};
use steradian_gpu::{ComputeTechnique, Gpu, GpuError, Renderer};
use steradian_techniques::gpu::Buffer;
use steradian_techniques::{AnyBake, GpuTechnique, Material, PointsBuf};

const SIDE: usize = 32;

/// Environment variable that makes this binary, run again without any driver, open a device and print the
/// error.
const PROBE: &str = "STERADIAN_PROBE_ADAPTER";

fn bake() -> Result<(common::Case, Box<dyn AnyBake>), Failed> {
    let case = case(0, SIDE);
    let t = steradian_techniques::find("sh_irradiance").ok_or("no such technique")?;
    let material = Material::new(case.brdf.clone());
    let bake = t.draft(&case.lights, &material, None, &Default::default(), &Task::quiet())?;
    Ok((case, bake))
}

#[expect(clippy::print_stdout, reason = "the answer to the test that runs this")]
fn probe() {
    match Gpu::open() {
        Ok(gpu) => println!("found {}", gpu.describe()),
        Err(e) => println!("{e}"),
    }
}

/// Vulkan's loader finds no driver: the line names the package.
fn no_adapter_names_the_package() -> Result<(), Failed> {
    let mut again = std::process::Command::new(std::env::current_exe()?);
    let nothing = "/nonexistent/icd.json";
    let said = again
        .env(PROBE, "1")
        .env("VK_ICD_FILENAMES", nothing)
        .env("VK_DRIVER_FILES", nothing)
        .env("WGPU_BACKEND", "vulkan")
        .output()?;
    let line = String::from_utf8_lossy(&said.stdout).trim().to_owned();
    let good =
        line.starts_with("no GPU adapter") && line.contains("mesa-vulkan-drivers") && !line.contains('\n');
    if said.status.success() && good { Ok(()) } else { Err(format!("'{line}', {}", said.status).into()) }
}

fn lost<T>(what: &str, r: Result<T, GpuError>) -> Result<(), Failed> {
    match r {
        Err(e @ GpuError::Lost(_)) if !e.to_string().contains('\n') => Ok(()),
        Err(e) => Err(format!("{what}: {e}").into()),
        Ok(_) => Err(format!("{what}: nothing was noticed").into()),
    }
}

/// Every call on a lost device reports the loss, every time.
fn a_lost_device_is_an_error_for_ever() -> Result<(), Failed> {
    let gpu = Gpu::open()?;
    let (case, bake) = bake()?;
    for path in [Path::Raster, Path::Compute] {
        let settings = Settings { path, ..Settings::new(SIDE, SIDE) };
        let mut renderer = Renderer::new(&gpu, scene(&case, bake.gpu()), &settings);
        let twin = ComputeTechnique::new(&gpu, &bake.gpu());
        if path == Path::Raster {
            let renderer = renderer.as_mut().map_err(|e| e.clone())?;
            let twin = twin.map_err(|e| e.to_string())?;
            renderer.render(&gpu)?;
            gpu.destroy();
            for _ in 0..2 {
                lost("render", renderer.render(&gpu))?;
                lost("draw", renderer.draw(&gpu))?;
            }
            renderer.set_camera(&gpu, case.camera);
            lost("uniforms", renderer.update_technique(&gpu, 0, &bake.gpu()))?;
            lost("technique", renderer.set_technique(&gpu, 0, bake.gpu()))?;
            lost("backdrop", renderer.set_backdrop(&gpu, Backdrop::default()))?;
            let mut points = PointsBuf::default();
            let up = glam::Vec3::Y;
            points.push(up, glam::Vec3::X, up, glam::Vec3::ZERO);
            lost("shading", twin.shade(&gpu, &points))?;
            lost("bandwidth", gpu.copy_bandwidth(1 << 20))?;
        } else {
            lost("renderer", renderer)?;
            lost("technique", twin)?;
        }
    }
    Ok(())
}

/// With WebGPU's own limits and no optional feature both paths draw, nothing is timed, and an exceeded limit
/// is reported.
fn a_portable_device_draws_and_names_its_limits() -> Result<(), Failed> {
    let gpu = Gpu::open_portable()?;
    let (case, bake) = bake()?;
    let full = common::gpu()?;
    for path in [Path::Raster, Path::Compute] {
        let settings = Settings { path, ..Settings::new(SIDE, SIDE) };
        let (picture, timings) = Renderer::new(&gpu, scene(&case, bake.gpu()), &settings)?.render(&gpu)?;
        let (expected, _) = Renderer::new(full, scene(&case, bake.gpu()), &settings)?.render(full)?;
        let most = expected.rgb[0].iter().fold(0.0f32, |m, x| m.max(*x));
        let pairs = picture.rgb[0].iter().zip(&expected.rgb[0]);
        let off = pairs.fold(0.0f32, |m, (a, b)| m.max((a - b).abs())) / most;
        // 16-bit floats have a unit of 2⁻¹¹.
        if off > 1e-3 || !timings.passes.is_empty() || gpu.has_timestamps() {
            return Err(format!("{path:?}: {off} off, {timings:?}").into());
        }
    }
    let fails =
        |technique: GpuTechnique| match Renderer::new(&gpu, scene(&case, technique), &Settings::new(8, 8)) {
            Err(e @ GpuError::Memory(_)) => Ok(e.to_string()),
            Err(e) => Err(format!("another error: {e}")),
            Ok(_) => Err("made".into()),
        };
    let buffer = |k: usize| Buffer::new(["a", "b", "c", "d", "e", "f", "g", "h"][k], 1, vec![0.0]);
    let many = GpuTechnique { buffers: (0..8).map(buffer).collect(), ..bake.gpu() };
    assert!(fails(many)?.contains("8 buffers of sh_irradiance"));
    let large = Buffer::new("a", 1, vec![0.0; (128 << 20) / 4 + 1]);
    assert!(fails(GpuTechnique { buffers: vec![large], ..bake.gpu() })?.contains("buffer 'a'"));
    match Renderer::new(&gpu, scene(&case, bake.gpu()), &Settings::new(9000, 8)) {
        Err(e) => assert!(e.to_string().contains("9000 texels a side"), "{e}"),
        Ok(_) => return Err("a picture beyond the limits was made".into()),
    }
    Ok(())
}

/// More than the device has.
fn too_much_memory_is_an_error() -> Result<(), Failed> {
    let gpu = gpu()?;
    match gpu.copy_bandwidth(1 << 50) {
        Err(GpuError::Memory(_)) => Ok(()),
        Err(e) => Err(e.into()),
        Ok(_) => Err("copied".into()),
    }
}

fn main() {
    if std::env::var_os(PROBE).is_some() {
        return probe();
    }
    let arguments = Arguments::from_args();
    let ignored = gpu().is_err() && std::env::var_os("STERADIAN_REQUIRE_GPU").is_none();
    type Test = (&'static str, fn() -> Result<(), Failed>);
    let tests: [Test; 3] = [
        ("a_lost_device_is_an_error_for_ever", a_lost_device_is_an_error_for_ever),
        ("a_portable_device_draws_and_names_its_limits", a_portable_device_draws_and_names_its_limits),
        ("too_much_memory_is_an_error", too_much_memory_is_an_error),
    ];
    let mut trials: Vec<_> =
        tests.into_iter().map(|(name, test)| Trial::test(name, test).with_ignored_flag(ignored)).collect();
    trials.push(
        Trial::test("no_adapter_names_the_package", no_adapter_names_the_package)
            .with_ignored_flag(!cfg!(target_os = "linux")),
    );
    libtest_mimic::run(&arguments, trials).exit();
}
