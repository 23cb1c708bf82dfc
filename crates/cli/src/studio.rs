//! From inputs to a picture: bakes, surfaces, cameras.

use crate::context::Context;
use crate::failure::Failure;
use crate::inputs::Method;
use glam::{Mat4, Vec3, Vec4};
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{Certificate, ParamValues};
use steradian_brdf::SharedBrdf;
use steradian_light::Lights;
use steradian_reference::{Judge, Lookup};
use steradian_render::{BakeShader, JudgeShader, Shader, Surface, Texture};
use steradian_scene::{Camera, Mesh};
use steradian_techniques::{Material, View};

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
}

/// A look that is ready to shade.
pub struct Baked {
    /// The surface.
    pub surface: Surface,
    /// The technique's statement of its error; `None` for the reference.
    pub certificate: Option<Certificate>,
    /// Bytes that shading reads; 0 for the reference.
    pub bytes: usize,
    /// Seconds that the bake took.
    pub seconds: f64,
}

/// Bakes a look under `lights`, or makes the judge its shader.
pub fn bake(
    look: &Look,
    lights: &Lights,
    camera: &Camera,
    tolerance: Option<f64>,
    context: &Context,
) -> Result<Baked, Failure> {
    let start = Instant::now();
    let (shader, certificate, bytes): (Arc<dyn Shader>, _, _) = match look.method {
        Method::Reference => {
            let judge = Arc::new(Judge::new(lights, Lookup::Bilinear, &context.task)?);
            let tolerance = tolerance.unwrap_or(PICTURE_TOLERANCE);
            (Arc::new(JudgeShader { judge, brdf: look.brdf.clone(), tolerance }), None, 0)
        }
        Method::Technique(t) => {
            let task = context.task.clone().with_tolerance(tolerance);
            let mut bake = t.bake(lights, &Material::new(look.brdf.clone()), None, &look.params, &task)?;
            bake.frame(&view(camera));
            let (certificate, bytes) = (bake.certificate().clone(), bake.bytes());
            (Arc::new(BakeShader(bake)), Some(certificate), bytes)
        }
    };
    let surface = Surface { shader, base_colour: look.texture.clone() };
    Ok(Baked { surface, certificate, bytes, seconds: start.elapsed().as_secs_f64() })
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

/// The corners of a mesh's bounding box; `None` where it has no triangles.
pub fn bounds(mesh: &Mesh) -> Option<(Vec3, Vec3)> {
    let corners = mesh.triangles.iter().flatten().filter_map(|i| mesh.positions.get(*i as usize));
    corners.fold(None, |b: Option<(Vec3, Vec3)>, p| {
        Some(b.map_or((*p, *p), |(low, high)| (low.min(*p), high.max(*p))))
    })
}

/// Turns and moves a mesh.
pub fn transform(mesh: &mut Mesh, m: Mat4) {
    let normals = m.inverse().transpose();
    let sign = m.determinant().signum();
    mesh.positions.iter_mut().for_each(|p| *p = m.transform_point3(*p));
    for n in &mut mesh.normals {
        *n = normals.transform_vector3(*n).normalize_or(*n);
    }
    for t in &mut mesh.tangents {
        let v = m.transform_vector3(t.truncate());
        *t = Vec4::from((v.normalize_or(t.truncate()), t.w * sign));
    }
    if sign < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

/// Appends `part` to `whole`, all of its triangles in `slot`. Arrays that only some parts have are filled up.
pub fn append(whole: &mut Mesh, part: Mesh, slot: u32) {
    let (before, more) = (whole.positions.len(), part.positions.len());
    fn join<T: Copy + Default>(a: &mut Vec<T>, b: Vec<T>, before: usize, more: usize) {
        if a.is_empty() && b.is_empty() {
            return;
        }
        a.resize(before, T::default());
        a.extend(b);
        a.resize(before + more, T::default());
    }
    join(&mut whole.normals, part.normals, before, more);
    join(&mut whole.tangents, part.tangents, before, more);
    join(&mut whole.uvs, part.uvs, before, more);
    whole.positions.extend(part.positions);
    whole.materials.extend(std::iter::repeat_n(slot, part.triangles.len()));
    whole.triangles.extend(part.triangles.into_iter().map(|t| t.map(|i| i + before as u32)));
}
