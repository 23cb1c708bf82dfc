//! Techniques behind one type, whatever the types of their factors: the registry's entries.

use super::given::Given;
use crate::certify::Report;
use crate::gpu::{LightTables, Uniform};
use crate::local::Plane;
use crate::tensors::{self, TensorFile};
use crate::{
    Bake, BakeError, Card, Geometry, GpuTechnique, Material, Part, Parts, Points, Radiance, Technique,
    Varies, View,
};
use std::marker::PhantomData;
use std::sync::{Arc, OnceLock};
use steradian_base::{Certificate, Evidence, ParamInfo, ParamValues, Params, Task};
use steradian_brdf::Brdf;
use steradian_light::Lights;

/// A technique without its types.
pub trait AnyTechnique: Send + Sync {
    /// The technique's description of itself.
    fn card(&self) -> &'static Card;
    /// Its parameters.
    fn params(&self) -> &'static [ParamInfo];
    /// Does a bake with these parameters need a [`Geometry`]? Parameters that are refused need none.
    fn needs_sites(&self, params: &ParamValues) -> bool;
    /// Does it take a reflectance with these parameters? Lists that know no parameters go by
    /// [`Card::materials`], as do parameters that are refused.
    fn takes(&self, brdf: &dyn Brdf, params: &ParamValues) -> Result<(), String>;
    /// [`Technique::needs_view`]; that of the Card for parameters that are refused.
    fn needs_view(&self, params: &ParamValues) -> bool;
    /// [`Technique::self_shadowing`]; false of parameters that are refused.
    fn self_shadowing(&self, params: &ParamValues) -> bool;
    /// [`Technique::reads_transfer`]; false of parameters that are refused.
    fn reads_transfer(&self, params: &ParamValues) -> bool;
    /// [`Technique::SPACING`].
    fn spacing(&self) -> f32;
    /// [`Technique::VARIES`].
    fn varies(&self) -> Varies;
    /// Bakes every factor and links them. Refuses materials that it does not take with these parameters
    /// ([`AnyTechnique::takes`]), light that the technique would have to drop or that [`Lights::check`] does,
    /// and missing geometry.
    fn bake(
        &self,
        lights: &Lights,
        material: &Material,
        geometry: Option<&Geometry>,
        params: &ParamValues,
        task: &Task,
    ) -> Result<Box<dyn AnyBake>, BakeError> {
        let bake = self.draft(lights, material, geometry, params, task)?;
        bake.certify(task)?;
        Ok(bake)
    }
    /// [`AnyTechnique::bake`] without a measurement of the error: until [`AnyBake::certify`] the certificate
    /// states an infinite one, as estimated. For callers that bake several techniques and keep one.
    fn draft(
        &self,
        lights: &Lights,
        material: &Material,
        geometry: Option<&Geometry>,
        params: &ParamValues,
        task: &Task,
    ) -> Result<Box<dyn AnyBake>, BakeError>;
    /// The files that its parameters may name ([`Technique::PLANES`]).
    fn planes(&self) -> &'static [Plane];
    /// Processor seconds of a bake with default parameters, about ([`Technique::EFFORT`]).
    fn effort(&self) -> f64;
    /// Slug of a technique that represents the same by more numbers ([`Technique::REFINED_BY`]).
    fn refined_by(&self) -> Option<&'static str>;
    /// A bake that [`AnyBake::save`] wrote.
    fn load(&self, t: &TensorFile) -> Result<Box<dyn AnyBake>, BakeError>;
}

/// A bake without its types.
pub trait AnyBake: Send + Sync {
    /// The technique's Card.
    fn card(&self) -> &'static Card;
    /// The error reached.
    fn certificate(&self) -> &Certificate;
    /// Measures the error of a draft ([`AnyTechnique::draft`]) or a preview ([`AnyBake::preview`]), for
    /// [`AnyBake::certificate`]; does nothing where it is measured already. Views of the draft
    /// ([`AnyBake::with_view`]) that were made before keep their certificate.
    fn certify(&self, task: &Task) -> Result<(), BakeError>;
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
    /// The technique as plain data for a GPU.
    fn gpu(&self) -> GpuTechnique;
    /// The uniforms that [`AnyBake::frame`] changes in [`AnyBake::gpu`] and [`AnyBake::gpu_varied`], for
    /// [`GpuTechnique::set_uniforms`]: no tables are copied. `None` where a frame changes more than uniforms.
    fn gpu_frame(&self) -> Option<Vec<Uniform>>;
    /// The data of [`AnyBake::gpu`], or of [`AnyBake::gpu_varied`] where `varied`, that are filtered light,
    /// so that a device can refilter them; `None` where other data depend on the light too.
    fn light_tables(&self, varied: bool) -> Option<LightTables>;
    /// The properties of each point's own lobe that shading uses; it ignores the other ones.
    fn varies(&self) -> Varies;
    /// Does shading read textures of its own ([`Technique::is_textured`])?
    fn is_textured(&self) -> bool;
    /// The technique as plain data for a GPU with a lobe per point; `None` where nothing varies.
    fn gpu_varied(&self) -> Option<GpuTechnique>;
    /// This bake with a frame of its own, so that several views can be shaded at a time. It shares the data.
    fn with_view(&self, v: &View) -> Box<dyn AnyBake>;
    /// This bake under another light: only the light's factor and the link are baked again, the other factors
    /// are shared. This bake stays valid and may shade meanwhile.
    fn with_light(&self, lights: &Lights, task: &Task) -> Result<Box<dyn AnyBake>, BakeError>;
    /// This bake with another reflectance: only its factor, the transfer where it depends on it, and the link
    /// are baked again.
    fn with_material(&self, material: &Material, task: &Task) -> Result<Box<dyn AnyBake>, BakeError>;
    /// This bake with another geometry: only the transfer and the link are baked again.
    fn with_geometry(&self, geometry: &Geometry, task: &Task) -> Result<Box<dyn AnyBake>, BakeError>;
    /// This bake with another light, another reflectance or both, for display while a full bake is under way:
    /// as [`AnyBake::with_light`] and [`AnyBake::with_material`], but the error is not measured, and until
    /// [`AnyBake::certify`] the certificate is still that of this bake.
    fn preview(
        &self,
        lights: Option<&Lights>,
        material: Option<&Material>,
        task: &Task,
    ) -> Result<Box<dyn AnyBake>, BakeError>;
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

fn check_material<T: Technique>(material: &Material, params: &T::Params) -> Result<(), BakeError> {
    T::takes(&*material.brdf, params).map_err(|why| BakeError::Material { slug: T::CARD.slug, why })
}

fn transfer<T: Technique>(
    geometry: Option<&Geometry>,
    material: &T::Material,
    params: &T::Params,
    task: &Task,
) -> Result<T::Transfer, BakeError> {
    if T::needs_sites(params) && geometry.is_none() {
        let why = "bakes per site of a mesh: give one (`mesh`)".into();
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

    fn needs_sites(&self, params: &ParamValues) -> bool {
        T::Params::from_values(params).is_ok_and(|p| T::needs_sites(&p))
    }

    fn takes(&self, brdf: &dyn Brdf, params: &ParamValues) -> Result<(), String> {
        match T::Params::from_values(params) {
            Ok(p) => T::takes(brdf, &p),
            Err(_) => (T::CARD.materials)(brdf),
        }
    }

    fn needs_view(&self, params: &ParamValues) -> bool {
        T::Params::from_values(params).map_or(T::CARD.needs.view, |p| T::needs_view(&p))
    }

    fn self_shadowing(&self, params: &ParamValues) -> bool {
        T::Params::from_values(params).is_ok_and(|p| T::self_shadowing(&p))
    }

    fn reads_transfer(&self, params: &ParamValues) -> bool {
        T::Params::from_values(params).is_ok_and(|p| T::reads_transfer(&p))
    }

    fn spacing(&self) -> f32 {
        T::SPACING
    }

    fn varies(&self) -> Varies {
        T::VARIES
    }

    fn planes(&self) -> &'static [Plane] {
        T::PLANES
    }

    fn effort(&self) -> f64 {
        T::EFFORT
    }

    fn refined_by(&self) -> Option<&'static str> {
        T::REFINED_BY
    }

    fn draft(
        &self,
        lights: &Lights,
        material: &Material,
        geometry: Option<&Geometry>,
        params: &ParamValues,
        task: &Task,
    ) -> Result<Box<dyn AnyBake>, BakeError> {
        let params = T::settled(T::Params::from_values(params)?, material);
        check_material::<T>(material, &params)?;
        lights.check()?;
        let given = Given {
            lights: Some(lights.clone()),
            brdf: Some(material.brdf.clone()),
            geometry: geometry.cloned(),
        };
        let light = stage("light", task, || T::light(lights, &params, task))?;
        let material = stage("reflectance", task, || T::material(material, &params, task))?;
        let transfer = transfer::<T>(geometry, &material, &params, task)?;
        let factors =
            Factors { light: Arc::new(light), material: Arc::new(material), transfer: Arc::new(transfer) };
        let (bake, report) = stage("link", task, || factors.uncertified(params, task))?;
        let bake = Baked::<T>::new(bake, None, geometry.cloned(), given);
        Ok(Box::new(Baked { report: Some(report), ..bake }))
    }

    fn load(&self, t: &TensorFile) -> Result<Box<dyn AnyBake>, BakeError> {
        let slug = T::CARD.slug;
        let bad = |e: tensors::PartError| BakeError::Load { slug, why: e.to_string() };
        tensors::check_slug(t, slug).map_err(bad)?;
        let bake = Bake {
            params: T::Params::from_values(&tensors::params(t, T::Params::INFO).map_err(bad)?)?,
            light: Arc::new(Part::load(t, "light").map_err(bad)?),
            material: Arc::new(Part::load(t, "material").map_err(bad)?),
            transfer: Arc::new(Part::load(t, "transfer").map_err(bad)?),
            linked: Part::load(t, "linked").map_err(bad)?,
            certificate: tensors::certificate(t).map_err(bad)?,
        };
        if !T::is_whole(&bake) {
            return Err(BakeError::Load { slug, why: "its parts do not fit each other".into() });
        }
        Ok(Baked::<T>::boxed(bake, None, None, Given::default()))
    }
}

/// Does a part of the work as a stage, up to the first stage that it begins itself.
fn stage<R>(label: &str, task: &Task, work: impl FnOnce() -> R) -> R {
    task.begin(label, 1);
    let done = work();
    task.end();
    done
}

/// The factors of a bake.
struct Factors<T: Technique> {
    light: Arc<T::Light>,
    material: Arc<T::Material>,
    transfer: Arc<T::Transfer>,
}

impl<T: Technique> Factors<T> {
    /// The factors of `b`, shared.
    fn of(b: &Bake<T>) -> Self {
        Self { light: b.light.clone(), material: b.material.clone(), transfer: b.transfer.clone() }
    }

    /// Links the factors, without a measurement of the error.
    fn uncertified(self, params: T::Params, task: &Task) -> Result<(Bake<T>, Report), BakeError> {
        let Self { light, material, transfer } = self;
        let parts = Parts::<T> { light: &light, material: &material, transfer: &transfer };
        let (linked, report): (T::Linked, Report) = T::link(parts, &params, task)?;
        let certificate = Certificate::new(f64::INFINITY, Evidence::Estimated);
        Ok((Bake { params, light, material, transfer, linked, certificate }, report))
    }

    /// Links them and certifies the result.
    fn link(self, params: T::Params, given: &Given, task: &Task) -> Result<Bake<T>, BakeError> {
        let (mut bake, report) = self.uncertified(params, task)?;
        bake.certificate = given.certificate(&bake, &report, task)?;
        Ok(bake)
    }
}

struct Baked<T: Technique> {
    bake: Arc<Bake<T>>,
    frame: T::Frame,
    /// The view of the frame, once there was one.
    view: Option<View>,
    geometry: Option<Geometry>,
    given: Given,
    /// The report of a draft, and its certificate once that is measured.
    report: Option<Report>,
    measured: OnceLock<Certificate>,
}

impl<T: Technique> Baked<T> {
    fn new(
        bake: impl Into<Arc<Bake<T>>>,
        view: Option<View>,
        geometry: Option<Geometry>,
        given: Given,
    ) -> Self {
        let bake = bake.into();
        let mut frame = T::Frame::default();
        match &view {
            Some(view) => T::frame(&bake, view, &mut frame),
            None => T::first_frame(&bake, &mut frame),
        }
        Self { bake, frame, view, geometry, given, report: None, measured: OnceLock::new() }
    }

    fn boxed(
        bake: impl Into<Arc<Bake<T>>>,
        view: Option<View>,
        geometry: Option<Geometry>,
        given: Given,
    ) -> Box<dyn AnyBake> {
        Box::new(Self::new(bake, view, geometry, given))
    }

    /// The factors after a change of light or reflectance, those that depend on it baked again, and the
    /// inputs that they were made from.
    fn changed(
        &self,
        lights: Option<&Lights>,
        material: Option<&Material>,
        task: &Task,
    ) -> Result<(Factors<T>, Given), BakeError> {
        let b = &self.bake;
        let (mut factors, mut given) = (Factors::of(b), self.given.clone());
        if let Some(lights) = lights {
            lights.check()?;
            factors.light = Arc::new(T::light(lights, &b.params, task)?);
            given.lights = Some(lights.clone());
        }
        if let Some(material) = material {
            check_material::<T>(material, &b.params)?;
            given.brdf = Some(material.brdf.clone());
            factors.material = Arc::new(T::material(material, &b.params, task)?);
            if !T::same_transfer(&b.params, &b.material, &factors.material) {
                let geometry = self.geometry.as_ref();
                factors.transfer = Arc::new(transfer::<T>(geometry, &factors.material, &b.params, task)?);
            }
        }
        Ok((factors, given))
    }

    /// Links this bake's parameters with other factors, for the same view.
    fn relinked(
        &self,
        factors: Factors<T>,
        geometry: Option<Geometry>,
        given: Given,
        task: &Task,
    ) -> Result<Box<dyn AnyBake>, BakeError> {
        let bake = factors.link(self.bake.params.clone(), &given, task)?;
        Ok(Self::boxed(bake, self.view, geometry, given))
    }
}

impl<T: Technique> AnyBake for Baked<T> {
    fn card(&self) -> &'static Card {
        Erased::<T>::CARD
    }

    fn certificate(&self) -> &Certificate {
        self.measured.get().unwrap_or(&self.bake.certificate)
    }

    fn certify(&self, task: &Task) -> Result<(), BakeError> {
        if let (Some(report), None) = (&self.report, self.measured.get()) {
            let certificate = self.given.certificate(&self.bake, report, task)?;
            self.measured.get_or_init(|| certificate);
        }
        Ok(())
    }

    fn params(&self) -> ParamValues {
        self.bake.params.to_values()
    }

    fn bytes(&self) -> usize {
        T::bytes(&self.bake)
    }

    fn frame(&mut self, v: &View) {
        self.view = Some(*v);
        T::frame(&self.bake, v, &mut self.frame);
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
        tensors::put_head(&mut t, T::CARD.slug, &b.params.to_values(), self.certificate());
        b.light.save(&mut t, "light");
        b.material.save(&mut t, "material");
        b.transfer.save(&mut t, "transfer");
        b.linked.save(&mut t, "linked");
        t
    }

    fn gpu(&self) -> GpuTechnique {
        T::gpu(&self.bake, &self.frame)
    }

    fn gpu_frame(&self) -> Option<Vec<Uniform>> {
        T::gpu_frame(&self.bake, &self.frame)
    }

    fn light_tables(&self, varied: bool) -> Option<LightTables> {
        T::light_tables(&self.bake, varied)
    }

    fn varies(&self) -> Varies {
        T::varies(&self.bake)
    }

    fn is_textured(&self) -> bool {
        T::is_textured(&self.bake)
    }

    fn gpu_varied(&self) -> Option<GpuTechnique> {
        T::gpu_varied(&self.bake, &self.frame)
    }

    fn with_view(&self, v: &View) -> Box<dyn AnyBake> {
        let seen = Self::new(self.bake.clone(), Some(*v), self.geometry.clone(), self.given.clone());
        Box::new(Self { report: self.report.clone(), measured: self.measured.clone(), ..seen })
    }

    fn with_light(&self, lights: &Lights, task: &Task) -> Result<Box<dyn AnyBake>, BakeError> {
        let (factors, given) = self.changed(Some(lights), None, task)?;
        self.relinked(factors, self.geometry.clone(), given, task)
    }

    fn with_material(&self, material: &Material, task: &Task) -> Result<Box<dyn AnyBake>, BakeError> {
        let (factors, given) = self.changed(None, Some(material), task)?;
        self.relinked(factors, self.geometry.clone(), given, task)
    }

    fn preview(
        &self,
        lights: Option<&Lights>,
        material: Option<&Material>,
        task: &Task,
    ) -> Result<Box<dyn AnyBake>, BakeError> {
        let (factors, given) = self.changed(lights, material, task)?;
        let (mut bake, report) = factors.uncertified(self.bake.params.clone(), task)?;
        bake.certificate = self.certificate().clone();
        let bake = Self::new(bake, self.view, self.geometry.clone(), given);
        Ok(Box::new(Self { report: Some(report), ..bake }))
    }

    fn with_geometry(&self, geometry: &Geometry, task: &Task) -> Result<Box<dyn AnyBake>, BakeError> {
        let b = &self.bake;
        let transfer = Arc::new(transfer::<T>(Some(geometry), &b.material, &b.params, task)?);
        let factors = Factors { transfer, ..Factors::of(b) };
        let given = Given { geometry: Some(geometry.clone()), ..self.given.clone() };
        self.relinked(factors, Some(geometry.clone()), given, task)
    }
}
