//! The CPU renderer: primary visibility by ray casting, radiance by a technique or by the reference, in
//! batches.
//!
//! Tiles run on all cores. In each tile, rays find the surfaces under a regular set of sub-pixel positions;
//! pixels whose samples disagree get more. Points are gathered per surface and shaded as structure of arrays.
//! Samples are weighted by a B-spline over neighbouring pixels. The result does not depend on the number of
//! threads.

mod filter;
mod hits;
mod lobe_shadow;
mod look;
mod path;
mod shader;
mod sparse;
mod tile;

pub use lobe_shadow::{LobeShadow, LobeShadowShader};
pub use path::{PathShader, PathStage};
pub use shader::{BakeShader, DirectShader, ReferenceShader, Shader};

#[cfg(test)]
mod tests;

use crate::{Background, Film, SurfaceMaps, Texture};
use std::sync::Arc;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_scene::{Bvh, Camera, Mesh};
use tile::Tile;

/// Appearance of one material slot of the mesh.
#[derive(Clone)]
pub struct Surface {
    /// Outgoing radiance.
    pub shader: Arc<dyn Shader>,
    /// Multiplies the radiance.
    pub base_colour: Option<Arc<Texture>>,
    /// Normals and roughness that vary over the surface.
    pub maps: SurfaceMaps,
}

impl Surface {
    /// Does the reflected radiance vary no faster than the mesh's own normals?
    fn is_smooth(&self) -> bool {
        self.maps.is_empty() && !self.shader.is_textured()
    }

    /// Does nothing vary within a pixel except the mesh's own normals?
    fn is_even(&self) -> bool {
        self.maps.is_empty() && self.maps.emission.is_none() && !self.shader.is_textured()
    }
}

/// The scene of a picture.
pub struct Stage<'a> {
    /// The geometry; [`Mesh::materials`] are indices into `surfaces`.
    pub mesh: &'a Mesh,
    /// Acceleration structure of the mesh.
    pub bvh: &'a Bvh,
    /// One per material slot; triangles of slots beyond the end take the last.
    pub surfaces: &'a [Surface],
    /// Background where the camera sees no surface.
    pub background: &'a Background,
    /// The camera.
    pub camera: Camera,
}

/// Size and sampling of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Samples per pixel and axis inside surfaces.
    pub inner: usize,
    /// Samples per pixel and axis where the samples of a pixel, or of two neighbours, disagree.
    pub edge: usize,
    /// Samples of one pixel that see the same surface under nearly the same normal share one shaded point,
    /// for radiance that costs more than visibility, as the reference's does.
    pub share: bool,
    /// With `share`: points of plain surfaces between which radiance changes by less than 4e-3 are
    /// interpolated.
    pub interpolate: bool,
    /// Are textures sampled at points instead of averaged over a pixel's footprint? For samples of a picture
    /// whose pixels are coarser than the picture's.
    pub points: bool,
}

impl Settings {
    /// A picture with 2 × 2 samples inside surfaces and 4 × 4 on edges.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, inner: 2, edge: 4, share: false, interpolate: false, points: false }
    }
}

/// Side of a tile in pixels.
const TILE: usize = 64;

/// Renders `stage`.
pub fn render(stage: &Stage<'_>, settings: &Settings, task: &Task) -> Result<Film, Cancelled> {
    let (w, h) = (settings.width, settings.height);
    let columns = w.div_ceil(TILE);
    let count = columns * h.div_ceil(TILE);
    task.begin("render", count as u64);
    let tiles: Result<Vec<Tile>, Cancelled> = (0..count)
        .into_par_iter()
        .with_max_len(1)
        .map(|i| {
            task.check()?;
            let (x, y) = (i % columns * TILE, i / columns * TILE);
            let tile = Tile::render(stage, settings, (x, y), (TILE.min(w - x), TILE.min(h - y)), task)?;
            task.advance(1);
            Ok(tile)
        })
        .collect();
    task.end();
    let mut film = Film::new(w, h);
    for tile in tiles? {
        tile.copy_to(&mut film);
    }
    Ok(film)
}
