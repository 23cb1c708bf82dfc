//! A room as plain data for a GPU: WGSL text, tables, uniforms, buffers. No types of any graphics library.
//!
//! A room's WGSL has no bindings: it reads tables through generated functions `fetch_NAME` and uniforms as
//! `room.NAME`, and defines `fn shade(n, t, wo, p) -> vec3<f32>`; one that varies from point to point
//! ([`GpuRoom::varies`]) has `struct Lobe` (the numbers of [`crate::PointLobe`]) and `fn shade_lobe(n, t, wo, p, lobe)`
//! too. [`module`] makes the complete module, [`library`] what
//! other entry points start with.

mod wgsl;

use std::borrow::Cow;
pub use wgsl::{Binding, bindings, library, module};

/// A room as plain data for a GPU.
#[derive(Debug, Clone, PartialEq)]
pub struct GpuRoom {
    /// The room.
    pub slug: &'static str,
    /// The room's `shade.wgsl`.
    pub wgsl: Cow<'static, str>,
    /// Tables in binding order.
    pub tables: Vec<Table>,
    /// Members of `struct Room`, in order.
    pub uniforms: Vec<Uniform>,
    /// Data per site, in binding order.
    pub buffers: Vec<Buffer>,
}

/// A table that shading looks up.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The room's WGSL calls `fetch_NAME`.
    pub name: &'static str,
    /// Shape, and with it the arguments of `fetch_NAME`.
    pub shape: Shape,
    /// Texel format.
    pub format: Format,
    /// The texels.
    pub level: Level,
}

/// How a table is looked up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shape {
    /// Six layers in the Khronos orientation whose outer texels lie *on* the edges of the cube
    /// ([`steradian_prefilter::EdgeCube`]): `fetch_NAME(d: vec3<f32>) -> vec3<f32>`, bilinear.
    EdgeCube,
    /// A chain of such cubes in one atlas, each at x, y with its size: `fetch_NAME(d: vec3<f32>, level: f32)
    /// -> vec3<f32>`, trilinear.
    EdgeCubeChain(Vec<[u32; 3]>),
    /// Such cubes of one size, six layers each: `fetch_NAME(d: vec3<f32>, w: f32) -> vec3<f32>`, bilinear in cubes ⌊w⌋
    /// and ⌊w⌋ + 1 and linear between them (w clamped to 0 … count − 1), and `fetch_NAME_layer(d: vec3<f32>, k: u32)
    /// -> vec3<f32>` of cube k alone.
    CubeStack,
    /// Planes as [`Shape::Plane`], a layer each: `fetch_NAME(uv: vec2<f32>, w: f32) -> vec4<f32>`, linear between
    /// planes (w clamped to 0 … count − 1), and `fetch_NAME_layer(uv: vec2<f32>, k: u32) -> vec4<f32>`.
    PlaneStack,
    /// Lat-long maps whose first and last rows lie *on* the poles (texel centres of a row at half-integers), a layer
    /// each: `fetch_NAME(uv: vec2<f32>, k: u32) -> vec4<f32>` of layer k, u = 0.5 + β/2π (wraps), v = α/π from the upper
    /// pole to the lower one, bilinear.
    GlobeStack,
    /// A plane whose outer texels lie on the ends of [0, 1]²: `fetch_NAME(uv: vec2<f32>) -> vec4<f32>`,
    /// bilinear.
    Plane,
    /// A row whose outer texels lie on 0 and 1: `fetch_NAME(u: f32) -> vec4<f32>`, linear.
    Line,
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
}

impl Format {
    /// Bytes of a texel.
    pub fn bytes(self) -> usize {
        match self {
            Self::Rg32Float => 8,
            Self::Rgba32Float => 16,
        }
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
    /// `room.NAME` in WGSL.
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
            // A column of mat3x3 takes the room of a vec4 (WGSL, alignment and size).
            Self::Mat3(m) => m.iter().for_each(|c| floats(&[c[0], c[1], c[2], 0.0])),
            Self::Mat4(m) => m.iter().for_each(|c| floats(c)),
        }
    }
}

/// Data per site of a bake.
#[derive(Debug, Clone, PartialEq)]
pub struct Buffer {
    /// `fetch_NAME(site: u32, k: u32) -> f32` in WGSL, and in rooms that are [`GpuRoom::sited`]
    /// `fetch_NAME_at(site: Site, k: u32) -> f32`.
    pub name: &'static str,
    /// Numbers per site.
    pub stride: usize,
    /// Site after site.
    pub data: Vec<f32>,
}

impl GpuRoom {
    /// Does its WGSL read data per site (`fn shade_site(n, t, wo, p, site: Site) -> vec3<f32>` in place of `shade`)?
    /// `struct Site` holds the three sites around the point, their weights, which sum to 1, and texture coordinates:
    /// `index: vec3<u32>`, `weight: vec3<f32>`, `uv: vec2<f32>`. `fetch_NAME_at(site, k)` is number k of a buffer
    /// there.
    pub fn sited(&self) -> bool {
        self.wgsl.contains("fn shade_site(")
    }

    /// Where each uniform begins in [`GpuRoom::uniform_bytes`].
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

    /// Does its WGSL take a lobe per point (`fn shade_lobe(n, t, wo, p, lobe: Lobe) -> vec3<f32>` beside `shade`)?
    pub fn varies(&self) -> bool {
        self.wgsl.contains("fn shade_lobe(")
    }

    /// Sets the uniforms of these names; those that the room lacks, or has in another type, are left out.
    pub fn set_uniforms(&mut self, new: &[Uniform]) {
        for n in new {
            let same = |u: &&mut Uniform| u.name == n.name && u.value.wgsl() == n.value.wgsl();
            if let Some(u) = self.uniforms.iter_mut().find(same) {
                u.value = n.value;
            }
        }
    }

    /// The uniform buffer: `struct Room` in WGSL's layout for the uniform address space.
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
