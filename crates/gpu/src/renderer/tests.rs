//! Every shader of every registered technique validates, without any adapter.

use super::{passes, resolve, volumes};
use crate::program::Program;
use crate::scene::{Filter, Path, Rate, Settings};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_light::{Environment, Lights};
use steradian_scene::Bvh;
use steradian_scene::shadow::{Blocker, LightAt, MapOptions, ShadowMaps, ShadowVolumes};
use steradian_sphere::{Layout, SphereImage};
use steradian_techniques::gpu::{Buffer, Entry, Storage, library_modules, shadow};
use steradian_techniques::{AnyTechnique, Geometry, GpuTechnique, Material, Sites, registry};

fn valid(what: &str, source: &str) {
    let module = match naga::front::wgsl::parse_str(source) {
        Ok(m) => m,
        Err(e) => panic!("{what}: {}", e.emit_to_string(source)),
    };
    let mut validator = Validator::new(
        ValidationFlags::all(),
        Capabilities::MULTISAMPLED_SHADING | Capabilities::SHADER_FLOAT16_IN_FLOAT32,
    );
    if let Err(e) = validator.validate(&module) {
        panic!("{what}: {}", e.emit_to_string(source));
    }
}

/// Every technique, with and without a lobe per point, and one that reads sites.
fn techniques() -> Vec<GpuTechnique> {
    let mesh = Arc::new(steradian_scene::shapes::sphere(6));
    let geometry = Geometry::new(mesh, Sites::Vertices);
    let lights: Lights =
        Environment { image: SphereImage::from_fn(Layout::LatLong, 16, 8, |d| [1.0 + d.y as f32; 3]) }.into();
    let bake = |t: &dyn AnyTechnique, spec: &str| {
        let material = Material::new(steradian_brdf::parse(spec).expect("a specimen"));
        let geometry = t.card().needs.sites.then_some(&geometry);
        t.draft(&lights, &material, geometry, &ParamValues::default(), &Task::quiet())
            .expect("a specimen bakes")
    };
    let specimens =
        registry().iter().flat_map(|t| t.card().specimens.iter().take(1).map(move |spec| (*t, *spec)));
    let bakes = specimens.map(|(t, spec)| bake(t, spec));
    let mut techniques: Vec<_> = bakes.flat_map(|b| [Some(b.gpu()), b.gpu_varied()]).flatten().collect();
    techniques.push(GpuTechnique {
        slug: "sited",
        modules: vec![
            "fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
            return vec3<f32>(fetch_data_at(site, 1u), site.uv);
        }"
            .into(),
        ],
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: Vec::new(),
        buffers: vec![Buffer::new("data", 2, vec![0.0; 2])],
    });
    let bvh = Bvh::build(&geometry.mesh);
    let light = LightAt::Far(glam::Vec3::Y);
    let maps = ShadowMaps::new(&geometry.mesh, &bvh, &[light], MapOptions { size: 8, taps: 3 });
    let volumes = ShadowVolumes::new(&geometry.mesh, &[light]);
    for by in [&bvh as &dyn Blocker, &maps, &volumes] {
        let flat = by.flat().expect("a form for GPUs");
        techniques.push(shadow::behind(techniques[0].clone(), &flat, 1e-4));
    }
    techniques
}

#[test]
fn shaders_validate_without_an_adapter() {
    let formats = [wgpu::TextureFormat::Rgba16Float, wgpu::TextureFormat::Rgba32Float];
    let settings = Settings { path: Path::Compute, ..Settings::new(8, 8) };
    valid("visibility", &passes::visibility_source());
    valid("backdrop", &passes::backdrop_source());
    valid("shadow volumes", &volumes::draw_source());
    for multi in [false, true] {
        valid("shadow volumes", &volumes::keep_source(multi));
    }
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
    let techniques = techniques();
    assert!(techniques.len() > registry().len());
    for technique in techniques {
        valid(technique.slug, &steradian_techniques::gpu::module(&technique));
        for mapped in [false, true] {
            let program = Program {
                library: library_modules(&technique, Storage::Buffers),
                entry: technique.entry,
                mapped,
                direct: vec![crate::lights::NONE.into()],
                shadowed: shadow::is_shadowed(&technique),
                volumes: shadow::is_behind_volumes(&technique),
                turned: false,
            };
            for rate in [Rate::Pixel, Rate::Sample] {
                let settings = Settings { rate, ..settings };
                valid(technique.slug, &passes::raster_source(&program, &settings));
            }
            for format in formats {
                valid(technique.slug, &passes::compute_source(&program, format));
            }
        }
    }
}
