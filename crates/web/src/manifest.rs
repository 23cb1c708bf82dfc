//! The files of a page.

use crate::data::Data;
use crate::model::{Light, Page, Variant};
use crate::packing::{self, Shared, UNITS};
use crate::shader::{Module, object_module, sky_module};
use crate::{TONE_MAPPERS, WebError};
use glam::Mat3;
use serde_json::{Map, Value, json};
use std::sync::Arc;
use steradian_gpu::lights::{CAPACITY, both};
use steradian_gpu::scene::{Object, Triangles};
use steradian_scene::Camera;

const INDEX: &str = include_str!("page/index.html");
const STYLE: &str = include_str!("page/style.css");
const VIEWER: &str = include_str!("page/viewer.js");
const WEBGPU: &str = include_str!("page/webgpu.js");
const WEBGL2: &str = include_str!("page/webgl2.js");

/// A file of a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name in the folder.
    pub name: String,
    /// What it holds.
    pub bytes: Vec<u8>,
}

impl File {
    fn new(name: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { name: name.into(), bytes: bytes.into() }
    }
}

/// All files of a page: `index.html` opens it.
pub fn files(page: &Page) -> Result<Vec<File>, WebError> {
    if !TONE_MAPPERS.contains(&page.tone_mapper.as_str()) {
        return Err(WebError::ToneMapper(page.tone_mapper.clone()));
    }
    let mut out = vec![
        File::new("index.html", INDEX.replace("{{title}}", &escaped(&page.title))),
        File::new("style.css", STYLE),
        File::new("viewer.js", VIEWER),
        File::new("webgpu.js", WEBGPU),
        File::new("webgl2.js", WEBGL2),
    ];
    let mut meshes = Meshes { data: Data::new("meshes"), known: Vec::new() };
    let mut lights = Vec::new();
    for (k, light) in page.lights.iter().enumerate() {
        lights.push(one_light(page, k, light, &mut meshes, &mut out)?);
    }
    let scenes = || page.lights.iter().flat_map(|l| &l.variants).flatten().map(|v| &v.scene);
    let techniques: Vec<Value> = page
        .techniques
        .iter()
        .map(|t| json!({"slug": t.slug, "title": t.title, "source": t.source}))
        .collect();
    let manifest = json!({
        "title": page.title,
        "subtitle": page.subtitle,
        "version": page.version,
        "size": page.size,
        "at": page.at,
        "ground": page.ground,
        "camera": scenes().next().map(|s| camera(&s.camera)),
        "techniques": techniques,
        "lights": lights,
        "meshes": meshes.known.iter().map(|(_, v)| v.clone()).collect::<Vec<_>>(),
        "sky": sky_module(&page.tone_mapper)?.json(),
    });
    let (name, bytes) = meshes.data.finish();
    out.push(File { name, bytes });
    out.push(File::new("page.js", format!("steradian.page({manifest});\n")));
    Ok(out)
}

/// Triangles by their addresses, or else by what they hold.
struct Meshes {
    data: Data,
    known: Vec<(Arc<Triangles>, Value)>,
}

impl Meshes {
    fn of(&mut self, t: &Arc<Triangles>) -> Result<usize, WebError> {
        if let Some(k) = self.known.iter().position(|(o, _)| Arc::ptr_eq(o, t) || o == t) {
            return Ok(k);
        }
        let value = packing::mesh(&mut self.data, t)?;
        self.known.push((t.clone(), value));
        Ok(self.known.len() - 1)
    }
}

fn one_light(
    page: &Page,
    k: usize,
    light: &Light,
    meshes: &mut Meshes,
    out: &mut Vec<File>,
) -> Result<Value, WebError> {
    let mut data = Data::new(&format!("light-{k}"));
    let gain = light.ev.exp2();
    let behind = light.variants.iter().flatten().next().map(|v| &v.scene.backdrop);
    let sky = behind.map(|b| packing::backdrop(&mut data, b)).transpose()?;
    let reference = match &light.reference {
        Some(r) => {
            out.push(File::new(format!("{k}-reference.png"), r.picture.clone()));
            json!({
                "texture": packing::reference(&mut data, &r.texels, page.size, gain)?,
                "picture": format!("{k}-reference.png"),
            })
        }
        None => Value::Null,
    };
    let mut variants = Vec::new();
    for (variant, technique) in light.variants.iter().zip(&page.techniques) {
        let Some(v) = variant else {
            variants.push(Value::Null);
            continue;
        };
        let name = format!("{k}-{}", technique.slug);
        out.push(File::new(format!("{name}.png"), v.picture.clone()));
        let mut data = Data::new(&name);
        let value = one_variant(page, v, &name, meshes, &mut data)?;
        let (name, bytes) = data.finish();
        out.push(File { name, bytes });
        variants.push(value);
    }
    let (name, bytes) = data.finish();
    out.push(File { name, bytes });
    Ok(json!({
        "name": light.name, "ev": light.ev, "sky": sky, "reference": reference, "variants": variants
    }))
}

fn one_variant(
    page: &Page,
    v: &Variant,
    name: &str,
    meshes: &mut Meshes,
    data: &mut Data,
) -> Result<Value, WebError> {
    let direct = &v.scene.direct;
    let count = direct.disks.len() + direct.directionals.len() + direct.points.len();
    if count > CAPACITY {
        return Err(WebError::TooLarge(format!("{count} lights beside the environment")));
    }
    let lights = both(direct, Mat3::IDENTITY).map(|b| data.push(&b, 4).json());
    let mut shared = Shared::new();
    let (mut modules, mut objects): (Vec<Module>, Vec<Value>) = (Vec::new(), Vec::new());
    let mut turns = true;
    for o in &v.scene.objects {
        let o = Object { technique: packing::halved(&o.technique), ..o.clone() };
        turns &= !o.technique.entry.site;
        let module = object_module(&o, &page.tone_mapper)?;
        check_units(&o, &module)?;
        let mut resources: Map<String, Value> = packing::technique(data, &o.technique)?;
        resources.extend(packing::object(data, &o, &mut shared)?);
        resources.insert("gpu_lights".into(), json!({"uniform": lights[usize::from(o.folds_suns)]}));
        let place = modules.iter().position(|m| *m == module).unwrap_or_else(|| {
            modules.push(module);
            modules.len() - 1
        });
        objects.push(json!({"mesh": meshes.of(&o.triangles)?, "module": place, "resources": resources}));
    }
    let text = Value::Array(modules.iter().map(Module::json).collect()).to_string();
    let numbers = v.numbers.map(|n| json!({"rms": n.relative_rms, "stops": n.stops, "flip": n.flip}));
    Ok(json!({
        "file": name,
        "picture": format!("{name}.png"),
        "modules": data.push(text.as_bytes(), 1).json(),
        "objects": objects,
        "turns": turns,
        "certificate": v.certificate,
        "numbers": numbers,
    }))
}

fn check_units(o: &Object, module: &Module) -> Result<(), WebError> {
    let textures = module.bindings.iter().filter(|b| b.kind != "uniform").count();
    if textures > UNITS {
        let slug = o.technique.slug;
        return Err(WebError::TooLarge(format!("the {textures} textures of {slug} with its maps")));
    }
    Ok(())
}

fn camera(c: &Camera) -> Value {
    match *c {
        Camera::Pinhole { from, up, fov_y, at } => json!({
            "from": from.to_array(), "at": at.to_array(), "up": up.to_array(), "fov": fov_y
        }),
        Camera::Orthographic { from, up, height, at } => json!({
            "from": from.to_array(), "at": at.to_array(), "up": up.to_array(), "height": height
        }),
    }
}

/// Text in which nothing is markup.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;").replace('\'', "&#39;")
}
