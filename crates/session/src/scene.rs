//! Everything that a picture is made of.

use crate::inputs::DEFAULT_SKY;
use crate::{Adjust, Error, Material, Model, Session};
use glam::Vec3;
use steradian_light::Lights;
use steradian_render::scenefile::SceneBackground;
use steradian_render::{Settings, ToneMapper};
use steradian_scene::{Camera, Mesh};

/// A mesh with its materials, lights, camera, and how its picture is made.
#[derive(Clone)]
pub struct Scene {
    /// The geometry; [`Mesh::materials`] are indices into `materials`.
    pub mesh: Mesh,
    /// One per slot.
    pub materials: Vec<Material>,
    /// The lights.
    pub lights: Lights,
    /// The camera; `None` sees the whole mesh.
    pub camera: Option<Camera>,
    /// Size and sampling of the picture.
    pub settings: Settings,
    /// Exposure value before tone mapping; `None` is automatic.
    pub exposure: Option<f32>,
    /// How radiance becomes a display's colours.
    pub tone_mapper: ToneMapper,
    /// What is seen beside the mesh.
    pub background: SceneBackground,
    /// Relative RMS error of radiance that is asked for.
    pub tolerance: Option<f64>,
}

/// Vertical field of view of cameras that are not given, degrees.
const FOV: f32 = 32.0;

impl Scene {
    /// `mesh` under `lights`, 512 × 512 pixels, seen whole before its environment.
    pub fn new(mesh: Mesh, materials: Vec<Material>, lights: Lights) -> Self {
        Self {
            mesh,
            materials,
            lights,
            camera: None,
            settings: Settings::new(512, 512),
            exposure: None,
            tone_mapper: ToneMapper::default(),
            background: SceneBackground::Environment(0.0),
            tolerance: None,
        }
    }

    /// A mesh file or built-in shape, with `brdf` or else the file's own materials (or a grey one), under an image or a
    /// sky; an empty name is the usual sky.
    pub fn of(mesh: &str, brdf: Option<&str>, light: &str, session: &mut Session) -> Result<Self, Error> {
        let Model { mesh, materials } = session.model(mesh)?;
        let given = brdf.map(|spec| session.brdf(spec)).transpose()?;
        let mut all = Vec::new();
        for m in &materials {
            let brdf = given.clone().map_or_else(|| m.brdf(), Ok)?;
            let maps = m.maps(given.is_none());
            all.push(Material { base_colour: m.tint(given.is_none()), maps, ..Material::new(brdf) });
        }
        if all.is_empty() {
            let brdf = given.map_or_else(|| session.brdf("lambert:albedo=0.6"), Ok)?;
            all.push(Material::new(brdf));
        }
        let light = if light.is_empty() { DEFAULT_SKY } else { light };
        Ok(Self::new(mesh, all, session.light(light, &Adjust::default())?))
    }

    /// The camera, or one that sees the whole mesh with a vertical field of view of `fov` degrees.
    pub fn camera_or_framed(&self, fov: Option<f32>) -> Result<Camera, Error> {
        if let Some(camera) = self.camera {
            return Ok(camera);
        }
        let bounds = self.mesh.bounds().ok_or_else(|| Error::input("the mesh has no triangles"))?;
        let aspect = self.settings.width as f32 / self.settings.height as f32;
        Ok(framed(&self.mesh.positions, bounds, fov.unwrap_or(FOV).to_radians(), aspect))
    }
}

/// The part of the frame's width or height that an object fills.
const FILLED: f32 = 0.7;
/// Where cameras stand that are not given, as seen from the object: in front, to the right, little above eye level.
const FROM: Vec3 = Vec3::new(0.55, 0.18, 1.0);
/// Points of a mesh that are looked at, at most.
const MOST_POINTS: usize = 1 << 16;

/// A pinhole that sees the points from [`FROM`] so near that they fill [`FILLED`] of the frame.
fn framed(points: &[Vec3], (low, high): (Vec3, Vec3), fov_y: f32, aspect: f32) -> Camera {
    let radius = (0.5 * (high - low).length()).max(1e-6);
    let axis = FROM.normalize();
    let camera =
        |at: Vec3, distance: f32| Camera::Pinhole { from: at + axis * distance, at, up: Vec3::Y, fov_y };
    let tan = (0.5 * fov_y).tan();
    // Extent on the film, in half frames: right, left, up, down of its centre.
    let extent = |at: Vec3, distance: f32| {
        let [right, up, forward] = camera(at, distance).axes();
        let from = at + axis * distance;
        let step = points.len().div_ceil(MOST_POINTS);
        points.iter().step_by(step).fold([f32::MIN; 4], |e, p| {
            let v = *p - from;
            let depth = v.dot(forward).max(1e-3 * radius) * tan;
            let (x, y) = (v.dot(right) / (depth * aspect), v.dot(up) / depth);
            [e[0].max(x), e[1].max(-x), e[2].max(y), e[3].max(-y)]
        })
    };
    let (mut at, mut distance) = (0.5 * (low + high), 2.0 * radius / (tan * aspect.min(1.0)));
    for _ in 0..6 {
        // What is seen is moved to the middle, then the distance is set by what it fills.
        let [right, up, _] = camera(at, distance).axes();
        let [e, w, n, s] = extent(at, distance);
        at += (0.5 * (e - w) * aspect * right + 0.5 * (n - s) * up) * (distance * tan);
        let fills = (0.5 * (e + w)).max(0.5 * (n + s)).max(1e-6);
        distance = (distance * fills / FILLED).max(1.05 * radius);
    }
    camera(at, distance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_scene::shapes;

    #[test]
    fn objects_fill_the_frame_and_stand_in_its_middle() {
        for name in ["sphere", "teapot", "torus", "knot", "plane"] {
            let mesh = shapes::by_name(name).expect("a shape");
            let bounds = mesh.bounds().expect("triangles");
            for aspect in [0.5, 1.0, 2.0] {
                let c = framed(&mesh.positions, bounds, 0.56, aspect);
                let [r, u, f] = c.axes();
                let Camera::Pinhole { from, fov_y, .. } = c else { panic!("a pinhole") };
                let mut e = [0.0f32; 2];
                for p in &mesh.positions {
                    let v = *p - from;
                    let t = (0.5 * fov_y).tan() * v.dot(f);
                    assert!(t > 0.0);
                    e = [e[0].max((v.dot(r) / (t * aspect)).abs()), e[1].max((v.dot(u) / t).abs())];
                }
                let most = e[0].max(e[1]);
                assert!((0.6..0.8).contains(&most), "{name} {aspect}: {most}");
            }
        }
    }
}
