//! Techniques for local light: directional and point lights, one by one, in place of their exact shading.
//!
//! > L_o(x, wo) = Σ_l V_l(x) f̂(wi_l, wo) E_l,  E_l = I/r² of a point light, the irradiance of a directional one
//!
//! where f̂ is a technique's approximation of f · ⟨n·wi⟩. Environments and disks stay with a
//! [`crate::Technique`], and both parts add up: [`split`] gives every light to one of them. Light is never
//! part of a local technique's tables, so lights may move in every frame. Units: radiance in W sr⁻¹ m⁻²,
//! intensity in W sr⁻¹, irradiance in W m⁻².
//!
//! A local technique has [`crate::Capabilities::global`] off.

mod certify;
mod lights;
mod per_point;
mod textured;

pub use certify::{Pair, error, error_at, error_of, pairs, texel, texel_at};
pub use lights::{Light, LocalLights, split};
pub use per_point::PerPoint;
pub use per_point::arriving;
pub use textured::{Content, FileName, Place, Plane, TexturedTechnique};

use crate::direct::Shadows;
use crate::gpu::{Buffer, Entry, Table, Uniform, Value, own_reflectance};
use crate::shared;
use crate::shared::surface::kept;
use crate::tensors::{self, TensorFile};
use crate::{
    BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Points, Radiance, View,
};
use glam::DVec3;
use std::borrow::Cow;
use std::marker::PhantomData;
use std::sync::Arc;
use steradian_base::{Certificate, Evidence, ParamInfo, ParamValues, Params, Task};
use steradian_brdf::{Brdf, SharedBrdf};
use steradian_relight::polynomial::Basis;
use steradian_scene::Mesh;
use steradian_scene::surface::NormalMap;

/// The entry for light in the Cards of local techniques.
pub const LIGHT: &str = "directional and point lights, exact";
/// The entry for visibility in the Cards of local techniques without shadows of their own.
pub const VISIBILITY: &str = "rays at each point where asked for";
/// Capabilities of every local technique: neither light nor mesh is in its tables, so both may change.
pub const CAPABILITIES: Capabilities =
    Capabilities { dynamic_lighting: true, dynamic_objects: true, ..Capabilities::NONE };
/// Needs of local techniques that shade each point on its own.
pub const NEEDS: Needs = Needs { environment: false, sites: false, uv: false, tangents: true, view: false };
/// Needs of local techniques with data per texel.
pub const NEEDS_TEXELS: Needs = Needs { uv: true, ..NEEDS };

/// Common fields of the Cards of techniques that tabulate f · ⟨n·wi⟩ of two directions; each Card fills in
/// its own.
pub const CARD: Card = Card {
    slug: "",
    title: "",
    citation: "",
    equation: "",
    light: LIGHT,
    visibility: VISIBILITY,
    reflectance: "",
    materials: |_| Ok(()),
    specimens: &[],
    exact_when: &[],
    capabilities: Capabilities { bump_mapping: true, ..CAPABILITIES },
    needs: NEEDS,
    waived: &[],
};

/// The claim that a reflectance is exact under a near point light, up to the spacing of entries.
pub const fn near(statement: &'static str, brdf: &'static str) -> Claim {
    Claim::new(statement, shared::trials::lights::near_point, brdf, 1e-3)
}

/// The claim of [`near`], under three directional lights.
pub const fn far(statement: &'static str, brdf: &'static str) -> Claim {
    Claim::new(statement, shared::trials::lights::three_directionals, brdf, 1e-3)
}

/// Prefix of the names of textures in saved bakes.
const PLANE: &str = "plane.";

/// Tolerance of tables where the user gives none.
const TOLERANCE: f64 = 1e-3;
/// Fewest and most entries a side, where the tolerance decides.
const SIDES: [usize; 2] = [64, 2048];

/// Tables of `side` entries a side, by default of as many as the task's tolerance needs: their `error` is
/// half of it at most.
pub fn tables<T>(
    side: Option<usize>,
    task: &Task,
    make: impl Fn(usize) -> T,
    error: impl Fn(&T) -> f64,
) -> Result<T, BakeError> {
    if let Some(side) = side {
        return Ok(make(side));
    }
    let tolerance = task.tolerance().unwrap_or(TOLERANCE);
    let mut side = SIDES[0];
    loop {
        task.check()?;
        let tables = make(side);
        if side >= SIDES[1] || error(&tables) <= 0.5 * tolerance {
            return Ok(tables);
        }
        side *= 2;
    }
}

/// f · ⟨n·wi⟩ of two local directions.
pub type FCos<'a> = Box<dyn Fn(DVec3, DVec3) -> [f64; 3] + Sync + 'a>;

/// A technique for local light on surfaces with one reflectance; techniques for textured surfaces are
/// [`TexturedTechnique`]s.
pub trait LocalTechnique: Send + Sync + Sized + 'static {
    /// The technique's description of itself.
    const CARD: Card;
    /// Parameters.
    type Params: Params;
    /// Its tables of the reflectance.
    type Tables: Send + Sync;

    /// Tabulates the reflectance, which [`Card::materials`] takes; to the task's tolerance where the
    /// technique chooses sizes.
    fn bake(m: &Material, p: &Self::Params, task: &Task) -> Result<Self::Tables, BakeError>;
    /// Parameters with which shading needs no mesh, for techniques that need one with others
    /// ([`LocalTechnique::needs_sites`]).
    const PER_POINT: &'static [(&'static str, f64)] = &[];
    /// Does shading with these parameters need the mesh and each point's place on it?
    fn needs_sites(p: &Self::Params) -> bool {
        let _ = p;
        false
    }
    /// Figures for the certificate: sizes of tables.
    fn details(t: &Self::Tables) -> Vec<(&'static str, f64)> {
        let _ = t;
        Vec::new()
    }
    /// Bytes that shading reads.
    fn bytes(t: &Self::Tables) -> usize;
    /// The f · ⟨n·wi⟩ that the tables approximate, against which the certificate states the error.
    fn stands_for<'a>(t: &'a Self::Tables, brdf: &'a dyn Brdf) -> FCos<'a> {
        let _ = t;
        Box::new(move |wi, wo| brdf.f_cos(wi, wo))
    }
    /// f · ⟨n·wi⟩ of two unit directions in the frame of tangent, bitangent and normal, by the tables; wo is
    /// above the horizon.
    fn f_cos(t: &Self::Tables, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3];
    /// f · ⟨n·wi⟩ as text for a GPU; `None` where the reflectance has none.
    fn text(t: &Self::Tables) -> Option<LocalText>;
    /// Shading under the lights of a frame. `mesh` is given where [`LocalTechnique::needs_sites`]; `shadowed`
    /// says that the caller will ask for shadows.
    fn lit(b: &LocalBaked<Self>, frame: &LocalFrame<'_>) -> Result<Box<dyn LocalShading>, BakeError> {
        Ok(Box::new(PerPoint::<Self>::new(b, frame)))
    }
}

/// A local technique's functions as plain data for a GPU. All names begin with `local_`, so that they do not
/// clash with those of a technique for environments in the same shader.
pub struct LocalText {
    /// WGSL that defines `local_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32>`, or the functions of
    /// [`TexturedTechnique::text`].
    pub module: Cow<'static, str>,
    /// Its tables, called `local_…`.
    pub tables: Vec<Table>,
    /// Its uniforms, called `local_…`.
    pub uniforms: Vec<Uniform>,
    /// Its buffers, called `local_…`. One at most, next to that of the lights, fits the limits of all
    /// devices.
    pub buffers: Vec<Buffer>,
}

impl LocalText {
    /// A reflectance's own text; `None` where it has none.
    pub fn of_model(brdf: &dyn Brdf) -> Option<Self> {
        let call = "
fn f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return brdf_value(wi, wo);
}
";
        let (own, tables) = own_reflectance(&brdf.shader()?, "local", "local_cells", call);
        let (uniforms, buffers) = Default::default();
        Some(Self { module: own.into(), tables, uniforms, buffers })
    }
}

/// The lights and the view of a frame.
#[derive(Clone, Copy)]
pub struct LocalFrame<'a> {
    /// The lights as they were given; directional ones turn with the view's light rotation.
    pub lights: &'a LocalLights,
    /// The view.
    pub view: &'a View,
    /// The mesh, for techniques that need sites.
    pub mesh: Option<&'a Mesh>,
    /// Will the caller ask for shadows?
    pub shadowed: bool,
}

/// A finished bake of a local technique.
pub struct LocalBaked<T: TexturedTechnique> {
    /// Its parameters.
    pub params: T::Params,
    /// Its tables.
    pub tables: Arc<T::Tables>,
    /// The reflectance that it was made of.
    pub material: Material,
    /// The error of f · ⟨n·wi⟩.
    pub certificate: Certificate,
}

/// Shading under the lights of one frame.
pub trait LocalShading: Send + Sync {
    /// Adds the radiance that leaves the points of `q` because of the lights; points that face away get
    /// nothing, and point lights give nothing where the batch has no positions. Without positions shadows are
    /// left out.
    fn add(&self, shadows: Option<Shadows<'_>>, q: &Points<'_>, out: &mut Radiance<'_>);
    /// The shading, unshadowed, as plain data for a GPU; all its names begin with `local_` ([`beside`]).
    /// `None` where the reflectance has no text for GPUs.
    fn gpu(&self) -> Option<GpuTechnique>;
    /// The error reached.
    fn certificate(&self) -> &Certificate;
    /// Does it read data per texel?
    fn is_textured(&self) -> bool {
        false
    }
}

/// A local technique without its types.
pub trait AnyLocal: Send + Sync {
    /// The technique's description of itself.
    fn card(&self) -> &'static Card;
    /// Its parameters.
    fn params(&self) -> &'static [ParamInfo];
    /// Does shading with these parameters need a mesh? Parameters that are refused need none.
    fn needs_sites(&self, params: &ParamValues) -> bool;
    /// Parameters with which a technique that needs a mesh with others does without one.
    fn per_point(&self) -> &'static [(&'static str, f64)];
    /// The texture files that its parameters give; their contents are among the material's textures under the
    /// same names.
    fn planes(&self) -> &'static [Plane];
    /// The basis of the sums in its [`Content::Polynomials`], with these parameters.
    fn basis(&self, params: &ParamValues) -> Basis;
    /// Tabulates a material; refuses those that the Card does not accept. Techniques that need sites read
    /// only the mesh of a geometry and the materials of its slots.
    fn bake(
        &self,
        material: &Material,
        geometry: Option<&Geometry>,
        params: &ParamValues,
        task: &Task,
    ) -> Result<Box<dyn LocalBake>, BakeError>;
    /// The bake that a file holds, of this reflectance.
    fn load(&self, t: &TensorFile, brdf: SharedBrdf) -> Result<Box<dyn LocalBake>, BakeError>;
}

/// A bake of a local technique without its types.
pub trait LocalBake: Send + Sync {
    /// The technique's Card.
    fn card(&self) -> &'static Card;
    /// The parameters it was made with.
    fn params(&self) -> ParamValues;
    /// The error of f · ⟨n·wi⟩.
    fn certificate(&self) -> &Certificate;
    /// All of it as tensors, for [`AnyLocal::load`]; refuses data of a mesh.
    fn save(&self) -> Result<TensorFile, BakeError>;
    /// The reflectance that it was made of.
    fn brdf(&self) -> &SharedBrdf;
    /// Has it data that differ from texel to texel?
    fn is_textured(&self) -> bool;
    /// Bytes that shading reads.
    fn bytes(&self) -> usize;
    /// The normals that it shades with, so that the shading of all other light uses them too; `None` where
    /// they are the surface's own.
    fn normals(&self) -> Option<Arc<NormalMap>>;
    /// f · ⟨n·wi⟩ of two unit directions in the local frame; of techniques with data per texel at (0, 0).
    fn f_cos(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        self.f_cos_at(Place::default(), wi, wo)
    }
    /// f · ⟨n·wi⟩ at a place of the textures, times the part of the light that bumps leave.
    fn f_cos_at(&self, at: Place, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3];
    /// Shading under the lights of a frame; refuses where a mesh is needed and missing.
    fn lit(&self, frame: &LocalFrame<'_>) -> Result<Box<dyn LocalShading>, BakeError>;
}

/// The erased twin of a [`LocalTechnique`].
pub struct ErasedLocal<T>(PhantomData<fn() -> T>);

impl<T: TexturedTechnique> ErasedLocal<T> {
    /// The twin.
    #[expect(clippy::new_without_default, reason = "const, for the list")]
    pub const fn new() -> Self {
        Self(PhantomData)
    }

    const CARD: &'static Card = &T::CARD;
}

impl<T: TexturedTechnique> AnyLocal for ErasedLocal<T> {
    fn card(&self) -> &'static Card {
        Self::CARD
    }

    fn params(&self) -> &'static [ParamInfo] {
        T::Params::INFO
    }

    fn needs_sites(&self, params: &ParamValues) -> bool {
        T::Params::from_values(params).is_ok_and(|p| T::needs_sites(&p))
    }

    fn per_point(&self) -> &'static [(&'static str, f64)] {
        T::PER_POINT
    }

    fn planes(&self) -> &'static [Plane] {
        T::PLANES
    }

    fn basis(&self, params: &ParamValues) -> Basis {
        T::Params::from_values(params).map_or_else(|_| Basis::default(), |p| T::basis(&p))
    }

    fn bake(
        &self,
        material: &Material,
        geometry: Option<&Geometry>,
        params: &ParamValues,
        task: &Task,
    ) -> Result<Box<dyn LocalBake>, BakeError> {
        let params = T::Params::from_values(params)?;
        let slug = T::CARD.slug;
        (T::CARD.materials)(&*material.brdf).map_err(|why| BakeError::Material { slug, why })?;
        let mut tables = T::bake(material, &params, task)?;
        if let Some(g) = geometry.filter(|_| T::needs_sites(&params)) {
            tables = T::transfer(tables, material, g, &params, task)?;
        }
        task.check()?;
        let error = T::error(&tables, material);
        if !error.is_finite() {
            return Err(BakeError::NotFinite { slug });
        }
        let mut certificate = Certificate::new(error, Evidence::Measured).metric(T::METRIC);
        certificate.tolerance = task.tolerance();
        let certificate = T::details(&tables).into_iter().fold(certificate, |c, (name, v)| c.detail(name, v));
        Ok(Box::new(LocalBaked::<T> {
            params,
            tables: Arc::new(tables),
            material: material.clone(),
            certificate,
        }))
    }

    fn load(&self, t: &TensorFile, brdf: SharedBrdf) -> Result<Box<dyn LocalBake>, BakeError> {
        let slug = T::CARD.slug;
        let bad = |e: tensors::PartError| BakeError::Load { slug, why: e.to_string() };
        tensors::check_slug(t, slug).map_err(bad)?;
        let params = T::Params::from_values(&tensors::params(t, T::Params::INFO).map_err(bad)?)?;
        (T::CARD.materials)(&*brdf).map_err(|why| BakeError::Material { slug, why })?;
        let certificate = tensors::certificate(t).map_err(bad)?;
        let material = Material::new(brdf).with_textures(kept::planes(t, PLANE).map_err(bad)?);
        let tables = match T::load(t).map_err(bad)? {
            Some(tables) => tables,
            None => T::bake(&material, &params, &Task::quiet().with_tolerance(certificate.tolerance))?,
        };
        Ok(Box::new(LocalBaked::<T> { params, tables: Arc::new(tables), material, certificate }))
    }
}

impl<T: TexturedTechnique> LocalBake for LocalBaked<T> {
    fn card(&self) -> &'static Card {
        ErasedLocal::<T>::CARD
    }

    fn params(&self) -> ParamValues {
        self.params.to_values()
    }

    fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    fn save(&self) -> Result<TensorFile, BakeError> {
        let slug = T::CARD.slug;
        if T::needs_sites(&self.params) {
            return Err(BakeError::Geometry { slug, why: "has data of a mesh, which are not saved".into() });
        }
        let mut t = TensorFile::default();
        tensors::put_head(&mut t, slug, &self.params.to_values(), &self.certificate);
        if !T::save(&self.tables, &mut t) {
            kept::put(&mut t, PLANE, &self.material.textures);
        }
        Ok(t)
    }

    fn brdf(&self) -> &SharedBrdf {
        &self.material.brdf
    }

    fn is_textured(&self) -> bool {
        !self.material.textures.is_empty() || T::varies(&self.tables)
    }

    fn bytes(&self) -> usize {
        T::bytes(&self.tables)
    }

    fn normals(&self) -> Option<Arc<NormalMap>> {
        T::normals(&self.tables)
    }

    fn f_cos_at(&self, at: Place, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        // False for NaN too.
        if wo[2] > 0.0 { T::f_cos(&self.tables, &T::texel(&self.tables, at, wo), wi, wo) } else { [0.0; 3] }
    }

    fn lit(&self, frame: &LocalFrame<'_>) -> Result<Box<dyn LocalShading>, BakeError> {
        let slug = T::CARD.slug;
        if T::needs_sites(&self.params) && frame.mesh.is_none_or(|m| m.normals.len() != m.positions.len()) {
            let why = "interpolates between the corners of triangles: it needs a mesh with normals".into();
            return Err(BakeError::Geometry { slug, why });
        }
        if let (true, Some(mesh)) = (self.is_textured(), frame.mesh)
            && (mesh.uvs.len() != mesh.positions.len() || mesh.tangents.len() != mesh.positions.len())
        {
            let why = "has data per texel: it needs a mesh with texture coordinates and tangents".into();
            return Err(BakeError::Geometry { slug, why });
        }
        frame.lights.as_lights().check()?;
        T::lit(self, frame)
    }
}

/// The description for a GPU: the loop over the lights, which calls `local_f_cos`.
pub fn technique(card: &Card, text: LocalText, lights: &[Light]) -> GpuTechnique {
    let run = if card.needs.uv { include_str!("textured.wgsl") } else { include_str!("local.wgsl") };
    let mut technique = run_by(card.slug, text, lights, (run, card.needs.uv));
    technique.modules.push(crate::gpu::shadow::OPEN.into());
    technique
}

/// As [`technique`], with another loop over the lights, which may take a site.
pub fn run_by(
    slug: &'static str,
    text: LocalText,
    lights: &[Light],
    (run, site): (&'static str, bool),
) -> GpuTechnique {
    const STRIDE: usize = 8;
    let mut rows: Vec<f32> = lights.iter().flat_map(Light::row).collect();
    // A buffer is never empty.
    rows.resize(rows.len().max(STRIDE), 0.0);
    let mut uniforms = text.uniforms;
    uniforms.push(Uniform { name: "local_count", value: Value::F32(lights.len() as f32) });
    let mut buffers = text.buffers;
    buffers.push(Buffer::new("local_lights", STRIDE, rows));
    GpuTechnique {
        slug,
        modules: vec![text.module, include_str!("light.wgsl").into(), run.into()],
        entry: Entry { name: "local_radiance", lobe: false, site },
        tables: text.tables,
        uniforms,
        buffers,
    }
}

/// Merges two descriptions: `technique` for environment and disks, and `local` ([`LocalShading::gpu`]) for
/// directional and point lights.
pub fn beside(technique: GpuTechnique, local: GpuTechnique) -> GpuTechnique {
    let (one, other) = (technique.entry, local.entry);
    let entry =
        Entry { name: "shade_with_local", lobe: one.lobe || other.lobe, site: one.site || other.site };
    let mut arguments = String::from("n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>");
    arguments += if entry.lobe { ", lobe: Lobe" } else { "" };
    arguments += if entry.site { ", site: Site" } else { "" };
    let [one, other] = [one, other].map(|e| e.call(["n", "t", "wo", "p"], "lobe", "site"));
    let text = format!("\nfn {}({arguments}) -> vec3<f32> {{\n    return {one} + {other};\n}}\n", entry.name);
    let mut out = technique;
    out.modules.extend(local.modules);
    out.modules.push(text.into());
    out.tables.extend(local.tables);
    out.uniforms.extend(local.uniforms);
    out.buffers.extend(local.buffers);
    GpuTechnique { entry, ..out }
}
