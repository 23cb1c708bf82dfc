//! The error of a technique in a picture: at a sample of its points, against the reference.

use crate::effort::{processor_seconds, within};
use crate::material::picture_reference;
use crate::{Error, Local, Material, Method, PictureError, Prepared, Scene, Session};
use glam::Vec3;
use std::sync::Arc;
use steradian_base::Task;
use steradian_render::{
    Background, Film, ReferenceShader, Settings, Shader, Stage, Surface, SurfaceMaps, render,
};
use steradian_scene::{Bvh, Camera, Mesh};
use steradian_sphere::Frame;
use steradian_techniques::PointsBuf;

/// Processor seconds for the points of a sample that the reference is expected to take at most, in addition
/// to those for its hierarchy of the light; it is stopped after twice as many.
const LOOK: f64 = 1.0;
/// Pixels a side of a picture's samples, of which the object covers a part: the first is rendered, and then
/// the second if the time that the first took allows it.
const SIDES: [usize; 2] = [8, 24];
/// Relative error of the reference at these points: far below the errors that are compared.
const TOLERANCE: f64 = 1e-2;

/// Cosines between normal and view at which vertices count as silhouettes: 80° to 89°.
const SILHOUETTE_COSINES: std::ops::Range<f32> = 0.0175..0.1736;
/// Silhouette points at most, of all vertices that qualify at equal intervals.
const MAX_SILHOUETTES: usize = 48;
/// Where the reference takes long for so many, it computes these; a mesh with fewer has no silhouettes to
/// speak of.
const MIN_SILHOUETTES: usize = 8;

/// Reasons why the error in a picture is not measured, for messages.
const SHADOWED: &str = "its sample knows no shadows";
const TEXTURED: &str = "its sample knows no data per texel that local light alone is shaded with";
const TOO_LONG: &str = "the reference takes too long at its points";
const NOTHING: &str = "no point of its sample shows the surface";

/// A sample of a picture's points, and the reference's radiance there.
pub(crate) struct Sample<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    camera: Camera,
    /// Pixels a side, and the reference's picture; or why there is none.
    truth: Result<(usize, Film), Option<&'static str>>,
    /// Points of silhouettes, and the reference's radiance there.
    silhouettes: Option<(PointsBuf, Vec<[f32; 3]>)>,
    /// Processor seconds that it took.
    pub seconds: f64,
    /// Processor seconds that the reference would take for the whole picture, as its points tell.
    pub whole: f64,
}

impl<'a> Sample<'a> {
    /// The points of `scene` with the reference's radiance of `material`; none where that takes too long.
    pub fn new(
        session: &Session,
        scene: &'a Scene,
        bvh: &'a Bvh,
        camera: Camera,
        material: &Material,
    ) -> Result<Self, Error> {
        let mut sample =
            Self { scene, bvh, camera, truth: Err(None), silhouettes: None, seconds: 0.0, whole: 0.0 };
        if matches!(material.method, Some(Method::File(_) | Method::Reference)) {
            return Ok(sample);
        }
        let task = session.task.clone().without_progress();
        let start = processor_seconds();
        let reference = picture_reference(&scene.lights, &*material.brdf, &task)?;
        let shader = ReferenceShader::new(Arc::new(reference), material.brdf.clone(), TOLERANCE);
        let shader = Arc::new(shader.varied(material.texel_reflectance()));
        let surface = Surface { shader, base_colour: None, maps: SurfaceMaps::default() };
        for side in SIDES {
            let (film, seconds) = within(&task, 2.0 * LOOK, |task| sample.film(&surface, side, task));
            let s = &scene.settings;
            sample.whole = seconds * (s.width.max(s.height) as f64 / side as f64).powi(2);
            match film {
                Ok(film) => sample.truth = Ok((side, film)),
                Err(e) if e.is_cancelled() => session.check()?,
                Err(e) => return Err(e),
            }
            let [first, next] = SIDES;
            if seconds * (next * next) as f64 > LOOK * (first * first) as f64 {
                break;
            }
        }
        if sample.truth.is_ok() && !surface.shader.is_textured() {
            // All of them, or as few as tell.
            for count in [MAX_SILHOUETTES, MIN_SILHOUETTES] {
                let points = silhouettes(&scene.mesh, &camera, count);
                let (values, _) = within(&task, LOOK, |task| shaded(&*surface.shader, &points, task));
                session.check()?;
                sample.silhouettes = values.ok().filter(|v| !v.is_empty()).map(|v| (points, v));
                if sample.silhouettes.is_some() {
                    break;
                }
            }
        }
        sample.seconds = processor_seconds() - start;
        if matches!(sample.truth, Err(None)) {
            sample.truth = Err(Some(TOO_LONG));
        }
        Ok(sample)
    }

    /// Radiance of a surface at the points, without its maps, which the reference does not support. Textures
    /// that its technique reads are sampled at points, since a sample's pixels are wider than the picture's.
    fn film(&self, surface: &Surface, points: usize, task: &Task) -> Result<Film, Error> {
        let plain = Surface { base_colour: None, maps: SurfaceMaps::default(), ..surface.clone() };
        let s = &self.scene.settings;
        let longest = s.width.max(s.height).max(1);
        let side = |n: usize| (n * points).div_ceil(longest).max(1);
        let settings =
            Settings { inner: 1, edge: 1, points: true, ..Settings::new(side(s.width), side(s.height)) };
        let background = Background::Colour([0.0; 3]);
        let stage = Stage {
            mesh: &self.scene.mesh,
            bvh: self.bvh,
            surfaces: &[plain],
            background: &background,
            camera: self.camera,
        };
        Ok(render(&stage, &settings, task)?)
    }

    /// Records the errors of `prepared` at the points, or why it was not measured.
    pub fn judge(&self, prepared: &mut Prepared, task: &Task) -> Result<(), Error> {
        prepared.sample_seconds = self.seconds;
        (prepared.picture_error, prepared.picture_unmeasured) = match self.error(prepared, task)? {
            Ok(error) => (Some(error), None),
            Err(why) => (None, why),
        };
        Ok(())
    }

    fn error(
        &self,
        prepared: &Prepared,
        task: &Task,
    ) -> Result<Result<PictureError, Option<&'static str>>, Error> {
        let (side, truth) = match &self.truth {
            Ok((side, film)) => (*side, film),
            Err(why) => return Ok(Err(*why)),
        };
        // The reference sees no shadows, and one reflectance of each point for all light.
        let m = &prepared.material;
        let reads_other = |l: &Local| match &prepared.method {
            Method::Technique(t) if l.reads_like(*t, &m.params) => false,
            _ => l.is_textured(m.maps.normal.is_some()),
        };
        if m.local.as_ref().is_some_and(reads_other) {
            return Ok(Err(Some(TEXTURED)));
        }
        let far = matches!(&prepared.method, Method::Technique(t) if t.self_shadowing(&m.params));
        if far || m.local.as_ref().is_some_and(Local::knows_mesh) {
            return Ok(Err(Some(SHADOWED)));
        }
        // Shadows by rays are not part of the technique's error, and the reference has none.
        let mut surface = prepared.surface.clone();
        if let Some(open) = surface.shader.unshadowed() {
            surface.shader = open;
        }
        let task = &task.clone().without_progress();
        let film = self.film(&surface, side, task)?;
        let rim = match &self.silhouettes {
            Some((points, truth)) if !surface.shader.is_textured() => {
                Some((shaded(&*surface.shader, points, task)?, truth))
            }
            _ => None,
        };
        let rim = rim.as_ref().map(|(got, truth)| [&**got, &***truth]);
        Ok(PictureError::of(&film, truth, rim).ok_or(Some(NOTHING)))
    }
}

/// So many vertices of a mesh, or fewer, that the camera sees at grazing angles, hidden ones among them; none
/// of a mesh that has hardly any.
fn silhouettes(mesh: &Mesh, camera: &Camera, most: usize) -> PointsBuf {
    let to_eye = |p: Vec3| match *camera {
        Camera::Pinhole { from, .. } => (from - p).normalize_or_zero(),
        Camera::Orthographic { from, at, .. } => (from - at).normalize_or_zero(),
    };
    let grazing = |(p, n): &(&Vec3, &Vec3)| SILHOUETTE_COSINES.contains(&n.dot(to_eye(**p)));
    let all: Vec<(&Vec3, &Vec3)> = mesh.positions.iter().zip(&mesh.normals).filter(grazing).collect();
    let mut points = PointsBuf::default();
    let count = all.len().min(most);
    if count >= MIN_SILHOUETTES {
        for (p, n) in (0..count).map(|k| all[k * all.len() / count]) {
            points.push(*n, Frame::from_normal(n.as_dvec3()).t.as_vec3(), to_eye(*p), *p);
        }
    }
    points
}

/// Radiance at points.
fn shaded(shader: &dyn Shader, points: &PointsBuf, task: &Task) -> Result<Vec<[f32; 3]>, Error> {
    Ok(points.shaded(&|q, out| shader.shade(q, out, task))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_scene::shapes;

    #[test]
    fn silhouettes_are_what_the_camera_grazes() {
        let camera = Camera::Pinhole { from: 9.0 * Vec3::Z, at: Vec3::ZERO, up: Vec3::Y, fov_y: 0.5 };
        let ball = silhouettes(&shapes::icosphere(5), &camera, MAX_SILHOUETTES);
        assert_eq!(ball.len(), MAX_SILHOUETTES);
        for i in 0..ball.len() {
            let cosine: f32 = (0..3).map(|k| ball.n[k][i] * ball.wo[k][i]).sum();
            assert!((80.0..89.1).contains(&cosine.acos().to_degrees()), "{cosine}");
        }
        // Of a box seen from the front: the sides face away.
        let front = shapes::by_name("box").expect("a shape");
        assert!(silhouettes(&front, &camera, MAX_SILHOUETTES).is_empty());
        assert_eq!(silhouettes(&shapes::icosphere(5), &camera, MIN_SILHOUETTES).len(), MIN_SILHOUETTES);
    }
}
