//! Techniques whose data differ from texel to texel.

use super::{LocalBaked, LocalFrame, LocalShading, LocalTechnique, LocalText, PerPoint, error};
use crate::tensors::{PartError, TensorFile};
use crate::{BakeError, Card, Geometry, Material};
use std::path::PathBuf;
use std::sync::Arc;
use steradian_base::{Field, ParamInfo, Params, Task, Value};
use steradian_relight::polynomial::Basis;
use steradian_scene::surface::{NormalMap, Texture};

/// Where on its textures a point lies.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Place {
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Side of the square, in texture coordinates, over which textures are averaged.
    pub footprint: f32,
}

/// The kind of data in a file that a technique's parameter names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// Heights from 0 (black) to 1 (white), in every channel.
    Heights,
    /// Unit normals: x along the tangent, y along the bitangent, z outwards.
    Normals,
    /// Linear colours.
    Colours,
    /// Numbers as they stand in the file.
    Numbers,
    /// A polynomial texture map: six planes, called NAME.0 to NAME.5, of the coefficients of u², v², uv, u, v
    /// and 1 in red, green and blue, or as many of spherical harmonics
    /// ([`AnyLocal::basis`](super::AnyLocal::basis)); white is 1.
    Polynomials,
    /// The pictures of a bidirectional texture function, which is the material's [`Material::apparent`].
    Bidirectional,
}

/// A file that a technique reads: the parameter of the same name gives its path, and [`Material::textures`]
/// has its contents under that name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The parameter.
    pub name: &'static str,
    /// The kind of data in the file.
    pub content: Content,
    /// Smallest and largest number accepted.
    pub range: [f32; 2],
    /// Channels that are read, from red on.
    pub channels: usize,
}

impl Plane {
    /// A file of this content.
    pub const fn new(name: &'static str, content: Content) -> Self {
        Self { name, content, range: [f32::NEG_INFINITY, f32::INFINITY], channels: 3 }
    }

    /// Restricts the file to numbers from `least` to `most` in its first `channels` channels; the others are
    /// not read.
    #[must_use]
    pub const fn within(self, least: f32, most: f32, channels: usize) -> Self {
        Self { range: [least, most], channels, ..self }
    }

    /// Column and row of the first texel of a texture that has a number out of range, and that number.
    pub fn beyond(&self, t: &Texture) -> Option<([usize; 2], f32)> {
        let ([least, most], (width, _, texels)) = (self.range, t.levels().next()?);
        let bad = |v: &&f32| !(least..=most).contains(*v);
        let found = texels.iter().map(|v| v.iter().take(self.channels).find(bad)).enumerate();
        found.filter_map(|(k, v)| Some(([k % width, k / width], *v?))).next()
    }
}

/// The name of a file as the value of a technique's parameter; the contents are in the plane of the material
/// that has the parameter's name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileName(pub PathBuf);

impl Field for FileName {
    fn from_value(value: &Value, _: &ParamInfo) -> Option<Self> {
        if let Value::File(path) = value { Some(Self(path.clone())) } else { None }
    }

    fn to_value(&self, _: &ParamInfo) -> Value {
        Value::File(self.0.clone())
    }
}

/// A technique for local light whose data may differ from texel to texel. Directions are those of the frame
/// of tangent, bitangent and normal of the surface itself, before any normal map; u grows along the tangent,
/// v against the bitangent. Points without texture coordinates are shaded as at (0, 0); callers without
/// coordinates check [`crate::Needs::uv`] first.
pub trait TexturedTechnique: Send + Sync + Sized + 'static {
    /// The technique's description of itself.
    const CARD: Card;
    /// The files that its parameters name.
    const PLANES: &'static [Plane];
    /// Parameters.
    type Params: Params;
    /// Its tables of the material.
    type Tables: Send + Sync;
    /// Values looked up once a point, for all lights.
    type Texel: Copy;

    /// Tabulates the material, whose reflectance [`Card::materials`] takes.
    fn bake(m: &Material, p: &Self::Params, task: &Task) -> Result<Self::Tables, BakeError>;
    /// Parameters with which shading needs no mesh, for techniques that need one with others
    /// ([`TexturedTechnique::needs_sites`]).
    const PER_POINT: &'static [(&'static str, f64)] = &[];
    /// Does shading with these parameters need the mesh and each point's place on it?
    fn needs_sites(p: &Self::Params) -> bool {
        let _ = p;
        false
    }
    /// Completes the tables with data of a mesh, where shading needs one; the sites are its vertices.
    fn transfer(
        t: Self::Tables,
        m: &Material,
        g: &Geometry,
        p: &Self::Params,
        task: &Task,
    ) -> Result<Self::Tables, BakeError> {
        let _ = (m, g, p, task);
        Ok(t)
    }
    /// The basis of the sums in [`Content::Polynomials`].
    fn basis(p: &Self::Params) -> Basis {
        let _ = p;
        Basis::default()
    }
    /// Figures for the certificate.
    fn details(t: &Self::Tables) -> Vec<(&'static str, f64)> {
        let _ = t;
        Vec::new()
    }
    /// Bytes that shading reads.
    fn bytes(t: &Self::Tables) -> usize;
    /// The normals that it shades with, so that the shading of all other light uses them too.
    fn normals(t: &Self::Tables) -> Option<Arc<NormalMap>> {
        let _ = t;
        None
    }
    /// Writes tables that the textures of the material do not give again; false where there are none.
    fn save(t: &Self::Tables, to: &mut TensorFile) -> bool {
        let _ = (t, to);
        false
    }
    /// The tables that [`TexturedTechnique::save`] wrote; `None` where it writes none.
    fn load(from: &TensorFile) -> Result<Option<Self::Tables>, PartError> {
        let _ = from;
        Ok(None)
    }
    /// Do its own tables differ from texel to texel?
    fn varies(t: &Self::Tables) -> bool {
        let _ = t;
        false
    }
    /// Definition of the stated error, as certificates print it.
    const METRIC: &'static str =
        "relative RMS error of f cos over texels and directions of light and view, of one local light";
    /// The error of the tables against the f · ⟨n·wi⟩ that they approximate.
    fn error(t: &Self::Tables, m: &Material) -> f64;
    /// Looks up the values of a point, seen from the unit direction `wo` above the surface.
    fn texel(t: &Self::Tables, at: Place, wo: [f32; 3]) -> Self::Texel;
    /// f · ⟨n·wi⟩ at a point, for unit directions, times the part of the light that bumps leave.
    fn f_cos(t: &Self::Tables, x: &Self::Texel, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3];
    /// `texel` and `f_cos` as text for a GPU: `local_texel(uv: vec2<f32>, footprint: f32, wo: vec3<f32>) ->
    /// LocalTexel` and `local_f_cos(x: LocalTexel, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32>`; `None` where
    /// the reflectance has none.
    fn text(t: &Self::Tables) -> Option<LocalText>;
    /// Shading under the lights of a frame.
    fn lit(b: &LocalBaked<Self>, frame: &LocalFrame<'_>) -> Result<Box<dyn LocalShading>, BakeError> {
        Ok(Box::new(PerPoint::<Self>::new(b, frame)))
    }
}

/// Definition of the stated error of techniques with one reflectance for the whole surface.
const METRIC: &str = "relative RMS error of f cos over directions of light and view, of one local light";

/// A technique with one reflectance is a textured one with nothing to look up.
impl<T: LocalTechnique> TexturedTechnique for T {
    const CARD: Card = <T as LocalTechnique>::CARD;
    const PLANES: &'static [Plane] = &[];
    const METRIC: &'static str = METRIC;
    const PER_POINT: &'static [(&'static str, f64)] = <T as LocalTechnique>::PER_POINT;
    type Params = <T as LocalTechnique>::Params;
    type Tables = <T as LocalTechnique>::Tables;
    type Texel = ();

    fn bake(m: &Material, p: &Self::Params, task: &Task) -> Result<Self::Tables, BakeError> {
        <T as LocalTechnique>::bake(m, p, task)
    }

    fn needs_sites(p: &Self::Params) -> bool {
        <T as LocalTechnique>::needs_sites(p)
    }

    fn details(t: &Self::Tables) -> Vec<(&'static str, f64)> {
        <T as LocalTechnique>::details(t)
    }

    fn bytes(t: &Self::Tables) -> usize {
        <T as LocalTechnique>::bytes(t)
    }

    fn error(t: &Self::Tables, m: &Material) -> f64 {
        let exact = T::stands_for(t, &*m.brdf);
        error(&*m.brdf, &exact, |wi, wo| <T as LocalTechnique>::f_cos(t, wi, wo))
    }

    #[inline(always)]
    fn texel(_: &Self::Tables, _: Place, _: [f32; 3]) {}

    #[inline(always)]
    fn f_cos(t: &Self::Tables, (): &(), wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        <T as LocalTechnique>::f_cos(t, wi, wo)
    }

    fn text(t: &Self::Tables) -> Option<LocalText> {
        <T as LocalTechnique>::text(t)
    }

    fn lit(b: &LocalBaked<Self>, frame: &LocalFrame<'_>) -> Result<Box<dyn LocalShading>, BakeError> {
        <T as LocalTechnique>::lit(b, frame)
    }
}
