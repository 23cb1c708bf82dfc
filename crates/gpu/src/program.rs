//! Shaders as text, without a device.

use crate::lights;
use crate::scene::Object;
use std::borrow::Cow;
use std::collections::HashSet;
use steradian_technique::gpu::{self, Entry, Storage};

/// `gpu_camera`, `gpu_ray`.
pub const CAMERA: &str = include_str!("shaders/camera.wgsl");
/// `gpu_object` and its triangles.
pub const GEOMETRY: &str = include_str!("shaders/geometry.wgsl");
/// WGSL that reads triangles from textures.
pub const GEOMETRY_TEXTURES: &str = include_str!("shaders/geometry_textures.wgsl");
/// The vertex entry point `gpu_vertex`.
pub const RASTER_VERTEX: &str = include_str!("shaders/raster_vertex.wgsl");
/// `gpu_background`.
pub const BACKDROP: &str = include_str!("shaders/backdrop.wgsl");
/// WGSL that reads disks from a texture.
pub const BACKDROP_TEXTURES: &str = include_str!("shaders/backdrop_textures.wgsl");
const SURFACE: &str = include_str!("shaders/surface.wgsl");
const PLAIN: &str = include_str!("shaders/plain.wgsl");
const MAPS: &str = include_str!("shaders/maps.wgsl");
const SITE: &str = include_str!("shaders/site.wgsl");

/// Parts from which the pipelines of an object are assembled.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Program {
    /// The modules of the technique's library.
    pub library: Vec<Cow<'static, str>>,
    /// The function that shades.
    pub entry: Entry,
    /// Are there maps or vertex colours?
    pub mapped: bool,
    /// The modules that define `gpu_direct`.
    pub direct: Vec<Cow<'static, str>>,
    /// Do rays, maps or volumes shadow lights?
    pub shadowed: bool,
    /// Do volumes?
    pub volumes: bool,
    /// Do shaders turn surfaces into the frame of the light ([`Program::textured`])?
    pub turned: bool,
}

impl Program {
    /// The program of `object`.
    pub fn of(object: &Object) -> Self {
        Self {
            library: gpu::library_modules(&object.technique, Storage::Buffers),
            entry: object.technique.entry,
            mapped: object.is_mapped(),
            direct: lights::modules(object),
            shadowed: gpu::shadow::is_shadowed(&object.technique),
            volumes: gpu::shadow::is_behind_volumes(&object.technique),
            turned: false,
        }
    }

    /// The program of `object` for devices without storage buffers, such as WebGL's: data per site lie in
    /// textures. The light turns without any change of the technique's data, except under techniques with
    /// data per site, whose light stands still.
    pub fn textured(object: &Object) -> Self {
        let library = gpu::library_modules(&object.technique, Storage::Textures);
        Self { library, turned: true, ..Self::of(object) }
    }
}

/// Values that rasterisation interpolates: members of `GpuVarying`, and whether they are constant over a
/// triangle.
const VARYING: [(&str, &str, bool); 8] = [
    ("p", "vec3<f32>", false),
    ("n", "vec3<f32>", false),
    ("t", "vec4<f32>", false),
    ("uv", "vec2<f32>", false),
    ("plane", "vec4<f32>", true),
    ("corners", "vec3<u32>", true),
    ("weights", "vec3<f32>", false),
    ("extra", "vec4<f32>", false),
];

/// `struct GpuVarying`, interpolated to `place`: `center` or `sample`.
pub fn varying(place: &str) -> String {
    let member = |(i, (name, ty, flat)): (usize, &(&str, &str, bool))| {
        let how = if *flat { "flat".into() } else { format!("perspective, {place}") };
        format!("    @location({i}) @interpolate({how}) {name}: {ty},\n")
    };
    let members: String = VARYING.iter().enumerate().map(member).collect();
    format!("struct GpuVarying {{\n    @builtin(position) position: vec4<f32>,\n{members}}}\n")
}

/// WGSL from an object's triangles to radiance, by the technique's own function; the caller adds functions
/// that read the triangles (`gpu_vertex_row` and its like).
pub fn surface(program: &Program) -> String {
    let entry = program.entry;
    let call = entry.call(["n", "t", "o", "p"], "look.lobe", "gpu_site_of(s, wo, footprint)");
    // Where nothing but the light is fixed in space, a rotation of the light is applied, inverted, to the
    // surface.
    let [n, t, o, p] = match program.turned && !entry.site {
        true => ["look.n", "look.t", "wo", "s.p"].map(|v| format!("gpu_camera.turn * {v}")),
        false => ["look.n", "look.t", "wo", "s.p"].map(str::to_owned),
    };
    let reflected = format!(
        "const GPU_SITED: bool = {};
const GPU_SHADOWED: bool = {};
fn gpu_reflected(look: GpuLook, wo: vec3<f32>, s: GpuPoint, footprint: f32) -> vec3<f32> {{
    let n = {n};
    let t = {t};
    let o = {o};
    let p = {p};
    return {call} + gpu_direct(n, t, o, p);
}}
",
        entry.site, program.shadowed
    );
    let parts = [
        // Maps make a lobe, whether the technique takes it or not.
        (program.mapped && !entry.lobe, gpu::LOBE),
        (program.mapped || entry.lobe, MAPS),
        (!(program.mapped || entry.lobe), PLAIN),
        (entry.site, SITE),
    ];
    let ends = [CAMERA, GEOMETRY, SURFACE, &reflected];
    let library = program.library.iter().map(|m| &**m);
    let parts = parts.into_iter().filter(|p| p.0).map(|p| p.1);
    once(library.chain(parts).chain(program.direct.iter().map(|m| &**m)).chain(ends))
}

/// The modules joined, each where it comes first: techniques, their lights and reflectances each bring the
/// functions that they call.
fn once<'a>(modules: impl Iterator<Item = &'a str>) -> String {
    let mut brought = HashSet::new();
    modules.filter(|m| brought.insert(*m)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_module_that_several_parts_bring_is_there_once() {
        let [a, b, c] = ["fn a() {}\n", "fn b() {}\n", "fn c() {}\n"];
        assert_eq!(once([a, b, a, a, c, b].into_iter()), [a, b, c].concat());
    }
}
