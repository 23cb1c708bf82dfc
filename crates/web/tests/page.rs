//! Pages of small scenes: every technique's shader is translated, files are of bounded size, and what
//! browsers cannot hold is refused.

use glam::{Affine3A, Mat3, Vec3};
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_gpu::scene::{Backdrop, Level, Object, Scene, Triangles};
use steradian_light::{Environment, Lights};
use steradian_scene::surface::SurfaceMaps;
use steradian_scene::{Camera, Mesh};
use steradian_sphere::{Layout, SphereImage};
use steradian_techniques::direct::{Direct, Suns, split};
use steradian_techniques::{AnyBake, AnyTechnique, Geometry, GpuTechnique, Material, Sites, registry};
use steradian_web::{Light, Page, Reference, Technique, Variant, WebError, files, object_module, sky_module};

fn lights() -> Lights {
    Environment { image: SphereImage::from_fn(Layout::LatLong, 16, 8, |d| [1.0 + d.y as f32; 3]) }.into()
}

fn bake(t: &dyn AnyTechnique, spec: &str, mesh: &Arc<Mesh>) -> Box<dyn AnyBake> {
    let material = Material::new(steradian_brdf::parse(spec).expect("a specimen"));
    let geometry = t.card().needs.sites.then(|| Geometry::new(mesh.clone(), Sites::Vertices));
    t.draft(&lights(), &material, geometry.as_ref(), &ParamValues::default(), &Task::quiet())
        .expect("a specimen bakes")
}

fn object(technique: GpuTechnique, mesh: &Mesh) -> Object {
    Object {
        triangles: Arc::new(Triangles::of(mesh, |_| true)),
        technique,
        brdf: None,
        folds_suns: true,
        base_colour: None,
        maps: SurfaceMaps::default(),
        transform: Affine3A::IDENTITY,
    }
}

/// naga writes what GLSL ES 3.00 has, and no stage reads a storage buffer.
#[test]
fn shaders_of_every_technique_are_translated() {
    let mesh = Arc::new(steradian_scene::shapes::sphere(6));
    for t in registry() {
        let Some(spec) = t.card().specimens.first() else { continue };
        let bake = bake(*t, spec, &mesh);
        for technique in [Some(bake.gpu()), bake.gpu_varied()].into_iter().flatten() {
            let slug = technique.slug;
            let object = object(technique, &mesh);
            let module = object_module(&object, "neutral").unwrap_or_else(|e| panic!("{e}"));
            for text in &module.glsl {
                assert!(text.starts_with("#version 300 es") && !text.contains("buffer "), "{slug}");
            }
            assert!(!module.wgsl.contains("var<storage"), "{slug}");
            let drawn = ["gpu_vertices", "gpu_camera", "gpu_object", "gpu_shown"];
            assert!(drawn.iter().all(|n| module.bindings.iter().any(|b| b.name == *n)), "{slug}");
        }
    }
    for mapper in steradian_web::TONE_MAPPERS {
        sky_module(mapper).unwrap_or_else(|e| panic!("{e}"));
    }
    assert_eq!(sky_module("no such"), Err(WebError::ToneMapper("no such".into())));
}

/// Suns shaded by the exact reflectance, beside every technique: what both bring is defined once.
#[test]
fn shaders_of_exact_suns_are_translated_beside_every_technique() {
    let mesh = Arc::new(steradian_scene::shapes::sphere(6));
    let brdf = steradian_brdf::parse("ggx:alpha=0.2").expect("a spec").shader();
    for t in registry() {
        let Some(spec) = t.card().specimens.first() else { continue };
        let object = Object { brdf: brdf.clone(), ..object(bake(*t, spec, &mesh).gpu(), &mesh) };
        let module = object_module(&object, "neutral").unwrap_or_else(|e| panic!("{e}"));
        assert!(module.bindings.iter().any(|b| b.name == "gpu_lights"), "{}", t.card().slug);
    }
}

/// Suns shaded by the exact reflectance, for every model that has shader text.
#[test]
fn shaders_of_exact_suns_are_translated() {
    let mesh = Arc::new(steradian_scene::shapes::sphere(6));
    let t = steradian_techniques::find("sh_irradiance").expect("registered");
    let technique = bake(t, "lambert", &mesh).gpu();
    for spec in ["ggx:alpha=0.2", "ward:ax=0.1,ay=0.4", "ashikhmin-shirley:nu=10,nv=100", "phong:n=20"] {
        let brdf = steradian_brdf::parse(spec).expect("a spec").shader();
        let object = Object { brdf, ..object(technique.clone(), &mesh) };
        let module = object_module(&object, "aces").unwrap_or_else(|e| panic!("{spec}: {e}"));
        assert!(module.bindings.iter().any(|b| b.name == "gpu_lights"), "{spec}");
        // The rule for suns at the horizon is for WebGPU.
        let body = |text: &str| {
            text.split("gpu_at_horizon(").nth(1).and_then(|t| t.split("\n}\n").next()).map(str::to_owned)
        };
        let [wgsl, glsl] = [&module.wgsl, &module.glsl[1]].map(|text| body(text).expect("suns"));
        assert!(
            wgsl.contains("wo.z") && glsl.contains("return false;") && !glsl.contains(".z"),
            "{spec}: {glsl}"
        );
    }
}

/// Suns on measured reflectance: the measurements are a texture.
#[test]
fn shaders_of_measured_reflectance_are_translated() {
    let mesh = Arc::new(steradian_scene::shapes::sphere(6));
    let t = steradian_techniques::find("sh_irradiance").expect("registered");
    let technique = bake(t, "lambert", &mesh).gpu();
    // Two counts of cells each way, all alike.
    let mut numbers = vec![0.0, 0.0, 0.0, 0.0, 2.0, 1.0, 2.0, 2.0];
    numbers.extend([0.3; 24]);
    let brdf = steradian_brdf::parse_with("csv:a.csv", steradian_brdf::Files::Held(&numbers)).expect("held");
    let object = Object { brdf: brdf.shader(), ..object(technique.clone(), &mesh) };
    let module = object_module(&object, "aces").unwrap_or_else(|e| panic!("{e}"));
    let cells = module.bindings.iter().find(|b| b.name == "brdf_cells").expect("a texture");
    assert!(cells.kind == "float" && !cells.layers && cells.glsl[1].is_some());
    let mut page = page();
    for light in &mut page.lights {
        for v in light.variants.iter_mut().flatten() {
            v.scene.objects = vec![object.clone()];
        }
    }
    let files = files(&page).expect("a page");
    let manifest = files.iter().find(|f| f.name == "page.js").expect("a manifest");
    let manifest = String::from_utf8_lossy(&manifest.bytes);
    assert!(manifest.contains("\"brdf_cells\":{\"format\":\"rgba16float\""));
}

fn page() -> Page {
    let mesh = Arc::new(steradian_scene::shapes::sphere(24));
    let (_, direct): (_, Direct) = split(&lights(), Suns::Exact);
    let variant = |slug: &str, spec: &str| {
        let t = steradian_techniques::find(slug).expect("registered");
        let scene = Scene {
            objects: vec![object(bake(t, spec, &mesh).gpu(), &mesh)],
            direct: direct.clone(),
            volumes: None,
            backdrop: Backdrop {
                image: Some(Level { width: 16, height: 8, texels: vec![[0.5; 3]; 128] }),
                ..Backdrop::default()
            },
            camera: Camera::Pinhole { from: Vec3::Z * 3.0, at: Vec3::ZERO, up: Vec3::Y, fov_y: 0.6 },
            light_rotation: Mat3::IDENTITY,
        };
        Some(Variant { scene, picture: vec![1, 2, 3], certificate: None, numbers: None })
    };
    let technique = |slug: &str| Technique { slug: slug.into(), title: slug.into(), source: "".into() };
    Page {
        title: "A <sphere>".into(),
        subtitle: "lambert".into(),
        tone_mapper: "neutral".into(),
        size: [4, 2],
        at: [0.0; 3],
        ground: false,
        techniques: vec![technique("sh_irradiance"), technique("diffuse_map")],
        lights: vec![Light {
            name: "Sky".into(),
            ev: 1.0,
            variants: vec![variant("sh_irradiance", "lambert"), variant("diffuse_map", "lambert")],
            reference: Some(Reference { texels: vec![[0.25, 0.5, 1.0, 1.0]; 8], picture: vec![4] }),
        }],
        version: "0".into(),
    }
}

#[test]
fn a_page_has_its_files_and_a_bounded_weight() {
    let files = files(&page()).expect("a page");
    let of =
        |name: &str| files.iter().find(|f| f.name == name).unwrap_or_else(|| panic!("{name} is missing"));
    let names =
        ["style.css", "viewer.js", "webgpu.js", "webgl2.js", "meshes.js", "light-0.js", "0-reference.png"];
    names.iter().for_each(|n| assert!(!of(n).bytes.is_empty(), "{n}"));
    assert_eq!(of("0-diffuse_map.png").bytes, [1, 2, 3]);
    let html = String::from_utf8_lossy(&of("index.html").bytes).into_owned();
    assert!(html.contains("A &lt;sphere&gt;") && !html.contains("<sphere>"));
    let manifest = String::from_utf8_lossy(&of("page.js").bytes).into_owned();
    let json = manifest.trim_start_matches("steradian.page(").trim_end_matches(");\n");
    let value: serde_json::Value = serde_json::from_str(json).expect("JSON");
    assert_eq!(value["lights"][0]["variants"].as_array().map(Vec::len), Some(2));
    // Both techniques draw one mesh.
    assert_eq!(value["meshes"].as_array().map(Vec::len), Some(1));
    assert_eq!(value["lights"][0]["variants"][0]["turns"], true);
    for f in &files {
        assert!(!f.bytes.is_empty() && f.bytes.len() < 400_000, "{} has {} bytes", f.name, f.bytes.len());
    }
    let all: usize = files.iter().map(|f| f.bytes.len()).sum();
    assert!(all < 700_000, "{all} bytes");
}

#[test]
fn pages_are_the_same_each_time() {
    assert_eq!(files(&page()), files(&page()));
}

#[test]
fn what_browsers_cannot_hold_is_refused_in_a_line() {
    let mut large = page();
    if let Some(v) = &mut large.lights[0].variants[0] {
        v.scene.backdrop.image = Some(Level { width: 20_000, height: 2, texels: vec![[0.5; 3]; 40_000] });
    }
    let refused = files(&large).expect_err("too large").to_string();
    assert!(refused.contains("the backdrop") && !refused.contains('\n'), "{refused}");
    let mapper = Page { tone_mapper: "other".into(), ..page() };
    assert_eq!(files(&mapper), Err(WebError::ToneMapper("other".into())));
}
