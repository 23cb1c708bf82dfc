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
    /// The technique's description of itself.
    const CARD: Card;
    /// The texture files that parameters of the same names give; [`Material::textures`] has their contents.
    const PLANES: &'static [Plane] = &[];
    /// Parameters; commands and windows make their controls from them.
    type Params: Params;
    /// The light's factor.
    type Light: Part;
    /// The reflectance's factor.
    type Material: Part;
    /// The geometry's factor.
    type Transfer: Part;
    /// Data made from the factors together.
    type Linked: Part;
    /// State of one frame: rotated light, a summed reflection map.
    type Frame: Default + Send + Sync;

    /// The parameters, in which those that the user leaves to the technique have values that follow from the
    /// material; [`Bake::params`] have them. They stay when the material is exchanged later.
    fn settled(p: Self::Params, m: &Material) -> Self::Params {
        let _ = m;
        p
    }
    /// Bakes the light.
    fn light(l: &Lights, p: &Self::Params, task: &Task) -> Result<Self::Light, BakeError>;
    /// Bakes a reflectance that [`Technique::takes`] has accepted.
    fn material(m: &Material, p: &Self::Params, task: &Task) -> Result<Self::Material, BakeError>;
    /// Accepts a reflectance for bakes with these parameters, or says why it is refused and what to use
    /// instead. Techniques with parameters that widen what [`Card::materials`] takes override this; lists and
    /// comparisons go by the Card.
    fn takes(brdf: &dyn Brdf, p: &Self::Params) -> Result<(), String> {
        let _ = p;
        (Self::CARD.materials)(brdf)
    }
    /// With these parameters, must [`Technique::frame`] run whenever the view changes, and is it too slow to
    /// run for several views in turn?
    fn needs_view(p: &Self::Params) -> bool {
        let _ = p;
        Self::CARD.needs.view
    }
    /// Does a bake with these parameters need sites on a mesh?
    fn needs_sites(p: &Self::Params) -> bool {
        let _ = p;
        Self::CARD.needs.sites
    }
    /// Does shading with these parameters include self-shadowing? Certificates then compare it with paths
    /// through the mesh, and meshes are subdivided where shadows vary over them.
    fn self_shadowing(p: &Self::Params) -> bool {
        let _ = p;
        Self::CARD.needs.sites
    }
    /// Does a bake with these parameters take [`crate::Geometry::transfer`] in place of rays?
    fn reads_transfer(p: &Self::Params) -> bool {
        let _ = p;
        false
    }
    /// For techniques with sites: length of edges near an object, relative to its diagonal, above which a
    /// mesh should be subdivided in any case, because shading is interpolated between vertices.
    const SPACING: f32 = 1.0 / 12.0;
    /// Approximate processor seconds of a bake with default parameters, without its certificate, under a
    /// photograph of 1024 × 512 texels, in an optimised build. The choice of the best technique within a time
    /// budget uses it. A reflectance that is slow to evaluate makes the bake several times as long.
    const EFFORT: f64 = 0.5;
    /// Another technique that represents the same by more numbers and errs less, or about as little. Where
    /// it was tried, the choice of the least error leaves this one out.
    const REFINED_BY: Option<&'static str> = None;
    /// Bakes the geometry; called with `None` only where [`Technique::needs_sites`] is false.
    fn transfer(
        g: Option<&Geometry>,
        m: &Self::Material,
        p: &Self::Params,
        task: &Task,
    ) -> Result<Self::Transfer, BakeError>;
    /// Joins the factors, and reports what is known of the result without a measurement.
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
    /// The exact radiance that certificates compare shading with: the integral of the reflectance, `None`
    /// where that is not available. Techniques that compute a variant of it, such as a published map without
    /// the cosine, override this.
    fn target<'a>(b: &'a Bake<Self>, brdf: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        let _ = b;
        brdf.map(|brdf| Target::Integral(Model::of(brdf)))
    }
    /// Does [`Technique::transfer`] read the material? Then a changed material rebakes the transfer too.
    fn transfer_reads_material(p: &Self::Params) -> bool {
        let _ = p;
        false
    }
    /// Is the transfer baked for one material valid for another? Techniques whose transfer depends on the
    /// material override this where it is.
    fn same_transfer(p: &Self::Params, before: &Self::Material, after: &Self::Material) -> bool {
        let _ = (before, after);
        !Self::transfer_reads_material(p)
    }
    /// For techniques with sites: number of scattering events that shading includes, 1 for direct light
    /// alone.
    fn events(b: &Bake<Self>) -> u32 {
        let _ = b;
        1
    }
    /// A second model, with its name, against which certificates state the error too.
    fn also_against(b: &Bake<Self>) -> Option<(&'static str, Target<'_>)> {
        let _ = b;
        None
    }
    /// Prepares a frame. Techniques that look light up by direction keep the rotation.
    fn frame(b: &Bake<Self>, v: &View, f: &mut Self::Frame) {
        let _ = (b, v, f);
    }
    /// Prepares the frame of a bake that was shown no view yet, by which its certificate is measured. Where
    /// the data of a view take long to make, the technique overrides this, and shades without them.
    fn first_frame(b: &Bake<Self>, f: &mut Self::Frame) {
        Self::frame(b, &View::default(), f);
    }
    /// Bytes that shading reads.
    fn bytes(b: &Bake<Self>) -> usize {
        b.transfer.bytes() + b.linked.bytes()
    }
    /// Outgoing radiance of a batch; n·wo ≤ 0 gives 0.
    fn shade(b: &Bake<Self>, f: &Self::Frame, q: &Points<'_>, out: &mut Radiance<'_>);
    /// The shading of a frame as plain data for a GPU.
    fn gpu(b: &Bake<Self>, f: &Self::Frame) -> GpuTechnique;
    /// The uniforms of [`Technique::gpu`] that frames change, to write in place of those of the same names;
    /// `None` where frames change more than uniforms. Techniques with tables override this, so that no table
    /// is copied.
    fn gpu_frame(b: &Bake<Self>, f: &Self::Frame) -> Option<Vec<Uniform>> {
        Some(Self::gpu(b, f).uniforms)
    }
    /// The data of [`Technique::gpu`], or of [`Technique::gpu_varied`] where `varied`, that are filtered
    /// light, where no other data depend on the light: a device can then refilter changing light itself.
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
    /// Does shading read textures of its own, at [`Points::uv`] and [`Points::chart`]? Then suns are baked
    /// with all other light: shading them exactly would take one reflectance for the whole surface.
    fn is_textured(b: &Bake<Self>) -> bool {
        let _ = b;
        false
    }
    /// [`Technique::gpu`] with `fn shade_lobe(n, t, wo, p, lobe)` in addition to `shade`
    /// ([`crate::gpu::Entry`]); `None` where shading ignores the point's lobe.
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

/// A finished bake. Bakes made from it with one factor exchanged share its other factors.
pub struct Bake<T: Technique + ?Sized> {
    /// The parameters it was made with.
    pub params: T::Params,
    /// The light's factor.
    pub light: Arc<T::Light>,
    /// The reflectance's factor.
    pub material: Arc<T::Material>,
    /// The geometry's factor.
    pub transfer: Arc<T::Transfer>,
    /// Data made from the factors together.
    pub linked: T::Linked,
    /// The error reached.
    pub certificate: Certificate,
}
