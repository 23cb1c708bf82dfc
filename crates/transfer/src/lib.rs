//! From geometry to light transport: visibility of each site of a mesh, and transfer of distant light to it,
//! directly and by interreflection.
//!
//! A *site* is a point with a normal: a vertex, a texel of an atlas, or any given point. With V(w) = 1 where
//! direction w is unoccluded and 0 elsewhere, and y_i the real spherical harmonics over world axes, a site
//! gets
//!
//! - ambient occlusion ao = (1/π) ∫ V (n·w)₊ dw (Kautz 2004, *Hardware Lighting and Shading: a Survey*,
//!   eq. 6);
//! - the diffuse transfer vector t_i = ∫ V (n·w)₊ y_i dw, without albedo and without 1/π (Sloan, Kautz &
//!   Snyder 2002, *Precomputed Radiance Transfer*), and on request with the light that other parts of the
//!   mesh reflect to it;
//! - its visibility v_i = ∫ V y_i dw over n·w > 0 (Green, Kautz & Durand 2007, *Efficient Reflectance and
//!   Visibility Approximations for Environment Map Rendering*, 3.3), of which bent normals and the matrices
//!   of glossy transfer are made ([`Products`]); or what t alone tells of it ([`Recovery`]).
//!
//! Rays start at p + offset·n and both sides of a triangle block. Accuracy is an argument: a site is given
//! rays until two standard errors of each coefficient of t are below the tolerance, and of v below five times
//! that ([`Settings::tolerance`]). All results have the same bits whatever the number of threads.

mod bounce;
mod direct;
mod error;
mod file;
mod grid;
mod links;
mod products;
mod recover;
mod refine;
mod site;
mod store;
mod table;
mod visibility;

pub use direct::{BLOCK, Direct};
pub use error::TransferError;
pub use file::{FileError, Saved, mesh_digest, points_kind, scale_of};
pub use links::{Link, Links};
pub use products::Products;
pub use recover::{Recovery, divided, share};
pub use refine::{Refinement, refine};
pub use site::{Atlas, Site};
pub use store::Store;

use steradian_base::{Input, Task};
use steradian_scene::{Bvh, Mesh};

/// The mesh, which occludes and reflects, with its acceleration structure.
pub struct Scene<'a> {
    /// The geometry.
    pub mesh: &'a Mesh,
    /// Acceleration structure of the mesh.
    pub bvh: Bvh,
}

impl<'a> Scene<'a> {
    /// The scene of a mesh.
    ///
    /// # Errors
    /// If it has no triangles.
    pub fn new(mesh: &'a Mesh) -> Result<Self, TransferError> {
        if mesh.triangles.is_empty() {
            return Err(TransferError::NoTriangles);
        }
        Ok(Self { mesh, bvh: Bvh::build(mesh) })
    }
}

/// Quantities to compute, and their accuracy.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Bands of t and of v: 1 to [`Settings::MAX_BANDS`].
    pub bands: usize,
    /// Absolute error of a coefficient of t, and a fifth of that of v.
    pub tolerance: f64,
    /// Rays of a site in place of a tolerance: the largest power of 4 that is not above.
    pub rays: Option<u32>,
    /// Distance that rays start off the surface, along the normal, in the mesh's units.
    pub offset: f32,
    /// Keep v in 2·bands − 1 bands, from which the matrices of glossy transfer are made.
    pub matrices: bool,
    /// Scattering events at surfaces: 1 is direct light alone, and every further one is a reflection from the
    /// mesh.
    pub bounces: u32,
    /// Albedo of each material slot of the mesh, for interreflection; slots beyond the end have the last one.
    pub albedo: Vec<[f64; 3]>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            bands: 5,
            tolerance: 1e-3,
            rays: None,
            offset: 1e-4,
            matrices: false,
            bounces: 1,
            albedo: vec![[0.5; 3]],
        }
    }
}

impl Settings {
    /// Most bands of t and v.
    pub const MAX_BANDS: usize = 15;
    /// Most bands with matrices.
    pub const MAX_MATRIX_BANDS: usize = 8;
    /// Least tolerance accepted.
    pub const MIN_TOLERANCE: f64 = 1e-5;

    /// Bands of v.
    pub fn wide(&self) -> usize {
        if self.matrices { 2 * self.bands - 1 } else { self.bands }
    }

    /// Bounds of two standard errors of direct light and of interreflected light: 0.8 and 0.6 of the
    /// tolerance, which add up to it in squares, since the errors are independent. (With the full tolerance
    /// for each, some sites missed it by a few percent.)
    fn shares(&self) -> [f64; 2] {
        if self.bounces > 1 { [0.8 * self.tolerance, 0.6 * self.tolerance] } else { [self.tolerance, 0.0] }
    }

    /// The level of a grid of at most `rays` cells.
    fn level(rays: u32) -> u32 {
        (rays.max(1).ilog2() / 2).min(9)
    }

    /// Level of the table of harmonics: finer cells use the values of their ancestor there, since harmonics
    /// vary little over it.
    fn table_level(&self) -> u32 {
        let level = match self.rays {
            Some(rays) => Self::level(rays),
            None if self.tolerance >= 5e-4 => 7,
            None if self.tolerance >= 1e-4 => 8,
            None => 9,
        };
        // A cell of band l is a fraction of its wavelength.
        level.max(if self.bands > 8 { 8 } else { 6 }).min(9)
    }

    /// Vectors of a site: one where every albedo is grey, else three.
    pub fn channels(&self) -> usize {
        let grey = self.bounces <= 1 || self.albedo.iter().all(|a| a[0] == a[1] && a[1] == a[2]);
        if grey { 1 } else { 3 }
    }

    fn check(&self) -> Result<(), TransferError> {
        let bad = |why: String| Err(TransferError::Setting(why));
        let most = if self.matrices { Self::MAX_MATRIX_BANDS } else { Self::MAX_BANDS };
        if !(1..=most).contains(&self.bands) {
            return bad(format!("bands are 1 to {most}, not {}", self.bands));
        }
        if !(Self::MIN_TOLERANCE..=1.0).contains(&self.tolerance) {
            return bad(format!("the tolerance is {} to 1, not {}", Self::MIN_TOLERANCE, self.tolerance));
        }
        if !(self.offset.is_finite() && self.offset >= 0.0) {
            return bad(format!("the offset is a finite length, not {}", self.offset));
        }
        if self.bounces == 0 {
            return bad("bounces are scattering events: 1 is direct light alone".into());
        }
        let albedo = |a: &f64| (0.0..=1.0).contains(a);
        if self.albedo.is_empty() || !self.albedo.iter().flatten().all(albedo) {
            return bad("an albedo is 0 to 1".into());
        }
        Ok(())
    }
}

/// Light transport at sites.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Transfer {
    /// Bands of `t`.
    pub bands: usize,
    /// Bands of `v`.
    pub wide: usize,
    /// Vectors of a site in `t`: 1, or 3 where reflection is coloured.
    pub channels: usize,
    /// Scattering events at surfaces: 1 is direct light alone.
    pub bounces: u32,
    /// Sites, channels, `bands`² coefficients of ∫ V (n·w)₊ y_i dw plus interreflected light.
    pub t: Vec<f32>,
    /// The direct part of `t`, one vector a site; `None` where there is no other part.
    pub direct: Option<Vec<f32>>,
    /// Sites, `wide`² coefficients of ∫ V y_i dw over n·w > 0.
    pub v: Vec<f32>,
    /// (1/π) ∫ V (n·w)₊ dw of each site.
    pub ao: Vec<f32>,
    /// Estimated error of each site's coefficients, of t and of v: two standard errors of a harmonic that is
    /// everywhere as large as one of its band can be, which few coefficients reach.
    pub error: Vec<[f32; 2]>,
    /// Sites from which nothing is visible: all their coefficients are zero.
    pub enclosed: Vec<u32>,
    /// Rays that were cast for visibility.
    pub rays: u64,
}

impl Transfer {
    /// Number of sites.
    pub fn len(&self) -> usize {
        self.ao.len()
    }

    /// Are there no sites?
    pub fn is_empty(&self) -> bool {
        self.ao.is_empty()
    }

    /// The transfer vector of a site and a channel.
    pub fn vector(&self, site: usize, channel: usize) -> &[f32] {
        let n = self.bands * self.bands;
        &self.t[(site * self.channels + channel) * n..][..n]
    }

    /// Visibility of a site.
    pub fn visibility(&self, site: usize) -> &[f32] {
        let n = self.wide * self.wide;
        &self.v[site * n..][..n]
    }

    /// The mean direction in which a site sees out, ∫ V w dw made unit; the zero vector where it sees nothing
    /// or has fewer than two bands.
    pub fn bent_normal(&self, site: usize) -> [f32; 3] {
        // y, z, x are the harmonics of band 1, but for a factor.
        match self.visibility(site) {
            [_, y, z, x, ..] => glam::Vec3::new(*x, *y, *z).normalize_or_zero().to_array(),
            _ => [0.0; 3],
        }
    }

    /// The largest estimated errors of all sites, of t and of v.
    pub fn worst_error(&self) -> [f64; 2] {
        self.error.iter().fold([0.0; 2], |w, e| [0, 1].map(|k| f64::max(w[k], e[k].into())))
    }
}

/// Digest, of 64 characters, of all inputs that the blocks of a computation depend on, for [`Store::open`].
pub fn key(scene: &Scene<'_>, sites: &[Site], settings: &Settings) -> String {
    let mut bytes = mesh_digest(scene.mesh).into_bytes();
    for s in sites {
        s.p.to_array().iter().chain(&s.n.to_array()).for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    let isa = steradian_simd::isa().name();
    let Settings { bands, rays, offset, matrices, .. } = settings;
    let tolerance = settings.shares()[0];
    let rest =
        format!("{bands} {tolerance} {rays:?} {offset} {matrices} {isa} {}", env!("CARGO_PKG_VERSION"));
    bytes.extend(rest.bytes());
    Input::of(std::path::Path::new(""), &bytes).sha256
}

/// Light transport at `sites`. Blocks that `store` has are taken from it, and those that are computed are
/// written to it.
///
/// # Errors
/// Settings out of range, invalid sites, too little memory, a store that cannot be written, or the
/// task was cancelled.
pub fn transfer(
    scene: &Scene<'_>,
    sites: &[Site],
    settings: &Settings,
    store: Option<&Store>,
    task: &Task,
) -> Result<Transfer, TransferError> {
    settings.check()?;
    Site::check(sites)?;
    let row = settings.bands.pow(2) * settings.channels() + settings.wide().pow(2) + 3;
    memory("transfer at every site", 8 * row as u64 * sites.len() as u64, task, "take fewer bands")?;
    let direct = direct::direct(scene, sites, settings, store, task)?;
    let n = settings.bands * settings.bands;
    // t_0 = ∫ V (n·w) y_0 with y_0 = 1/√4π.
    let ao = |t: &[f32]| (f64::from(t[0]) * (4.0 / std::f64::consts::PI).sqrt()) as f32;
    let mut out = Transfer {
        bands: settings.bands,
        wide: settings.wide(),
        channels: 1,
        bounces: settings.bounces,
        ao: direct.t.chunks(n).map(ao).collect(),
        error: direct.error.iter().map(|e| e.map(|e| 2.0 * e)).collect(),
        t: direct.t,
        direct: None,
        v: direct.v,
        enclosed: direct.enclosed,
        rays: direct.rays,
    };
    if settings.bounces > 1 {
        bounce::add(scene, sites, settings, &mut out, task)?;
    }
    Ok(out)
}

fn memory(what: &'static str, bytes: u64, task: &Task, advice: &'static str) -> Result<(), TransferError> {
    if bytes <= task.max_memory() {
        return Ok(());
    }
    Err(TransferError::Memory { what, needed: bytes, allowed: task.max_memory(), advice })
}
