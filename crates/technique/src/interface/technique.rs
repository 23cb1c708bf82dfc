//! The trait of a technique: bake each factor, link them, shade batches of points, describe the shader.

use crate::certify::{Model, Report, Target};
use crate::gpu::{LightTables, Uniform};
use crate::local::Plane;
use crate::{BakeError, Card, Geometry, GpuTechnique, Material, Part, Points, Radiance, Varies, View};
use std::sync::Arc;
use steradian_base::{Certificate, Params, Task};
use steradian_brdf::Brdf;
use steradian_light::Lights;

/// A published technique. Each factor of the integral bakes on its own, then [`Technique::link`] joins them:
/// a changed factor rebakes alone.
pub trait Technique: Send + Sync + 'static {
    /// What the technique says of itself.
    const CARD: Card;
    /// The files that parameters of the same names name; [`Material::textures`] has what they hold.
    const PLANES: &'static [Plane] = &[];
    /// Parameters; commands and windows make their controls from them.
    type Params: Params;
    /// The light's factor.
    type Light: Part;
    /// The reflectance's factor.
    type Material: Part;
    /// The geometry's factor.
    type Transfer: Part;
    /// What the factors give together.
    type Linked: Part;
    /// State of one frame: rotated light, a summed reflection map.
    type Frame: Default + Send + Sync;

    /// Parameters with those settled that are left to the technique and follow from the material;
    /// [`Bake::params`] are such. A material that changes later leaves them as they are.
    fn settled(p: Self::Params, m: &Material) -> Self::Params {
        let _ = m;
        p
    }
    /// Bakes the light.
    fn light(l: &Lights, p: &Self::Params, task: &Task) -> Result<Self::Light, BakeError>;
    /// Bakes the reflectance, which [`Card::materials`] takes.
    fn material(m: &Material, p: &Self::Params, task: &Task) -> Result<Self::Material, BakeError>;
    /// Does a bake with these parameters need sites on a mesh?
    fn needs_sites(p: &Self::Params) -> bool {
        let _ = p;
        Self::CARD.needs.sites
    }
    /// Does shading with these parameters stand for what the mesh blocks of its own light? Certificates then
    /// hold it against paths through the mesh, and meshes are divided where shadows vary over them.
    fn self_shadowing(p: &Self::Params) -> bool {
        let _ = p;
        Self::CARD.needs.sites
    }
    /// For techniques with sites: length of edges near an object, over its diagonal, above which a mesh
    /// should be divided, whatever varies over it, because what is shaded is interpolated between vertices.
    const SPACING: f32 = 1.0 / 12.0;
    /// Processor seconds of a bake with default parameters, without its certificate, under a photograph of
    /// 1024 × 512 texels, about, in a build that is optimised: whoever looks for the best technique within a
    /// time goes by it. The reflectance makes it several times as long where it takes long to evaluate.
    const EFFORT: f64 = 0.5;
    /// Bakes the geometry; called with `None` only where [`Technique::needs_sites`] is false.
    fn transfer(
        g: Option<&Geometry>,
        m: &Self::Material,
        p: &Self::Params,
        task: &Task,
    ) -> Result<Self::Transfer, BakeError>;
    /// Joins the factors, and says what is known of the result without measuring it.
    fn link(
        parts: Parts<'_, Self>,
        p: &Self::Params,
        task: &Task,
    ) -> Result<(Self::Linked, Report), BakeError>;
    /// Do the parts of a loaded bake fit each other and its parameters? Each part was held to its own form
    /// before.
    fn is_whole(b: &Bake<Self>) -> bool {
        let _ = b;
        true
    }
    /// What certificates hold shading against: the integral of the reflectance, `None` where that is not
    /// known. Techniques that stand for a variant of it, such as a published map without a cosine, say so
    /// here.
    fn target<'a>(b: &'a Bake<Self>, brdf: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        let _ = b;
        brdf.map(|brdf| Target::Integral(Model::of(brdf)))
    }
    /// Does [`Technique::transfer`] read the material? Then a changed material rebakes the transfer too.
    fn transfer_reads_material(p: &Self::Params) -> bool {
        let _ = p;
        false
    }
    /// Is the transfer of one material that of another? Where it reads the material, techniques may say when
    /// it is all the same.
    fn same_transfer(p: &Self::Params, before: &Self::Material, after: &Self::Material) -> bool {
        let _ = (before, after);
        !Self::transfer_reads_material(p)
    }
    /// For techniques with sites: scattering events at surfaces that shading stands for, 1 for direct light
    /// alone.
    fn events(b: &Bake<Self>) -> u32 {
        let _ = b;
        1
    }
    /// Another model that certificates state the error against, under this name.
    fn also_against(b: &Bake<Self>) -> Option<(&'static str, Target<'_>)> {
        let _ = b;
        None
    }
    /// Prepares a frame. Techniques that look light up by direction keep the rotation.
    fn frame(b: &Bake<Self>, v: &View, f: &mut Self::Frame) {
        let _ = (b, v, f);
    }
    /// Bytes that shading reads.
    fn bytes(b: &Bake<Self>) -> usize {
        b.transfer.bytes() + b.linked.bytes()
    }
    /// Outgoing radiance of a batch; n·wo ≤ 0 gives 0.
    fn shade(b: &Bake<Self>, f: &Self::Frame, q: &Points<'_>, out: &mut Radiance<'_>);
    /// The same as plain data for a GPU.
    fn gpu(b: &Bake<Self>, f: &Self::Frame) -> GpuTechnique;
    /// The uniforms of [`Technique::gpu`] that frames change, to write in place of those of the same names;
    /// `None` where frames change more than uniforms. Techniques with tables say it themselves, so that none
    /// is copied here.
    fn gpu_frame(b: &Bake<Self>, f: &Self::Frame) -> Option<Vec<Uniform>> {
        Some(Self::gpu(b, f).uniforms)
    }
    /// Which data of [`Technique::gpu`], or of [`Technique::gpu_varied`] where `varied`, are filtered light,
    /// where no others depend on the light: a device then makes them of changing light itself.
    fn light_tables(b: &Bake<Self>, varied: bool) -> Option<LightTables> {
        let _ = (b, varied);
        None
    }
    /// What of each point's own lobe ([`Points::lobe`]) shading takes, of whatever material.
    const VARIES: Varies = Varies::NONE;
    /// The same of a bake, at most [`Technique::VARIES`].
    fn varies(b: &Bake<Self>) -> Varies {
        let _ = b;
        Self::VARIES
    }
    /// Does shading read textures of its own, at [`Points::uv`] and [`Points::chart`]? Light is then baked
    /// whole, since what is shaded beside a bake has one reflectance everywhere.
    fn is_textured(b: &Bake<Self>) -> bool {
        let _ = b;
        false
    }
    /// [`Technique::gpu`] with `fn shade_lobe(n, t, wo, p, lobe)` beside `shade` ([`crate::gpu::Entry`]);
    /// `None` where nothing varies.
    fn gpu_varied(b: &Bake<Self>, f: &Self::Frame) -> Option<GpuTechnique> {
        let _ = (b, f);
        None
    }
}

/// The factors that [`Technique::link`] joins.
pub struct Parts<'a, T: Technique + ?Sized> {
    /// The light's factor.
    pub light: &'a T::Light,
    /// The reflectance's factor.
    pub material: &'a T::Material,
    /// The geometry's factor.
    pub transfer: &'a T::Transfer,
}

/// A finished bake; its factors are shared with bakes that other factors were exchanged in.
pub struct Bake<T: Technique + ?Sized> {
    /// The parameters it was made with.
    pub params: T::Params,
    /// The light's factor.
    pub light: Arc<T::Light>,
    /// The reflectance's factor.
    pub material: Arc<T::Material>,
    /// The geometry's factor.
    pub transfer: Arc<T::Transfer>,
    /// What the factors give together.
    pub linked: T::Linked,
    /// The error reached.
    pub certificate: Certificate,
}
