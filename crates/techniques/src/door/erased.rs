//! The door without types: what the registry holds.

use crate::gpu::Uniform;
use crate::tensors::{self, TensorFile};
use crate::{
    Bake, BakeError, Card, Geometry, GpuRoom, Material, Part, Parts, Points, Radiance, Technique, Varies,
    View,
};
use std::marker::PhantomData;
use steradian_base::{Certificate, ParamInfo, ParamValues, Params, Task};
use steradian_light::Lights;

/// A technique without its types.
pub trait AnyTechnique: Send + Sync {
    /// What the room says of itself.
    fn card(&self) -> &'static Card;
    /// Its parameters.
    fn params(&self) -> &'static [ParamInfo];
    /// Bakes every factor and links them. Refuses materials that the Card does not take, light that the room
    /// would have to drop, and missing geometry.
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
        let light = T::light(lights, &params, task)?;
        let material = T::material(material, &params, task)?;
        let transfer = transfer::<T>(geometry, &material, &params, task)?;
        let parts = Parts { light: &light, material: &material, transfer: &transfer };
        let (linked, certificate) = T::link(parts, &params, task)?;
        let bake = Bake { params, light, material, transfer, linked, certificate };
        Ok(Baked::<T>::boxed(bake, geometry.cloned()))
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
        Ok(Baked::<T>::boxed(bake, None))
    }
}

struct Baked<T: Technique> {
    bake: Bake<T>,
    frame: T::Frame,
    view: View,
    geometry: Option<Geometry>,
}

impl<T: Technique> Baked<T> {
    fn boxed(bake: Bake<T>, geometry: Option<Geometry>) -> Box<dyn AnyBake> {
        let mut baked = Box::new(Self { bake, frame: T::Frame::default(), view: View::default(), geometry });
        baked.refresh();
        baked
    }

    fn refresh(&mut self) {
        T::frame(&self.bake, &self.view, &mut self.frame);
    }

    /// Links these parts with the present ones; on error the bake stays as it was.
    fn relink(
        &mut self,
        light: Option<T::Light>,
        material: Option<T::Material>,
        transfer: Option<T::Transfer>,
        task: &Task,
    ) -> Result<(), BakeError> {
        let b = &mut self.bake;
        let parts = Parts::<T> {
            light: light.as_ref().unwrap_or(&b.light),
            material: material.as_ref().unwrap_or(&b.material),
            transfer: transfer.as_ref().unwrap_or(&b.transfer),
        };
        (b.linked, b.certificate) = T::link(parts, &b.params, task)?;
        if let Some(l) = light {
            b.light = l;
        }
        if let Some(m) = material {
            b.material = m;
        }
        if let Some(t) = transfer {
            b.transfer = t;
        }
        self.refresh();
        Ok(())
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
        let light = T::light(lights, &self.bake.params, task)?;
        self.relink(Some(light), None, None, task)
    }

    fn set_material(&mut self, material: &Material, task: &Task) -> Result<(), BakeError> {
        check_material::<T>(material)?;
        let material = T::material(material, &self.bake.params, task)?;
        let transfer = if T::TRANSFER_READS_MATERIAL {
            Some(transfer::<T>(self.geometry.as_ref(), &material, &self.bake.params, task)?)
        } else {
            None
        };
        self.relink(None, Some(material), transfer, task)
    }

    fn set_geometry(&mut self, geometry: &Geometry, task: &Task) -> Result<(), BakeError> {
        let transfer = transfer::<T>(Some(geometry), &self.bake.material, &self.bake.params, task)?;
        self.relink(None, None, Some(transfer), task)?;
        self.geometry = Some(geometry.clone());
        Ok(())
    }
}
