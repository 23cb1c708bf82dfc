//! Every shader of every registered room validates, without any adapter.

use super::{passes, resolve};
use crate::scene::{Filter, Path, Rate, Settings};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use steradian_base::{ParamValues, Task};
use steradian_light::{Environment, Lights};
use steradian_sphere::{Layout, SphereImage};
use steradian_techniques::{GpuRoom, Material, registry};

fn valid(what: &str, source: &str) {
    let module = match naga::front::wgsl::parse_str(source) {
        Ok(m) => m,
        Err(e) => panic!("{what}: {}", e.emit_to_string(source)),
    };
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::MULTISAMPLED_SHADING);
    if let Err(e) = validator.validate(&module) {
        panic!("{what}: {}", e.emit_to_string(source));
    }
}

fn rooms() -> Vec<GpuRoom> {
    let lights: Lights =
        Environment { image: SphereImage::from_fn(Layout::LatLong, 16, 8, |d| [1.0 + d.y as f32; 3]) }.into();
    registry()
        .iter()
        .filter(|t| !t.card().needs.sites)
        .filter_map(|t| {
            let material = Material::new(steradian_brdf::parse(t.card().specimens.first()?).ok()?);
            let task = Task::quiet();
            let bake = t.bake(&lights, &material, None, &ParamValues::default(), &task).ok()?;
            Some([Some(bake.gpu()), bake.gpu_varied()])
        })
        .flatten()
        .flatten()
        .collect()
}

#[test]
fn shaders_validate_without_an_adapter() {
    let formats = [wgpu::TextureFormat::Rgba16Float, wgpu::TextureFormat::Rgba32Float];
    let settings = Settings { path: Path::Compute, ..Settings::new(8, 8) };
    valid("visibility", &passes::visibility_source());
    valid("backdrop", &passes::backdrop_source());
    for rate in [Rate::Pixel, Rate::Sample] {
        valid("list", &passes::list_source(rate));
    }
    for format in formats {
        valid("backdrop", &passes::backdrop_compute_source(format));
        for filter in [Filter::Spline, Filter::Mean] {
            valid("resolve", &resolve::source(true, format, filter));
            valid("resolve", &resolve::source(false, format, filter));
        }
    }
    let rooms = rooms();
    assert!(!rooms.is_empty());
    for room in rooms {
        for mapped in [false, true] {
            let library = super::object::library(&room, mapped);
            for rate in [Rate::Pixel, Rate::Sample] {
                let settings = Settings { rate, ..settings };
                valid(room.slug, &passes::raster_source(&library, &settings));
            }
            for format in formats {
                valid(room.slug, &passes::compute_source(&library, format));
            }
        }
    }
}
