//! The door without types: what the registry holds.

use crate::gpu::Uniform;
use crate::shared::{certify, distant};
use crate::tensors::{self, TensorFile};
use crate::{
    Bake, BakeError, Card, Geometry, GpuRoom, Material, Part, Parts, Points, Radiance, Technique, Varies,
    View,
};
use std::marker::PhantomData;
use steradian_base::{Cancelled, Certificate, Known, ParamInfo, ParamValues, Params, Task};
use steradian_brdf::SharedBrdf;
use steradian_light::Lights;

/// A technique without its types.
pub trait AnyTechnique: Send + Sync {
    /// What the room says of itself.
    fn card(&self) -> &'static Card;
    /// Its parameters.
    fn params(&self) -> &'static [ParamInfo];
    /// Bakes every factor and links them. Refuses materials that the Card does not take, light that the room
    /// would have to drop or that [`Lights::check`] does, and missing geometry.
    fn bake(
        &self,
        lights: &Lights,
        material: &Material,
        geometry: Option<&Geometry>,
        params: &ParamValues,
        task: &Task,
    ) -> Result<Box<dyn AnyBake>, BakeError>;
    /// A bake that [`AnyBake::save`] wrote.
    fn load(&self, t: &TensorFile) -> Result<Box<dyn AnyBake>, BakeError>;
}

/// A bake without its types.
pub trait AnyBake: Send + Sync {
    /// The room's Card.
    fn card(&self) -> &'static Card;
    /// The error reached.
    fn certificate(&self) -> &Certificate;
    /// The parameters it was made with.
    fn params(&self) -> ParamValues;
    /// Bytes that shading reads.
    fn bytes(&self) -> usize;
    /// Prepares a frame.
    fn frame(&mut self, v: &View);
    /// Outgoing radiance of a batch; batches of at least 256 points hide the virtual call. Batches whose
    /// slices do not have one length give 0.
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>);
    /// All parts as tensors.
    fn save(&self) -> TensorFile;
    /// The room as plain data for a GPU.
    fn gpu(&self) -> GpuRoom;
    /// What [`AnyBake::frame`] changes of [`AnyBake::gpu`] and [`AnyBake::gpu_varied`], for
    /// [`GpuRoom::set_uniforms`]: no tables are copied. `None` where a frame changes more than uniforms.
    fn gpu_frame(&self) -> Option<Vec<Uniform>>;
    /// What of each point's own lobe shading takes; the rest it leaves out.
    fn varies(&self) -> Varies;
    /// The room as plain data for a GPU with a lobe per point; `None` where nothing varies.
    fn gpu_varied(&self) -> Option<GpuRoom>;
    /// Another light: only the light's factor and the link are baked again.
    fn set_light(&mut self, lights: &Lights, task: &Task) -> Result<(), BakeError>;
    /// Another reflectance: only its factor, the transfer where it reads it, and the link are baked again.
    fn set_material(&mut self, material: &Material, task: &Task) -> Result<(), BakeError>;
    /// Another geometry: only the transfer and the link are baked again.
    fn set_geometry(&mut self, geometry: &Geometry, task: &Task) -> Result<(), BakeError>;
}

/// The erased twin of a [`Technique`].
pub struct Erased<T>(PhantomData<fn() -> T>);

impl<T: Technique> Erased<T> {
    /// The twin.
    #[expect(clippy::new_without_default, reason = "const, for the registry")]
    pub const fn new() -> Self {
        Self(PhantomData)
    }

    const CARD: &'static Card = &T::CARD;
}

fn check_material<T: Technique>(material: &Material) -> Result<(), BakeError> {
    (T::CARD.materials)(&*material.brdf).map_err(|why| BakeError::Material { slug: T::CARD.slug, why })
}

fn transfer<T: Technique>(
    geometry: Option<&Geometry>,
    material: &T::Material,
    params: &T::Params,
    task: &Task,
) -> Result<T::Transfer, BakeError> {
    if T::CARD.needs.sites && geometry.is_none() {
        let why = "bakes per site of a mesh: give one (--mesh)".into();
        return Err(BakeError::Geometry { slug: T::CARD.slug, why });
    }
    T::transfer(geometry, material, params, task)
}

/// [`Technique::link`]; a certificate that is not finite says that something overflowed.
fn link<T: Technique>(
    parts: Parts<'_, T>,
    params: &T::Params,
    task: &Task,
) -> Result<(T::Linked, Certificate), BakeError> {
    let (linked, certificate) = T::link(parts, params, task)?;
    if certificate.error.is_finite() {
        Ok((linked, certificate))
    } else {
        Err(BakeError::NotFinite { slug: T::CARD.slug })
    }
}

impl<T: Technique> AnyTechnique for Erased<T> {
    fn card(&self) -> &'static Card {
        Self::CARD
    }

    fn params(&self) -> &'static [ParamInfo] {
        T::Params::INFO
    }

    fn bake(
        &self,
        lights: &Lights,
        material: &Material,
        geometry: Option<&Geometry>,
        params: &ParamValues,
        task: &Task,
    ) -> Result<Box<dyn AnyBake>, BakeError> {
        let params = T::Params::from_values(params)?;
        check_material::<T>(material)?;
        lights.check()?;
        let truth = Truth { lights: Some(lights.clone()), brdf: Some(material.brdf.clone()) };
        let light = T::light(lights, &params, task)?;
        let material = T::material(material, &params, task)?;
        let transfer = transfer::<T>(geometry, &material, &params, task)?;
        let parts = Parts { light: &light, material: &material, transfer: &transfer };
        let (linked, certificate) = link::<T>(parts, &params, task)?;
        let mut bake = Bake { params, light, material, transfer, linked, certificate };
        truth.certify(&mut bake, task)?;
        Ok(Baked::<T>::boxed(bake, geometry.cloned(), truth))
    }

    fn load(&self, t: &TensorFile) -> Result<Box<dyn AnyBake>, BakeError> {
        let slug = T::CARD.slug;
        let bad = |e: tensors::PartError| BakeError::Load { slug, why: e.to_string() };
        tensors::check_slug(t, slug).map_err(bad)?;
        let bake = Bake {
            params: T::Params::from_values(&tensors::params(t, T::Params::INFO).map_err(bad)?)?,
            light: Part::load(t, "light").map_err(bad)?,
            material: Part::load(t, "material").map_err(bad)?,
            transfer: Part::load(t, "transfer").map_err(bad)?,
            linked: Part::load(t, "linked").map_err(bad)?,
            certificate: tensors::certificate(t).map_err(bad)?,
        };
        Ok(Baked::<T>::boxed(bake, None, Truth::default()))
    }
}

/// Light and reflectance as they were given, as far as they are known: a loaded bake has its factors alone.
#[derive(Clone, Default)]
struct Truth {
    lights: Option<Lights>,
    brdf: Option<SharedBrdf>,
}

impl Truth {
    /// Where a room computed its error from its own factors, holds that against direct evaluation: what the factors have
    /// lost of the light, such as the outline of a sun, no figure computed from them tells.
    fn certify<T: Technique>(&self, b: &mut Bake<T>, task: &Task) -> Result<(), Cancelled> {
        let (Some(lights), Some(brdf)) = (&self.lights, &self.brdf) else { return Ok(()) };
        if b.certificate.known != Known::Estimated || T::CARD.needs.sites {
            return Ok(());
        }
        let tree = distant::tree(lights, task)?;
        let mut frame = T::Frame::default();
        T::frame(b, &View::default(), &mut frame);
        let seen = certify::measure(&tree, &**brdf, task, |q, out| T::shade(b, &frame, q, out))?;
        b.certificate = seen.held_against(b.certificate.clone());
        Ok(())
    }
}

/// What a relinked bake changes.
struct Change<T: Technique> {
    light: Option<T::Light>,
    material: Option<T::Material>,
    transfer: Option<T::Transfer>,
    truth: Truth,
}

struct Baked<T: Technique> {
    bake: Bake<T>,
    frame: T::Frame,
    view: View,
    geometry: Option<Geometry>,
    truth: Truth,
}

impl<T: Technique> Baked<T> {
    fn boxed(bake: Bake<T>, geometry: Option<Geometry>, truth: Truth) -> Box<dyn AnyBake> {
        let frame = T::Frame::default();
        let mut baked = Box::new(Self { bake, frame, view: View::default(), geometry, truth });
        baked.refresh();
        baked
    }

    fn refresh(&mut self) {
        T::frame(&self.bake, &self.view, &mut self.frame);
    }

    /// Links these parts with the present ones; on error the bake stays as it was.
    fn relink(&mut self, mut change: Change<T>, task: &Task) -> Result<(), BakeError> {
        let b = &mut self.bake;
        let parts = Parts::<T> {
            light: change.light.as_ref().unwrap_or(&b.light),
            material: change.material.as_ref().unwrap_or(&b.material),
            transfer: change.transfer.as_ref().unwrap_or(&b.transfer),
        };
        let (mut linked, mut certificate) = link::<T>(parts, &b.params, task)?;
        let mut exchange = |b: &mut Bake<T>| {
            swap(&mut b.light, &mut change.light);
            swap(&mut b.material, &mut change.material);
            swap(&mut b.transfer, &mut change.transfer);
            std::mem::swap(&mut b.linked, &mut linked);
            std::mem::swap(&mut b.certificate, &mut certificate);
        };
        exchange(b);
        if let Err(e) = change.truth.certify(b, task) {
            exchange(b);
            return Err(e.into());
        }
        self.truth = change.truth;
        self.refresh();
        Ok(())
    }

    /// Nothing but what is known of the truth.
    fn change(&self) -> Change<T> {
        Change { light: None, material: None, transfer: None, truth: self.truth.clone() }
    }
}

/// Exchanges a factor with another, where there is one.
fn swap<F>(a: &mut F, b: &mut Option<F>) {
    if let Some(b) = b {
        std::mem::swap(a, b);
    }
}

impl<T: Technique> AnyBake for Baked<T> {
    fn card(&self) -> &'static Card {
        Erased::<T>::CARD
    }

    fn certificate(&self) -> &Certificate {
        &self.bake.certificate
    }

    fn params(&self) -> ParamValues {
        self.bake.params.to_values()
    }

    fn bytes(&self) -> usize {
        T::bytes(&self.bake)
    }

    fn frame(&mut self, v: &View) {
        self.view = *v;
        self.refresh();
    }

    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>) {
        if q.is_consistent() && out.rgb.iter().all(|p| p.len() == q.len()) {
            T::shade(&self.bake, &self.frame, q, out);
        } else {
            out.rgb.iter_mut().for_each(|p| p.fill(0.0));
        }
    }

    fn save(&self) -> TensorFile {
        let b = &self.bake;
        let mut t = TensorFile::default();
        tensors::put_head(&mut t, T::CARD.slug, &b.params.to_values(), &b.certificate);
        b.light.save(&mut t, "light");
        b.material.save(&mut t, "material");
        b.transfer.save(&mut t, "transfer");
        b.linked.save(&mut t, "linked");
        t
    }

    fn gpu(&self) -> GpuRoom {
        T::gpu(&self.bake, &self.frame)
    }

    fn gpu_frame(&self) -> Option<Vec<Uniform>> {
        T::gpu_frame(&self.bake, &self.frame)
    }

    fn varies(&self) -> Varies {
        T::varies(&self.bake)
    }

    fn gpu_varied(&self) -> Option<GpuRoom> {
        T::gpu_varied(&self.bake, &self.frame)
    }

    fn set_light(&mut self, lights: &Lights, task: &Task) -> Result<(), BakeError> {
        lights.check()?;
        let light = T::light(lights, &self.bake.params, task)?;
        let mut change = Change { light: Some(light), ..self.change() };
        change.truth.lights = Some(lights.clone());
        self.relink(change, task)
    }

    fn set_material(&mut self, material: &Material, task: &Task) -> Result<(), BakeError> {
        check_material::<T>(material)?;
        let brdf = material.brdf.clone();
        let material = T::material(material, &self.bake.params, task)?;
        let transfer = if T::TRANSFER_READS_MATERIAL {
            Some(transfer::<T>(self.geometry.as_ref(), &material, &self.bake.params, task)?)
        } else {
            None
        };
        let mut change = Change { material: Some(material), transfer, ..self.change() };
        change.truth.brdf = Some(brdf);
        self.relink(change, task)
    }

    fn set_geometry(&mut self, geometry: &Geometry, task: &Task) -> Result<(), BakeError> {
        let transfer = transfer::<T>(Some(geometry), &self.bake.material, &self.bake.params, task)?;
        self.relink(Change { transfer: Some(transfer), ..self.change() }, task)?;
        self.geometry = Some(geometry.clone());
        Ok(())
    }
}
