//! What a mesh file holds.

use crate::image::{ReadOptions, decode_image_with};
use crate::{FormatError, Limits, Raster};
use std::path::{Path, PathBuf};

/// A mesh file's content.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshData {
    /// The pieces, in file order.
    pub parts: Vec<Part>,
    /// Materials that the parts refer to.
    pub materials: Vec<MaterialData>,
    /// Images that the materials refer to.
    pub textures: Vec<TextureSource>,
    /// Other files that were read: images, buffers, libraries of materials.
    pub files: Vec<PathBuf>,
    /// What was left out or mended, one line each.
    pub notes: Vec<String>,
}

/// Indexed triangles with shared vertex arrays. All numbers are finite and all indices in range; optional
/// arrays are either empty or as long as `positions`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Part {
    /// The file's name for it; may be empty.
    pub name: String,
    /// Positions, in the file's units, in the scene's frame (node transforms applied).
    pub positions: Vec<[f32; 3]>,
    /// Normals as in the file, not necessarily unit; (0, 0, 0) where only some vertices have one.
    pub normals: Vec<[f32; 3]>,
    /// Tangents; w is the sign of the bitangent w · (n × t), which points to smaller v (up in the texture).
    pub tangents: Vec<[f32; 4]>,
    /// Texture coordinates, v downwards (glTF); OBJ's and PLY's upward v is turned over.
    pub uvs: Vec<[f32; 2]>,
    /// Linear RGB per vertex; PLY's 8-bit values divided by 255.
    pub colors: Vec<[f32; 3]>,
    /// Three vertices a triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle: an index into [`MeshData::materials`]. Empty where there are no materials.
    pub materials: Vec<u32>,
    /// True where the format asks for flat shading because there are no normals (glTF).
    pub flat: bool,
}

/// A material in glTF's metallic–roughness terms; OBJ's Phong terms beside them.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialData {
    /// The file's name for it; may be empty.
    pub name: String,
    /// Base colour and opacity, linear.
    pub base_color: [f32; 4],
    /// Multiplies the base colour; sRGB.
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric … 1 metal.
    pub metallic: f32,
    /// Perceptual roughness (alpha is its square).
    pub perceptual_roughness: f32,
    /// Green multiplies the roughness, blue the metalness (OBJ: see `roughness_in_red`); linear.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Tangent-space normal map; linear.
    pub normal_texture: Option<TextureRef>,
    /// Scales the map's x and y.
    pub normal_scale: f32,
    /// Red is the unoccluded fraction of ambient light; linear.
    pub occlusion_texture: Option<TextureRef>,
    /// How much of the occlusion is applied.
    pub occlusion_strength: f32,
    /// Emitted radiance, linear.
    pub emissive: [f32; 3],
    /// Multiplies the emission; sRGB.
    pub emissive_texture: Option<TextureRef>,
    /// Below this opacity a surface is cut away; `None` where nothing is.
    pub alpha_cutoff: Option<f32>,
    /// Is the back shaded too?
    pub double_sided: bool,
    /// Reflectance at normal incidence of what is no metal.
    pub dielectric_f0: [f32; 3],
    /// Anisotropy of the highlight.
    pub anisotropy: Option<Anisotropy>,
    /// A layer of fibres over the rest.
    pub sheen: Option<Sheen>,
    /// What the file says of the material that has no place here: names of extensions, or of parts of them.
    pub unread: Vec<String>,
    /// OBJ's specular colour Ks and exponent Ns; `None` where the material is physically based.
    pub phong: Option<([f32; 3], f32)>,
}

impl Default for MaterialData {
    /// glTF's default material: white, metallic 1, perceptual roughness 1.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: [1.0; 4],
            base_color_texture: None,
            metallic: 1.0,
            perceptual_roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: [0.0; 3],
            emissive_texture: None,
            alpha_cutoff: None,
            double_sided: false,
            dielectric_f0: [DIELECTRIC_F0; 3],
            anisotropy: None,
            sheen: None,
            unread: Vec::new(),
            phong: None,
        }
    }
}

/// Reflectance of glTF's dielectric at normal incidence, index 1.5 (glTF 2.0, 3.9.6 and B.2).
pub const DIELECTRIC_F0: f32 = 0.04;

/// A highlight that is wider along one direction (KHR_materials_anisotropy).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anisotropy {
    /// 0 … 1: along the direction alpha becomes alpha + strength² (1 − alpha).
    pub strength: f32,
    /// From the tangent to the direction, radians, counter-clockwise.
    pub rotation: f32,
}

/// Charlie sheen (KHR_materials_sheen).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sheen {
    /// Its colour, linear.
    pub color: [f32; 3],
    /// Its perceptual roughness (alpha is its square).
    pub perceptual_roughness: f32,
}

/// How a material uses an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureRef {
    /// Index into [`MeshData::textures`].
    pub texture: usize,
    /// What lies beyond the unit square, in u and v.
    pub wrap: [Wrap; 2],
    /// Nearest texel instead of interpolation.
    pub nearest: bool,
    /// Texture coordinates are offset + scale·(rotated uv) (KHR_texture_transform).
    pub offset: [f32; 2],
    /// Radians, counter-clockwise in the texture.
    pub rotation: f32,
    /// See `offset`.
    pub scale: [f32; 2],
}

impl TextureRef {
    /// The whole image, repeated.
    pub fn new(texture: usize) -> Self {
        Self {
            texture,
            wrap: [Wrap::Repeat; 2],
            nearest: false,
            offset: [0.0; 2],
            rotation: 0.0,
            scale: [1.0; 2],
        }
    }

    /// The texture coordinates of the image for those of the mesh (KHR_texture_transform: T·R·S).
    pub fn transform(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let (s, c) = self.rotation.sin_cos();
        let (u, v) = (u * self.scale[0], v * self.scale[1]);
        [self.offset[0] + c * u + s * v, self.offset[1] - s * u + c * v]
    }
}

/// What a texture holds outside the unit square.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrap {
    /// Its copies.
    Repeat,
    /// Its copies, mirrored in turn.
    Mirror,
    /// Its border texels.
    Clamp,
}

/// An image of a mesh file, not decoded yet: most users need only some.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextureSource {
    /// File name or the file's own name for it.
    pub name: String,
    /// The encoded image (PNG, JPEG, …); empty where it was missing (noted).
    pub bytes: Vec<u8>,
}

impl TextureSource {
    /// The image. `data` textures (normals, roughness, occlusion) are read without the sRGB curve.
    pub fn decode(&self, data: bool, limits: &Limits) -> Result<Raster, FormatError> {
        let options = ReadOptions { limits: *limits, data, ..ReadOptions::default() };
        decode_image_with(Path::new(&self.name), &self.bytes, &options)
    }
}
