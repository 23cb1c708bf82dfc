//! The scene of a picture, as plain data.

use glam::{Affine3A, Mat3, Vec3};
use std::sync::Arc;
use steradian_scene::shadow::Volumes;
use steradian_scene::surface::{SurfaceMaps, Texture};
use steradian_scene::{Camera, Mesh};
use steradian_technique::GpuTechnique;
use steradian_technique::direct::{BrdfShader, Direct};

/// Triangles ready for upload.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Triangles {
    /// Three vec4 a vertex: position and u, normal and v, tangent and the sign of the bitangent. Normals and
    /// tangents that are 0 are made by the shader.
    pub vertices: Vec<[f32; 12]>,
    /// Linear RGB of every vertex, which multiplies the radiance; empty where there is none.
    pub colors: Vec<[f32; 3]>,
    /// Three vertices a triangle, counter-clockwise seen from outside.
    pub indices: Vec<[u32; 3]>,
    /// A vertex's site, for techniques with data per site: its number in the mesh.
    pub sites: Vec<u32>,
}

impl Triangles {
    /// The triangles of `mesh` in the material slots that `keep` takes, and the vertices that they use.
    pub fn of(mesh: &Mesh, keep: impl Fn(u32) -> bool) -> Self {
        let mut out = Self::default();
        let mut place = vec![u32::MAX; mesh.positions.len()];
        for corners in (0..).zip(&mesh.triangles).filter(|(i, _)| keep(mesh.material(*i))).map(|(_, c)| c) {
            out.indices.push(corners.map(|v| {
                let v = v as usize;
                if place[v] == u32::MAX {
                    place[v] = out.vertices.len() as u32;
                    out.vertices.push(vertex(mesh, v));
                    out.colors.extend(mesh.colors.get(v).map(|c| c.to_array()));
                    out.sites.push(v as u32);
                }
                place[v]
            }));
        }
        out
    }

    /// Smallest and largest coordinates; `None` without vertices.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut points = self.vertices.iter().map(|v| Vec3::new(v[0], v[1], v[2]));
        let first = points.next()?;
        Some(points.fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p))))
    }
}

fn vertex(mesh: &Mesh, v: usize) -> [f32; 12] {
    let p = mesh.positions[v];
    let n = mesh.normals.get(v).copied().unwrap_or_default();
    let t = mesh.tangents.get(v).copied().unwrap_or_default();
    let uv = mesh.uvs.get(v).copied().unwrap_or_default();
    [p.x, p.y, p.z, uv.x, n.x, n.y, n.z, uv.y, t.x, t.y, t.z, t.w]
}

/// One level of a picture: linear RGB, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Texels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The texels.
    pub texels: Vec<[f32; 3]>,
}

/// A mesh, how it reflects and where it stands.
#[derive(Debug, Clone)]
pub struct Object {
    /// The geometry.
    pub triangles: Arc<Triangles>,
    /// The technique that shades it. With [`Object::maps`], the variant that takes a lobe per point, where
    /// the technique has it ([`steradian_technique::AnyBake::gpu_varied`]): without that, only normals vary.
    pub technique: GpuTechnique,
    /// The reflectance that [`Scene::direct`] is shaded with; without one, those lights pass the object by.
    pub brdf: Option<BrdfShader>,
    /// Do its technique's data hold the scene's disks and directional lights? Of [`Scene::direct`] it then
    /// gets the point lights alone.
    pub folds_suns: bool,
    /// Multiplies the radiance.
    pub base_colour: Option<Arc<Texture>>,
    /// Normals and roughness that vary over the surface.
    pub maps: SurfaceMaps,
    /// Object → world.
    pub transform: Affine3A,
}

impl Object {
    /// Is it shaded by the variant of shaders that reads maps and vertex colours?
    pub(crate) fn is_mapped(&self) -> bool {
        !self.maps.is_empty() || !self.triangles.colors.is_empty()
    }
}

/// A distant disk of constant radiance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disk {
    /// Unit direction towards its centre.
    pub direction: Vec3,
    /// Angular radius, radians.
    pub angular_radius: f32,
    /// Radiance, W sr⁻¹ m⁻².
    pub radiance: [f32; 3],
}

/// Background where the camera sees no object: the sum of all parts.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Backdrop {
    /// One colour.
    pub colour: [f32; 3],
    /// A lat-long image in Steradian's convention, already filtered for the size of a pixel.
    pub image: Option<Level>,
    /// Disks.
    pub disks: Vec<Disk>,
}

/// The scene of a picture.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The objects.
    pub objects: Vec<Object>,
    /// Lights that are shaded with the exact reflectance, on top of the techniques; distant ones turn with
    /// the light.
    pub direct: Direct,
    /// Shadow volumes in world space, for objects whose techniques use them for the same lights
    /// ([`steradian_technique::gpu::shadow::behind`]).
    pub volumes: Option<Arc<Volumes>>,
    /// Background of the objects.
    pub backdrop: Backdrop,
    /// The camera.
    pub camera: Camera,
    /// Rotation of the backdrop: light from d comes from `light_rotation · d`, as in
    /// [`steradian_technique::View`].
    pub light_rotation: Mat3,
}

/// Method of shading objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Path {
    /// In the raster pass, once a pixel and triangle, coverage at four samples (multisampling).
    #[default]
    Raster,
    /// The raster pass writes triangles only (a visibility buffer of 2 × 2 samples a pixel); a compute pass
    /// shades each triangle of a pixel once: for accelerators that have almost no graphics units.
    Compute,
}

/// Rate of shading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rate {
    /// Once a pixel and triangle; edges have four samples.
    #[default]
    Pixel,
    /// At every sample: radiance that changes within a pixel is averaged too, as the CPU renderer does.
    Sample,
}

/// Filter from samples to pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Filter {
    /// The CPU renderer's: a quadratic B-spline of radius 1.25 pixels.
    #[default]
    Spline,
    /// The mean of a pixel's own samples: a ninth of the reads.
    Mean,
}

/// Precision of the linear picture that samples are kept in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Depth {
    /// 32 bits a channel, or 16 where the adapter cannot multisample 32.
    #[default]
    Best,
    /// 16-bit float: half the memory; radiance beyond 65504 is clipped and counted.
    Half,
}

/// Size and sampling of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Texels of the target per pixel and axis, 1 … 4; each has four samples.
    pub scale: usize,
    /// Method of shading objects.
    pub path: Path,
    /// Rate of shading.
    pub rate: Rate,
    /// Filter from samples to pixels.
    pub filter: Filter,
    /// Precision.
    pub depth: Depth,
}

impl Settings {
    /// A picture rendered by the raster path, shaded once a pixel and triangle.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            scale: 1,
            path: Path::default(),
            rate: Rate::default(),
            filter: Filter::default(),
            depth: Depth::default(),
        }
    }

    /// Settings for a window: surfaces shaded once a pixel, 16-bit samples, box filter.
    pub fn interactive(width: usize, height: usize, path: Path) -> Self {
        Self { path, filter: Filter::Mean, depth: Depth::Half, ..Self::new(width, height) }
    }

    /// Texels of the sampled target per pixel and axis.
    pub(crate) fn grid(&self) -> usize {
        match self.path {
            Path::Raster => self.scale,
            Path::Compute => 2 * self.scale,
        }
    }
}

/// A finished picture: linear radiance and coverage, rows from the top.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green, blue.
    pub rgb: [Vec<f32>; 3],
    /// Coverage by objects, 0 … 1.
    pub alpha: Vec<f32>,
    /// Samples that the target's format clipped.
    pub clipped: u32,
}

/// Milliseconds of the passes of one frame, as the device's own clock has them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Timings {
    /// Name and milliseconds of each pass, in order; empty where the adapter has no clock.
    pub passes: Vec<(&'static str, f64)>,
}

impl Timings {
    /// Milliseconds of all passes.
    pub fn total(&self) -> f64 {
        self.passes.iter().map(|p| p.1).sum()
    }
}
