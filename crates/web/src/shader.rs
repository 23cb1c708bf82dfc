//! Shaders of a page: WGSL for WebGPU, and its translation for WebGL2.

use crate::{WebError, tone};
use naga::back::glsl;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Handle, ImageClass, ImageDimension, ScalarKind, ShaderStage, TypeInner};
use serde_json::{Value, json};
use steradian_gpu::program::{
    self, BACKDROP, BACKDROP_TEXTURES, CAMERA, GEOMETRY_TEXTURES, Program, RASTER_VERTEX,
};
use steradian_gpu::scene::Object;

const DISPLAY: &str = include_str!("shaders/display.wgsl");
const FRAGMENT: &str = include_str!("shaders/fragment.wgsl");
const SKY: &str = include_str!("shaders/sky.wgsl");

/// A module in both languages, with what it reads.
#[derive(Debug, Clone, PartialEq)]
pub struct Module {
    /// For WebGPU.
    pub wgsl: String,
    /// Entry points of the vertex and the fragment stage.
    pub entries: [&'static str; 2],
    /// GLSL ES 3.00 of both.
    pub glsl: [String; 2],
    /// What is read, by name.
    pub bindings: Vec<Binding>,
}

/// A variable that a module reads.
#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    /// Its name in WGSL.
    pub name: String,
    /// Group and binding in WGSL.
    pub at: [u32; 2],
    /// `uniform`, `float` or `uint`: a uniform buffer, or a texture of such texels.
    pub kind: &'static str,
    /// Is it an array of textures?
    pub layers: bool,
    /// Its name in the GLSL of each stage that reads it.
    pub glsl: [Option<String>; 2],
}

impl Module {
    /// As JSON, for the viewer.
    pub fn json(&self) -> Value {
        let binding = |b: &Binding| json!({"name": b.name, "at": b.at, "kind": b.kind, "layers": b.layers, "glsl": b.glsl});
        let bindings: Vec<Value> = self.bindings.iter().map(binding).collect();
        json!({"wgsl": self.wgsl, "entries": self.entries, "glsl": self.glsl, "bindings": bindings})
    }
}

fn tone(mapper: &str) -> Result<&'static str, WebError> {
    tone::source(mapper).ok_or_else(|| WebError::ToneMapper(mapper.into()))
}

/// The module that draws an object.
pub fn object_module(object: &Object, mapper: &str) -> Result<Module, WebError> {
    let surface = program::surface(&Program::textured(object));
    let varying = program::varying("center");
    let text = [&surface, GEOMETRY_TEXTURES, &varying, RASTER_VERTEX, DISPLAY, tone(mapper)?, FRAGMENT];
    let measured = object.brdf.as_ref().is_some_and(|b| b.cells().is_some());
    let without = [&HORIZON[..], if measured { &STRIPS } else { &[] }].concat();
    translated(object.technique.slug, text.concat(), &without, ["gpu_vertex", "gpu_page_fragment"])
}

/// The module that draws the backdrop.
pub fn sky_module(mapper: &str) -> Result<Module, WebError> {
    let text = [CAMERA, BACKDROP, BACKDROP_TEXTURES, DISPLAY, tone(mapper)?, SKY];
    translated("the backdrop", text.concat(), &[], ["gpu_page_sky_vertex", "gpu_page_sky_fragment"])
}

const STAGES: [ShaderStage; 2] = [ShaderStage::Vertex, ShaderStage::Fragment];

/// Functions that WebGL does without, and what they return.
type Without = [(&'static str, &'static str)];

/// Those by which suns at the horizon have a rule of their own. Their loops within loops, each with the
/// reflectance in it, are more than WebGL's compilers bear: the software one of Chromium takes all memory
/// instead of seconds.
const HORIZON: [(&str, &str); 3] =
    [("gpu_at_horizon", "false"), ("gpu_horizon_disk", "vec3<f32>()"), ("gpu_horizon_cell", "vec3<f32>()")];

/// Those by which disks that cross the horizon have one, which with measured reflectance in it takes the same
/// compiler 13 GB too: such disks take the rule of others, whose part below the horizon is black.
const STRIPS: [(&str, &str); 2] = [("gpu_takes_strips", "false"), ("gpu_strips", "vec3<f32>()")];

/// The text whose functions of these names return the values.
fn cut(wgsl: &str, without: &Without) -> String {
    let mut out = wgsl.to_owned();
    for (name, value) in without {
        let begin = out.find(&format!("fn {name}(")).and_then(|at| Some(at + out[at..].find(" {\n")? + 3));
        let end = begin.and_then(|at| Some(at + out[at..].find("\n}\n")?));
        if let (Some(begin), Some(end)) = (begin, end) {
            out.replace_range(begin..end, &format!("    return {value};"));
        }
    }
    out
}

/// A module of naga, and what its validation tells.
fn parsed(wgsl: &str) -> Result<(naga::Module, ModuleInfo), String> {
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| e.emit_to_string(wgsl))?;
    let capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32;
    let info = Validator::new(ValidationFlags::all(), capabilities).validate(&module);
    let info = info.map_err(|e| e.emit_to_string(wgsl))?;
    Ok((module, info))
}

fn translated(
    what: &str,
    wgsl: String,
    without: &Without,
    entries: [&'static str; 2],
) -> Result<Module, WebError> {
    let failed = |why: String| WebError::Shader { what: what.into(), why: why.replace('\n', " ") };
    parsed(&wgsl).map_err(failed)?;
    let (module, info) = parsed(&cut(&wgsl, without)).map_err(failed)?;
    let mut out = Module { entries, glsl: [String::new(), String::new()], bindings: bindings(&module), wgsl };
    for (k, stage) in STAGES.into_iter().enumerate() {
        let names = stage_names(&module, &info, stage, entries[k], &mut out.glsl[k]).map_err(failed)?;
        for b in &mut out.bindings {
            b.glsl[k] = names.iter().find(|(name, _)| *name == b.name).map(|(_, glsl)| glsl.clone());
        }
    }
    out.bindings.retain(|b| b.glsl.iter().any(Option::is_some));
    Ok(out)
}

/// Translates an entry point; the GLSL names of what it reads, by their names in WGSL.
fn stage_names(
    module: &naga::Module,
    info: &ModuleInfo,
    stage: ShaderStage,
    entry: &str,
    text: &mut String,
) -> Result<Vec<(String, String)>, String> {
    let options = glsl::Options {
        version: glsl::Version::Embedded { version: 300, is_webgl: true },
        writer_flags: glsl::WriterFlags::empty(),
        ..glsl::Options::default()
    };
    let pipeline = glsl::PipelineOptions { shader_stage: stage, entry_point: entry.into(), multiview: None };
    let policies = naga::proc::BoundsCheckPolicies::default();
    let written = glsl::Writer::new(text, module, info, &options, &pipeline, policies)
        .and_then(|mut w| w.write())
        .map_err(|e| e.to_string())?;
    let name = |h: Handle<naga::GlobalVariable>| module.global_variables[h].name.clone().unwrap_or_default();
    let textures = written.texture_mapping.iter().map(|(glsl, t)| (name(t.texture), glsl.clone()));
    let uniforms = written.uniforms.iter().map(|(h, glsl)| (name(*h), glsl.clone()));
    Ok(textures.chain(uniforms).collect())
}

fn bindings(module: &naga::Module) -> Vec<Binding> {
    let one = |(_, v): (Handle<_>, &naga::GlobalVariable)| {
        let at = v.binding?;
        let (kind, layers) = match (&module.types[v.ty].inner, v.space) {
            (_, AddressSpace::Uniform) => ("uniform", false),
            (TypeInner::Image { dim: ImageDimension::D2, arrayed, class }, _) => match class {
                ImageClass::Sampled { kind: ScalarKind::Uint, .. } => ("uint", *arrayed),
                _ => ("float", *arrayed),
            },
            _ => return None,
        };
        let name = v.name.clone().unwrap_or_default();
        Some(Binding { name, at: [at.group, at.binding], kind, layers, glsl: [None, None] })
    };
    module.global_variables.iter().filter_map(one).collect()
}
