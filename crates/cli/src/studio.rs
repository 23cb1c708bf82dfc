//! From inputs to a picture: bakes, surfaces, cameras.

use crate::context::Context;
use crate::failure::Failure;
use crate::inputs::Method;
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{Certificate, ParamValues};
use steradian_brdf::SharedBrdf;
use steradian_light::Lights;
use steradian_reference::{Judge, Lookup};
use steradian_render::{BakeShader, DirectShader, JudgeShader, Maps, Shader, Surface, Texture};
use steradian_scene::Camera;
use steradian_techniques::direct::{Direct, Suns, split};
use steradian_techniques::{AnyBake, AnyTechnique, BakeError, Material, Varies, View};

/// Relative error per sample at which the reference renders pictures: far below what eight bits show.
pub const PICTURE_TOLERANCE: f64 = 2e-3;

/// A material and how its radiance is computed.
#[derive(Clone)]
pub struct Look {
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// Technique or reference.
    pub method: Method,
    /// Parameters of the technique.
    pub params: ParamValues,
    /// Multiplies the net reflectance.
    pub texture: Option<Arc<Texture>>,
    /// Normals and roughness that vary.
    pub maps: Maps,
}

impl Look {
    /// The spec of its reflectance.
    pub fn spec(&self) -> String {
        match &self.method {
            Method::File(f) => f.made.brdf.clone(),
            _ => self.brdf.spec(),
        }
    }
}

/// A look that is ready to shade.
pub struct Baked {
    /// The surface.
    pub surface: Surface,
    /// The technique's statement of its error; `None` for the reference.
    pub certificate: Option<Certificate>,
    /// The reference, which says its error once it has shaded.
    pub judge: Option<Arc<JudgeShader>>,
    /// The technique's bake; `None` for the reference.
    #[cfg(feature = "gpu")]
    pub bake: Option<Arc<BakeShader>>,
    /// What of the surface's maps it shades with.
    pub varies: Varies,
    /// Are there lights beside the technique's data, which know no maps but the mean normal?
    pub lit: bool,
    /// The reflectance, and the lights that are shaded with it on top of the technique.
    #[cfg(feature = "gpu")]
    pub direct: (SharedBrdf, Direct),
    /// Bytes that shading reads; 0 for the reference.
    pub bytes: usize,
    /// Seconds that the bake took.
    pub seconds: f64,
}

impl Baked {
    /// The error reached: what the technique states, or the largest that the reference was left with.
    pub fn error(&self) -> f64 {
        let judged = self.judge.as_ref().map_or(0.0, |j| j.worst());
        self.certificate.as_ref().map_or(judged, |c| c.error)
    }

    /// How the error is known.
    pub fn known(&self) -> &'static str {
        self.certificate.as_ref().map_or("estimated", |c| c.known.word())
    }
}

/// Bakes a look under `lights`, opens its bake, or makes the judge its shader.
pub fn bake(
    look: &Look,
    lights: &Lights,
    camera: &Camera,
    tolerance: Option<f64>,
    context: &Context,
) -> Result<Baked, Failure> {
    let start = Instant::now();
    let mut view = view(camera);
    let (bake, direct) = match &look.method {
        Method::Reference => return reference(look, lights, tolerance, context),
        Method::Technique(t) => link(*t, look, lights, tolerance, context)?,
        Method::File(file) => {
            view.light_rotation = file.turn;
            (file.open()?, Direct::default())
        }
    };
    Ok(Baked { seconds: start.elapsed().as_secs_f64(), ..room(look, bake, direct, &view) })
}

/// The judge, who needs no bake but hierarchies of the lights.
fn reference(
    look: &Look,
    lights: &Lights,
    tolerance: Option<f64>,
    context: &Context,
) -> Result<Baked, Failure> {
    let start = Instant::now();
    let judge = Arc::new(Judge::new(lights, Lookup::Bilinear, &context.task)?);
    let tolerance = tolerance.unwrap_or(PICTURE_TOLERANCE);
    let shader = Arc::new(JudgeShader::new(judge, look.brdf.clone(), tolerance));
    Ok(Baked {
        surface: surface(look, shader.clone()),
        certificate: None,
        judge: Some(shader),
        #[cfg(feature = "gpu")]
        bake: None,
        varies: Varies::NONE,
        lit: false,
        #[cfg(feature = "gpu")]
        direct: (look.brdf.clone(), Direct::default()),
        bytes: 0,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// A technique's bake, and the lights that are no part of it.
fn link(
    technique: &'static dyn AnyTechnique,
    look: &Look,
    lights: &Lights,
    tolerance: Option<f64>,
    context: &Context,
) -> Result<(Box<dyn AnyBake>, Direct), Failure> {
    let task = context.task.clone().with_tolerance(tolerance);
    // Only what is part of a technique's data is filtered by maps.
    let suns = if look.maps.is_empty() { context.suns } else { Suns::Fold };
    let material = Material::new(look.brdf.clone());
    let with = |suns: Suns| {
        let (baked, direct) = split(lights, suns);
        technique.bake(&baked, &material, None, &look.params, &task).map(|b| (b, direct))
    };
    match with(suns) {
        Err(BakeError::Light { .. }) if suns != context.suns => Ok(with(context.suns)?),
        other => Ok(other?),
    }
}

/// A bake in the light of a camera.
fn room(look: &Look, mut bake: Box<dyn AnyBake>, direct: Direct, view: &View) -> Baked {
    bake.frame(view);
    let (mut certificate, bytes, varies) = (bake.certificate().clone(), bake.bytes(), bake.varies());
    if !direct.is_empty() {
        certificate = certificate.beside_exact_lights();
    }
    let bake = Arc::new(BakeShader(bake));
    let shader: Arc<dyn Shader> = if direct.is_empty() {
        bake.clone()
    } else {
        Arc::new(DirectShader { bake: bake.clone(), direct: direct.clone(), brdf: look.brdf.clone() })
    };
    Baked {
        surface: surface(look, shader),
        certificate: Some(certificate),
        judge: None,
        #[cfg(feature = "gpu")]
        bake: Some(bake),
        varies,
        lit: !direct.is_empty(),
        #[cfg(feature = "gpu")]
        direct: (look.brdf.clone(), direct),
        bytes,
        seconds: 0.0,
    }
}

fn surface(look: &Look, shader: Arc<dyn Shader>) -> Surface {
    Surface { shader, base_colour: look.texture.clone(), maps: look.maps.clone() }
}

fn view(camera: &Camera) -> View {
    let (Camera::Pinhole { from, .. } | Camera::Orthographic { from, .. }) = *camera;
    View { eye: from, forward: camera.axes()[2], ..View::default() }
}

/// Angle of a pixel at the centre of a picture of `height` rows, radians; 0 for parallel rays.
pub fn footprint(camera: &Camera, height: usize) -> f64 {
    match camera {
        Camera::Pinhole { fov_y, .. } => 2.0 * f64::from(0.5 * fov_y).tan() / height.max(1) as f64,
        Camera::Orthographic { .. } => 0.0,
    }
}
