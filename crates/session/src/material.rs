//! Materials: as requests give them, and ready to shade.

mod common_shadows;
mod prepare;

use crate::{Choice, Error, Local, Method, PictureError};
pub(crate) use common_shadows::CommonShadows;
#[cfg(feature = "gpu")]
pub(crate) use prepare::view;
use prepare::{Black, surface};
pub(crate) use prepare::{ONE_REFLECTANCE, Under};
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{Certificate, ParamValues, Task};
use steradian_brdf::{Brdf, SharedBrdf};
use steradian_light::Lights;
use steradian_reference::{Lookup, MAX_EVALUATIONS, Reference};
use steradian_render::{BakeShader, ReferenceShader, Surface, SurfaceMaps, Texture};
use steradian_scene::Mesh;
use steradian_scene::surface::{NormalMap, Planes};
#[cfg(any(feature = "gpu", feature = "web"))]
use steradian_techniques::direct::Direct;
#[cfg(any(feature = "gpu", feature = "web"))]
use steradian_techniques::local::LocalShading;
use steradian_techniques::{TexelReflectance, Varies};

/// Relative error per sample at which the reference renders pictures: far below the steps of eight bits.
pub(crate) const PICTURE_TOLERANCE: f64 = 2e-3;
/// Evaluations of interpolated reflectance at each sample of the reference's pictures at most, where no
/// tolerance is given. By its own estimate the reference goes on to [`MAX_EVALUATIONS`]: a picture of
/// `rgl:cc_iris_purple_gem` in a park of 10 x 10 pixels takes 70 processor seconds, and so 2. Of six measured
/// materials, `npf:` chrome and suns among them, no pixel is off by more than 1.4e-4. Formulas do need more:
/// GGX of 0.02 x 0.3 is off by 0.8 % (RMS).
const PICTURE_EVALUATIONS: u64 = 100_000;

/// The reference for pictures of a reflectance, where no tolerance is given.
pub(crate) fn picture_reference(lights: &Lights, brdf: &dyn Brdf, task: &Task) -> Result<Reference, Error> {
    let most = if brdf.is_interpolated() { PICTURE_EVALUATIONS } else { MAX_EVALUATIONS };
    Ok(Reference::new(lights, Lookup::Bilinear, task)?.with_budget(most))
}

/// A material as a request gives it.
#[derive(Clone)]
pub struct Material {
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// Technique or reference; `None` leaves the choice to the session.
    pub method: Option<Method>,
    /// Parameters of the technique.
    pub params: ParamValues,
    /// Contents of the files that these parameters name ([`crate::Session::open_material`]).
    pub planes: Planes,
    /// The technique for directional and point lights; `None` shades them exactly.
    pub local: Option<Local>,
    /// Multiplies the net reflectance.
    pub base_colour: Option<Arc<Texture>>,
    /// Normals and roughness that vary over the surface.
    pub maps: SurfaceMaps,
}

impl Material {
    /// A plain material whose technique is chosen by the session.
    pub fn new(brdf: SharedBrdf) -> Self {
        let (params, planes) = (ParamValues::default(), Planes::default());
        let maps = SurfaceMaps::default();
        Self { brdf, method: None, params, planes, local: None, base_colour: None, maps }
    }

    /// Does it shade with data per texel, of its techniques or of its normals?
    pub fn is_textured(&self) -> bool {
        let normals = self.maps.normal.is_some();
        !self.planes.is_empty() || self.local.as_ref().is_some_and(|l| l.is_textured(normals))
    }

    /// The material as techniques bake it.
    pub(crate) fn baked(&self) -> steradian_techniques::Material {
        steradian_techniques::Material::new(self.brdf.clone())
            .with_textures(self.planes.clone())
            .with_bumps(self.maps.normal.is_some())
    }

    /// The reflectance of each point, where textures that its technique reads make it vary.
    pub(crate) fn texel_reflectance(&self) -> Option<TexelReflectance> {
        TexelReflectance::of(&self.baked())
    }

    /// Refuses a mesh without the texture coordinates that data per texel need; messages call it `name`.
    pub fn check_mesh(&self, mesh: &Mesh, name: &str) -> Result<(), Error> {
        if let (false, Some(method)) = (self.planes.is_empty(), &self.method)
            && mesh.uvs.len() != mesh.positions.len()
        {
            let slug = method.slug();
            return Err(Error::input(format!("{name}: has no texture coordinates, which {slug} needs")));
        }
        match &self.local {
            Some(local) => local.check_mesh(mesh, self.maps.normal.is_some(), name),
            None => Ok(()),
        }
    }

    /// What of its maps a technique leaves out that takes what `varies` says.
    pub(crate) fn left_out_by(&self, varies: Varies) -> Vec<&'static str> {
        let maps = &self.maps;
        varies.left_out(maps.alpha2.is_some(), maps.filters(), maps.colours.is_some())
    }

    /// The same material shaded by `method`.
    pub fn with(&self, method: Method) -> Self {
        Self { method: Some(method), ..self.clone() }
    }

    /// Do both shade alike except for their textures?
    pub(crate) fn shades_like(&self, other: &Prepared) -> bool {
        self.brdf.spec() == other.material.brdf.spec()
            && self.params == other.material.params
            && self.local == other.material.local
            && self.maps.is_empty() == other.material.maps.is_empty()
            && self.maps.normal.is_some() == other.material.maps.normal.is_some()
            && self.method.as_ref().is_none_or(|m| m.slug() == other.method.slug())
    }
}

/// A material that is ready to shade.
#[derive(Clone)]
pub struct Prepared {
    /// The material as requested.
    pub material: Material,
    /// The method that shades it.
    pub method: Method,
    /// The surface, for [`steradian_render::render`].
    pub surface: Surface,
    /// The technique's statement of its error; `None` for the reference.
    pub certificate: Option<Certificate>,
    /// The reference, which says its error once it has shaded.
    pub reference: Option<Arc<ReferenceShader>>,
    /// Properties of the surface's maps that it shades with.
    pub varies: Varies,
    /// Are there lights shaded in addition to the technique's data? Of the maps these use the mean normal
    /// alone.
    pub lit: bool,
    /// Errors at points of the picture, against the reference, where they were measured.
    pub picture_error: Option<PictureError>,
    /// Why the error in the picture was not measured, where it would have been.
    pub picture_unmeasured: Option<&'static str>,
    /// Processor seconds of the reference in this measurement.
    pub sample_seconds: f64,
    /// Record of the choice, where the session chose the technique.
    pub choice: Option<Arc<Choice>>,
    /// Normals of the technique for directional and point lights; all other light is shaded with them too
    /// where the material has none.
    pub(crate) bumps: Option<Arc<NormalMap>>,
    /// The technique's bake; `None` for the reference.
    pub(crate) bake: Option<Arc<BakeShader>>,
    /// The reflectance, and the lights that are shaded with it on top of the technique.
    #[cfg(any(feature = "gpu", feature = "web"))]
    pub(crate) direct: (SharedBrdf, Direct),
    /// Shading of directional and point lights by a separate technique.
    #[cfg(any(feature = "gpu", feature = "web"))]
    pub(crate) local: Option<Arc<dyn LocalShading>>,
    /// Occluders of the lights that are shaded in addition to the technique's data.
    #[cfg(any(feature = "gpu", feature = "web"))]
    pub(crate) blocker: Option<Arc<dyn steradian_scene::shadow::Blocker>>,
    /// Do rays shadow those lights?
    pub(crate) shadowed: bool,
    /// Do rays over the lobe shadow all other light?
    pub(crate) lobe: bool,
    /// Bytes that shading reads; 0 for the reference.
    pub bytes: usize,
    /// Seconds that the bake took.
    pub seconds: f64,
    /// Parts of the shading that the bake's certificate does not cover.
    pub(crate) others: OtherCertificates,
}

/// Parts of a material's shading that the bake's certificate does not cover, and their certificates.
#[derive(Clone, Default)]
pub(crate) struct OtherCertificates {
    /// Are lights shaded exactly?
    exact: bool,
    /// The certificate of a technique for directional and point lights.
    local: Option<Certificate>,
}

impl OtherCertificates {
    /// The certificate of the technique for directional and point lights.
    pub(crate) fn local(&self) -> Option<&Certificate> {
        self.local.as_ref()
    }

    /// The certificate of all shading.
    fn join(&self, mut of_bake: Certificate) -> Certificate {
        if self.exact {
            of_bake = of_bake.beside_exact_lights();
        }
        match &self.local {
            Some(local) => crate::local::joint(of_bake, local),
            None => of_bake,
        }
    }
}

impl Prepared {
    /// Does its technique compute self-shadowing?
    pub fn knows_shadows(&self) -> bool {
        matches!(&self.method, Method::Technique(t) if t.self_shadowing(&self.material.params))
    }

    /// The error: that of the certificate, or the largest remaining error estimate of the reference.
    pub fn error(&self) -> f64 {
        let judged = self.reference.as_ref().map_or(0.0, |j| j.worst());
        self.certificate.as_ref().map_or(judged, |c| c.error)
    }

    /// Data of its GPU technique that are filtered light and may be refiltered on the device; `None` where
    /// other data depend on the light too.
    #[cfg(any(feature = "gpu", feature = "web"))]
    pub(crate) fn light_tables(&self) -> Option<steradian_techniques::gpu::LightTables> {
        self.bake.as_ref()?.0.light_tables(!self.surface.maps.is_empty())
    }

    /// A material of a scene that the path tracer has rendered.
    pub(crate) fn by_paths(material: &Material, certificate: Certificate) -> Self {
        Self {
            material: material.clone(),
            method: Method::Path,
            // Nothing is left to shade.
            surface: surface(material, Arc::new(Black)),
            certificate: Some(certificate),
            reference: None,
            varies: Varies::NONE,
            lit: false,
            picture_error: None,
            picture_unmeasured: None,
            sample_seconds: 0.0,
            choice: None,
            bumps: None,
            bake: None,
            #[cfg(any(feature = "gpu", feature = "web"))]
            direct: (material.brdf.clone(), Direct::default()),
            #[cfg(any(feature = "gpu", feature = "web"))]
            local: None,
            #[cfg(any(feature = "gpu", feature = "web"))]
            blocker: None,
            shadowed: false,
            lobe: false,
            bytes: 0,
            seconds: 0.0,
            others: OtherCertificates::default(),
        }
    }

    /// Measures the error of a draft bake.
    pub(crate) fn certify(&mut self, under: Under<'_>, task: &Task) -> Result<(), Error> {
        let Some(bake) = &self.bake else { return Ok(()) };
        let start = Instant::now();
        bake.0.certify(&task.clone().with_tolerance(under.tolerance))?;
        self.certificate = Some(self.others.join(bake.0.certificate().clone()));
        self.seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// How the error is known, in a word.
    pub fn known(&self) -> &'static str {
        self.certificate.as_ref().map_or("estimated", |c| c.known.word())
    }

    /// The spec of the reflectance.
    pub fn spec(&self) -> String {
        match &self.method {
            Method::File(f) => f.made.brdf.clone(),
            _ => self.material.brdf.spec(),
        }
    }

    /// This bake, shared, under another material's textures.
    pub(crate) fn shared(&self, material: &Material) -> Self {
        let (base_colour, mut maps) = (material.base_colour.clone(), material.maps.clone());
        maps.normal = maps.normal.or_else(|| self.bumps.clone());
        Self {
            material: material.clone(),
            surface: Surface { shader: self.surface.shader.clone(), base_colour, maps },
            bytes: 0,
            seconds: 0.0,
            sample_seconds: 0.0,
            choice: None,
            ..self.clone()
        }
    }

    /// The material's maps that its technique ignores.
    pub fn left_out(&self) -> Vec<&'static str> {
        let mut left_out = self.material.left_out_by(self.varies);
        if self.lit && !self.material.maps.is_empty() {
            left_out.push("its maps, but for the mean normal, under lights that no environment holds");
        }
        left_out
    }
}

/// The single input of a bake that has changed.
#[cfg(feature = "gpu")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Changed {
    /// Textures at most.
    Nothing,
    /// The light.
    Light,
    /// The reflectance.
    Reflectance,
}

#[cfg(feature = "gpu")]
impl Changed {
    /// The factor whose rebake turns `before` into `after`; `None` where more has to be baked.
    pub fn of(before: &Prepared, after: &Material, light: bool, geometry: bool) -> Option<Self> {
        let Method::Technique(t) = before.method else { return None };
        let kept = match &after.method {
            // A saved bake has its technique's slug, but other data.
            Some(Method::Technique(m)) => {
                m.card().slug == t.card().slug && after.params == before.material.params
            }
            Some(_) => return None,
            // The session's choice stands for the reflectance for which it was made.
            None => before.material.method.is_none() && after.brdf.spec() == before.material.brdf.spec(),
        };
        let bare = after.local.is_none() && before.local.is_none() && !before.shadowed;
        let has = |m: &Material| [m.maps.is_empty(), m.maps.normal.is_some()];
        let maps = has(after) == has(&before.material);
        if !kept || !bare || !maps || (geometry && t.needs_sites(&after.params)) {
            return None;
        }
        match (light, after.brdf.spec() != before.material.brdf.spec()) {
            (false, false) => Some(Self::Nothing),
            (true, false) => Some(Self::Light),
            (false, true) => Some(Self::Reflectance),
            (true, true) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use steradian_sphere::Frame;

    /// Of measurements the reference stops early, as close to itself as pictures need; of formulas it does
    /// not.
    #[test]
    fn pictures_of_measurements_end() {
        let Some(path) = steradian_testkit::data("brdfs/rgl/cc_iris_purple_gem_rgb.bsdf") else { return };
        let lights = Lights::of_sky("studio", (256, 128)).expect("a sky");
        let of = |spec: &str| {
            let brdf = steradian_brdf::parse_with(spec, steradian_brdf::Files::Any).expect("valid");
            let frame = Frame::from_normal(DVec3::new(0.3, 0.8, 0.5).normalize());
            let wo = frame.to_world(DVec3::new(0.6, 0.0, 0.8));
            let picture = picture_reference(&lights, &*brdf, &Task::quiet()).expect("light");
            let whole = Reference::new(&lights, Lookup::Bilinear, &Task::quiet()).expect("light");
            [(picture, PICTURE_TOLERANCE), (whole, 1e-4)]
                .map(|(r, tolerance)| r.radiance(&*brdf, &frame, wo, None, tolerance))
        };
        let [picture, whole] = of(&format!("rgl:{}", path.display()));
        assert!(picture.evaluations < 2 * PICTURE_EVALUATIONS, "{picture:?}");
        assert!(whole.evaluations > 10 * PICTURE_EVALUATIONS, "{whole:?}");
        for c in 0..3 {
            assert!((picture.rgb[c] / whole.rgb[c] - 1.0).abs() < 1e-3, "{picture:?} {whole:?}");
        }
        let [picture, _] = of("ggx:ax=0.02,ay=0.3");
        assert!(picture.error <= PICTURE_TOLERANCE, "{picture:?}");
    }
}
