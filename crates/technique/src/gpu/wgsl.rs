//! Joins a technique's modules with their bindings.

use super::fetch;
use super::{GpuTechnique, Numbers, Storage};
use crate::PointLobe;
use std::borrow::Cow;
use std::fmt::Write;

/// `struct Lobe`.
pub const LOBE: &str = include_str!("lobe.wgsl");
/// `struct Site`.
pub const SITE: &str = include_str!("site.wgsl");

/// Planes of f32 of normal, tangent, direction to the viewer and position.
const PLANES: usize = 12;

/// The contents of a binding; bindings are numbered 0, 1, … within their group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Binding {
    /// `@group(0)`: the uniform buffer of [`GpuTechnique::uniform_bytes`].
    Uniforms,
    /// `@group(0)`: table i of [`GpuTechnique::tables`], a 2D-array texture (6 layers a cube, 1 a plane).
    Table(usize),
    /// `@group(0)`: buffer i of [`GpuTechnique::buffers`], read-only storage of 32-bit words.
    Buffer(usize),
    /// `@group(1)`: points as planes of f32 n.x n.y n.z t.x … wo.x … p.x … p.z, then where the entry takes a
    /// lobe the planes of [`crate::Points::lobe`], then where it takes a site the planes of three indices (as
    /// bits), two weights, u and v, and those of [`crate::Points::chart`]; read-only storage.
    Points,
    /// `@group(1)`: planes r g b of f32, storage.
    Radiance,
}

/// Bindings of group 0 and of group 1, in order.
pub fn bindings(technique: &GpuTechnique) -> [Vec<Binding>; 2] {
    let mut zero = Vec::new();
    if !technique.uniforms.is_empty() {
        zero.push(Binding::Uniforms);
    }
    zero.extend((0..technique.tables.len()).map(Binding::Table));
    zero.extend((0..technique.buffers.len()).map(Binding::Buffer));
    [zero, vec![Binding::Points, Binding::Radiance]]
}

/// The complete module: [`library`] and a compute entry point `main` (workgroups of 64) that shades a planar
/// buffer of points.
pub fn module(technique: &GpuTechnique) -> String {
    let entry = technique.entry;
    let vector = |k: usize| format!("point_vector({k}u, i, count)");
    let [n, t, wo, p] = [0, 3, 6, 9].map(vector);
    let site = PLANES + if entry.lobe { PointLobe::LEN } else { 0 };
    let lobe = format!("point_lobe({PLANES}u, i, count)");
    let call = entry.call([&n, &t, &wo, &p], &lobe, &format!("point_site({site}u, i, count)"));
    let parts = [
        (true, include_str!("batch.wgsl")),
        (entry.lobe, include_str!("batch_lobe.wgsl")),
        (entry.site, include_str!("batch_site.wgsl")),
    ];
    let mut out = library(technique);
    parts.iter().filter(|p| p.0).for_each(|p| out += p.1);
    let _ = writeln!(out, "fn point_radiance(i: u32, count: u32) -> vec3<f32> {{\n    return {call};\n}}");
    out
}

/// Bindings of group 0, `fetch_NAME` functions and the technique's modules, without an entry point: the
/// common start of every shader that calls the technique's [`super::Entry`].
pub fn library(technique: &GpuTechnique) -> String {
    library_modules(technique, Storage::Buffers).concat()
}

/// The modules of [`library`], in order, for devices that keep data per site in buffers or in textures. What
/// joins them with others keeps each once: techniques, their lights and reflectances may bring the same one.
pub fn library_modules(technique: &GpuTechnique, storage: Storage) -> Vec<Cow<'static, str>> {
    let mut declarations = String::new();
    let [zero, _] = bindings(technique);
    for (i, b) in zero.iter().enumerate() {
        bind(&mut declarations, technique, i, *b, storage);
    }
    let mut out = vec![declarations.into()];
    if technique.entry.lobe {
        out.push(LOBE.into());
    }
    if technique.entry.site {
        out.push(SITE.into());
    }
    out.push(fetch::functions(technique, storage).into());
    out.extend(technique.modules.iter().cloned());
    out
}

/// Writes to a `String` cannot fail, hence the ignored results.
fn bind(out: &mut String, technique: &GpuTechnique, i: usize, b: Binding, storage: Storage) {
    match b {
        Binding::Uniforms => {
            out.push_str("struct Technique {\n");
            for u in &technique.uniforms {
                let _ = writeln!(out, "    {}: {},", u.name, u.value.wgsl());
            }
            let _ = writeln!(out, "}}\n@group(0) @binding({i}) var<uniform> technique: Technique;");
        }
        Binding::Table(k) => {
            let name = technique.tables[k].name;
            let _ = writeln!(out, "@group(0) @binding({i}) var table_{name}: texture_2d_array<f32>;");
        }
        Binding::Buffer(k) => {
            let b = &technique.buffers[k];
            let word = if matches!(b.data, Numbers::F32(_)) { "f32" } else { "u32" };
            let name = b.name;
            let _ = match storage {
                Storage::Buffers => {
                    writeln!(out, "@group(0) @binding({i}) var<storage, read> buffer_{name}: array<{word}>;")
                }
                Storage::Textures => {
                    writeln!(out, "@group(0) @binding({i}) var buffer_{name}: texture_2d<u32>;")
                }
            };
        }
        Binding::Points | Binding::Radiance => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{Buffer, Entry, Format, Level, Shape, Table};

    /// Every shape in one module.
    #[test]
    fn fetches_of_every_shape_are_valid() {
        let shapes = [
            ("cube", Shape::EdgeCube, "fetch_cube(n)"),
            ("chain", Shape::EdgeCubeChain(vec![[0, 0, 1]]), "fetch_chain(n, 0.5)"),
            ("cubes", Shape::CubeStack, "fetch_cubes(n, 0.5) + fetch_cubes_layer(n, 1u)"),
            ("plane", Shape::Plane, "fetch_plane(n.xy).rgb"),
            ("planes", Shape::PlaneStack, "fetch_planes(n.xy, 0.5).rgb + fetch_planes_layer(n.xy, 1u).rgb"),
            ("globes", Shape::GlobeStack, "fetch_globes(n.xy, 1u).rgb"),
            ("line", Shape::Line, "fetch_line(n.x).rgb"),
            ("texture", Shape::Texture { levels: 2, rows: 1, wrap: 6 }, "fetch_texture(n.xy, 0.5, 1u).rgb"),
            ("texels", Shape::Texels, "fetch_texels(1u).rgb"),
            ("patch", Shape::Patch([3, 2, 2, 6]), "fetch_patch(taps_patch(n.xy, 0.5)[5].texel, 1u).rgb"),
        ];
        let sum: Vec<_> = shapes.iter().map(|s| s.2).collect();
        let sum = sum.join(" + ");
        let signature = "fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32>";
        let shade = format!("{signature} {{ return {sum}; }}").into();
        let level = || Level { width: 2, height: 2, layers: 12, bytes: vec![0; 16 * 48] };
        let table = |(name, shape, _)| Table { name, shape, format: Format::Rgba32Float, level: level() };
        let tables = shapes.into_iter().map(table).collect();
        let technique = GpuTechnique {
            slug: "all",
            modules: vec![shade],
            entry: Entry::PLAIN,
            tables,
            uniforms: Vec::new(),
            buffers: Vec::new(),
        };
        validate(&module(&technique));
    }

    /// Buffers of every precision, and an entry that takes both a lobe and a site.
    #[test]
    fn an_entry_may_take_a_lobe_and_a_site() {
        let half = vec![half::f16::from_f32(0.5); 2];
        let data = [
            ("singles", Numbers::F32(vec![0.5; 2])),
            ("halves", Numbers::F16(half)),
            ("bytes", Numbers::Unorm8 { low: -1.0, high: 1.0, bytes: vec![128; 2] }),
        ];
        let shade = "fn shade_both(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, lobe: Lobe, site: Site) \
                     -> vec3<f32> {
            return lobe.f0 * vec3<f32>(fetch_singles_at(site, 0u), fetch_halves_at(site, 1u), fetch_bytes(0u, 1u));
        }";
        let technique = GpuTechnique {
            slug: "both",
            modules: vec![shade.into()],
            entry: Entry { name: "shade_both", lobe: true, site: true },
            tables: Vec::new(),
            uniforms: Vec::new(),
            buffers: data.map(|(name, data)| Buffer { name, stride: 2, data }).into(),
        };
        validate(&module(&technique));
    }

    fn validate(text: &str) {
        let parsed = naga::front::wgsl::parse_str(text).map_err(|e| e.emit_to_string(text));
        let flags = naga::valid::ValidationFlags::all();
        let mut validator =
            naga::valid::Validator::new(flags, naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32);
        let valid = validator.validate(&parsed.unwrap());
        assert!(valid.is_ok(), "{:?}\n{text}", valid.err());
    }
}
