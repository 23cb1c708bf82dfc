//! A technique as plain data for a GPU: WGSL modules, the function that shades, tables, uniforms, buffers. No
//! types of any graphics library.
//!
//! A technique's WGSL has no bindings: it reads tables through generated functions `fetch_NAME` and uniforms
//! as `technique.NAME`. [`Entry`] declares the function that shades and which arguments it takes in addition
//! to normal, tangent, direction to the viewer and position. [`module`] makes the complete module,
//! [`library`] the text that modules with other entry points start with.

mod fetch;
mod light;
mod reflectance;
pub mod shadow;
mod wgsl;

pub use fetch::ROW;
pub use light::{Kernel, LightCube, LightTables};
pub use reflectance::{cells, own_reflectance, texels};
use std::borrow::Cow;
use steradian_scene::surface::Wrap;
pub use wgsl::{Binding, LOBE, SITE, bindings, library, library_modules, module};

/// Where shaders find data per site.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Storage {
    /// Storage buffers of 32-bit words.
    Buffers,
    /// Textures of one u32 a texel and [`ROW`] texels a row, row after row: WebGL has no storage buffers.
    Textures,
}

/// A technique as plain data for a GPU.
#[derive(Debug, Clone, PartialEq)]
pub struct GpuTechnique {
    /// The technique.
    pub slug: &'static str,
    /// WGSL texts without bindings, in the order in which they are joined.
    pub modules: Vec<Cow<'static, str>>,
    /// The shading function, which one of the modules defines.
    pub entry: Entry,
    /// Tables in binding order.
    pub tables: Vec<Table>,
    /// Members of `struct Technique`, in order.
    pub uniforms: Vec<Uniform>,
    /// Data per site, in binding order.
    pub buffers: Vec<Buffer>,
}

/// The WGSL function that shades a point:
/// `fn NAME(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32>`, with `lobe: Lobe` and
/// `site: Site` behind `p`, in this order, as far as they are declared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Entry {
    /// Its name.
    pub name: &'static str,
    /// Does it take a lobe per point: `struct Lobe`, the members of [`crate::PointLobe`]?
    pub lobe: bool,
    /// Does it take the point's place on the mesh? `struct Site` holds the three sites around the point,
    /// their weights, which sum to 1, texture coordinates and how these lie on the surface
    /// ([`crate::PointChart`]): `index: vec3<u32>`, `weight: vec3<f32>`, `uv: vec2<f32>`, `n: vec3<f32>`,
    /// `t: vec4<f32>` (w the side of the bitangent), `footprint: f32`; and `fetch_NAME_at(site, k)` is number
    /// k of a buffer there.
    pub site: bool,
}

impl Entry {
    /// `shade(n, t, wo, p)`.
    pub const PLAIN: Self = Self { name: "shade", lobe: false, site: false };
    /// `shade_lobe(n, t, wo, p, lobe)`.
    pub const LOBE: Self = Self { name: "shade_lobe", lobe: true, site: false };
    /// `shade_site(n, t, wo, p, site)`.
    pub const SITE: Self = Self { name: "shade_site", lobe: false, site: true };

    /// WGSL text of a call of the function. `point` has the expressions for n, t, wo and p; `lobe` and `site`
    /// are appended where the function takes them.
    pub fn call(&self, point: [&str; 4], lobe: &str, site: &str) -> String {
        let more = [(self.lobe, lobe), (self.site, site)].into_iter().filter(|a| a.0).map(|a| a.1);
        let all: Vec<&str> = point.into_iter().chain(more).collect();
        format!("{}({})", self.name, all.join(", "))
    }
}

/// A table that shading looks up.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The technique's WGSL calls `fetch_NAME`.
    pub name: &'static str,
    /// Shape, and with it the arguments of `fetch_NAME`.
    pub shape: Shape,
    /// Texel format.
    pub format: Format,
    /// The texels.
    pub level: Level,
}

/// The layout of a table and the function that looks it up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shape {
    /// Six layers in the Khronos orientation whose outer texels lie *on* the edges of the cube
    /// ([`steradian_prefilter::EdgeCube`]): `fetch_NAME(d: vec3<f32>) -> vec3<f32>`, bilinear.
    EdgeCube,
    /// A chain of such cubes in one atlas, each at x, y with its size: `fetch_NAME(d: vec3<f32>, level: f32)
    /// -> vec3<f32>`, trilinear.
    EdgeCubeChain(Vec<[u32; 3]>),
    /// Edge cubes of one size, six layers each: `fetch_NAME(d: vec3<f32>, w: f32) -> vec3<f32>`, bilinear in
    /// cubes ⌊w⌋ and ⌊w⌋ + 1 and linear between them (w clamped to 0 … count − 1), and `fetch_NAME_layer(d:
    /// vec3<f32>, k: u32) -> vec3<f32>` of cube k alone.
    CubeStack,
    /// Planes as [`Shape::Plane`], a layer each: `fetch_NAME(uv: vec2<f32>, w: f32) -> vec4<f32>`, linear
    /// between planes (w clamped to 0 … count − 1), and
    /// `fetch_NAME_layer(uv: vec2<f32>, k: u32) -> vec4<f32>`.
    PlaneStack,
    /// Lat-long maps whose first and last rows lie *on* the poles (texel centres of a row at half-integers),
    /// a layer each: `fetch_NAME(uv: vec2<f32>, k: u32) -> vec4<f32>` of layer k, u = 0.5 + β/2π (wraps), v =
    /// α/π from the upper pole to the lower one, bilinear.
    GlobeStack,
    /// A plane whose outer texels lie on the ends of [0, 1]²: `fetch_NAME(uv: vec2<f32>) -> vec4<f32>`,
    /// bilinear.
    Plane,
    /// A row whose outer texels lie on 0 and 1: `fetch_NAME(u: f32) -> vec4<f32>`, linear.
    Line,
    /// Textures of a surface, a layer each, whose levels lie one below the other
    /// ([`crate::shared::surface::texels::TextureLayers`]):
    /// `fetch_NAME(uv: vec2<f32>, footprint: f32, k: u32) -> vec4<f32>` of layer k, averaged over a square of
    /// side `footprint` in texture coordinates: bilinear in the two nearest levels.
    Texture {
        /// Levels.
        levels: u32,
        /// Rows of the finest.
        rows: u32,
        /// Wrap mode in u (two bits) and v: 0 repeats, 1 mirrors, 2 clamps.
        wrap: u32,
    },
    /// Entries one after the other, in rows of [`ROW`]: `fetch_NAME(i: u32) -> vec4<f32>` of entry i.
    Texels,
    /// Texels of a surface that are decoded before they are averaged, those of all levels one after the other
    /// ([`steradian_scene::surface::Patch`]) in rows of [`ROW`], a layer for each word: `fetch_NAME(i: u32,
    /// k: u32) -> vec4<f32>` is word k of texel i, and `taps_NAME(uv: vec2<f32>, footprint: f32) ->
    /// array<TextureTap, 8>` are the texels, and their weights, that a square of side `footprint` in texture
    /// coordinates averages. Columns, rows, levels, and the wrap modes as in [`Shape::Texture`].
    Patch([u32; 4]),
}

impl Shape {
    /// Is it looked up by direction in cubes?
    pub fn is_cube(&self) -> bool {
        matches!(self, Self::EdgeCube | Self::EdgeCubeChain(_) | Self::CubeStack)
    }
}

/// Texel formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Two f32.
    Rg32Float,
    /// Four f32.
    Rgba32Float,
    /// Four bytes, each over 255.
    Rgba8Unorm,
}

impl Format {
    /// Bytes of a texel.
    pub fn bytes(self) -> usize {
        match self {
            Self::Rg32Float => 8,
            Self::Rgba32Float => 16,
            Self::Rgba8Unorm => 4,
        }
    }
}

impl Table {
    /// Numbers of a texel.
    pub fn channels(&self) -> usize {
        if self.format == Format::Rg32Float { 2 } else { 4 }
    }

    /// The numbers of all texels as shaders read them.
    pub fn numbers(&self) -> Vec<f32> {
        match self.format {
            Format::Rgba8Unorm => self.level.bytes.iter().map(|b| f32::from(*b) / 255.0).collect(),
            _ => self.level.bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
        }
    }
}

/// A wrap mode in [`Shape::Texture`] and [`Shape::Patch`].
pub fn wrap_word(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }
}

/// The texels of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Texels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Layers: 6 a cube, else 1 a map.
    pub layers: usize,
    /// Little-endian texels, rows from the top, layers one after the other.
    pub bytes: Vec<u8>,
}

/// A named uniform.
#[derive(Debug, Clone, PartialEq)]
pub struct Uniform {
    /// `technique.NAME` in WGSL.
    pub name: &'static str,
    /// Type and value.
    pub value: Value,
}

/// Type and value of a uniform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// `f32`
    F32(f32),
    /// `vec4<f32>`
    Vec4([f32; 4]),
    /// `mat3x3<f32>`, columns
    Mat3([[f32; 3]; 3]),
    /// `mat4x4<f32>`, columns
    Mat4([[f32; 4]; 4]),
}

impl Value {
    /// The WGSL type.
    pub fn wgsl(&self) -> &'static str {
        match self {
            Self::F32(_) => "f32",
            Self::Vec4(_) => "vec4<f32>",
            Self::Mat3(_) => "mat3x3<f32>",
            Self::Mat4(_) => "mat4x4<f32>",
        }
    }

    fn align(&self) -> usize {
        if matches!(self, Self::F32(_)) { 4 } else { 16 }
    }

    fn put(&self, to: &mut Vec<u8>) {
        let mut floats = |v: &[f32]| v.iter().for_each(|x| to.extend(x.to_le_bytes()));
        match self {
            Self::F32(x) => floats(&[*x]),
            Self::Vec4(v) => floats(v),
            // A column of mat3x3 takes the space of a vec4 (WGSL, alignment and size).
            Self::Mat3(m) => m.iter().for_each(|c| floats(&[c[0], c[1], c[2], 0.0])),
            Self::Mat4(m) => m.iter().for_each(|c| floats(c)),
        }
    }
}

/// Data per site of a bake.
#[derive(Debug, Clone, PartialEq)]
pub struct Buffer {
    /// `fetch_NAME(site: u32, k: u32) -> f32` in WGSL, and where [`Entry::site`] is declared
    /// `fetch_NAME_at(site: Site, k: u32) -> f32`; `count_NAME() -> u32` is the number of sites.
    pub name: &'static str,
    /// Numbers per site.
    pub stride: usize,
    /// The numbers, site after site.
    pub data: Numbers,
}

impl Buffer {
    /// Numbers in single precision.
    pub fn new(name: &'static str, stride: usize, data: Vec<f32>) -> Self {
        Self { name, stride, data: Numbers::F32(data) }
    }
}

/// The numbers of a [`Buffer`] as they are stored; shaders read all as f32.
#[derive(Debug, Clone, PartialEq)]
pub enum Numbers {
    /// Single precision.
    F32(Vec<f32>),
    /// Half precision.
    F16(Vec<half::f16>),
    /// Bytes, of which 0 … 255 map linearly to `low` … `high`.
    Unorm8 {
        /// Value of byte 0.
        low: f32,
        /// Value of byte 255.
        high: f32,
        /// The bytes.
        bytes: Vec<u8>,
    },
}

impl Numbers {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::F16(v) => v.len(),
            Self::Unorm8 { bytes, .. } => bytes.len(),
        }
    }

    /// Are there none?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number `k`, as shaders read it; 0 beyond the end.
    pub fn at(&self, k: usize) -> f32 {
        match self {
            Self::F32(v) => v.get(k).copied().unwrap_or_default(),
            Self::F16(v) => v.get(k).map_or(0.0, |x| x.to_f32()),
            Self::Unorm8 { low, high, bytes } => {
                bytes.get(k).map_or(0.0, |b| low + (high - low) * (f32::from(*b) / 255.0))
            }
        }
    }

    /// The contents of the storage buffer: little-endian, padded to whole words.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out: Vec<u8> = match self {
            Self::F32(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::F16(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::Unorm8 { bytes, .. } => bytes.clone(),
        };
        out.resize(out.len().next_multiple_of(4), 0);
        out
    }

    /// Bytes of the storage buffer.
    pub fn bytes(&self) -> usize {
        let each = match self {
            Self::F32(_) => 4,
            Self::F16(_) => 2,
            Self::Unorm8 { .. } => 1,
        };
        (each * self.len()).next_multiple_of(4)
    }
}

impl GpuTechnique {
    /// Offset of each uniform in [`GpuTechnique::uniform_bytes`].
    pub fn uniform_offsets(&self) -> Vec<u64> {
        let mut bytes = Vec::new();
        let begin = |u: &Uniform| {
            bytes.resize(bytes.len().next_multiple_of(u.value.align()), 0);
            let at = bytes.len() as u64;
            u.value.put(&mut bytes);
            at
        };
        self.uniforms.iter().map(begin).collect()
    }

    /// Replaces the uniforms of these names; a uniform that the technique lacks, or has in another type, is
    /// ignored.
    pub fn set_uniforms(&mut self, new: &[Uniform]) {
        for n in new {
            let same = |u: &&mut Uniform| u.name == n.name && u.value.wgsl() == n.value.wgsl();
            if let Some(u) = self.uniforms.iter_mut().find(same) {
                u.value = n.value;
            }
        }
    }

    /// The uniform buffer: `struct Technique` in WGSL's layout for the uniform address space.
    pub fn uniform_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for u in &self.uniforms {
            bytes.resize(bytes.len().next_multiple_of(u.value.align()), 0);
            u.value.put(&mut bytes);
        }
        bytes.resize(bytes.len().next_multiple_of(16), 0);
        bytes
    }
}
