//! Ray casting: a hierarchy of eight-wide nodes and leaves of eight triangles, one ray at a time, the eight
//! boxes or triangles tested together. Both sides of a triangle block, and no ray passes between neighbours.

mod build;
mod node;
mod packet;
mod traverse;
mod triangle;

use crate::{Mesh, Ray};
use node::{LEAF, Node};
use steradian_parallel::prelude::*;
use steradian_simd::run;
use traverse::{Closest, Every, Occluded};
use triangle::Block;

/// Children of a node, triangles of a block.
const LANES: usize = 8;

/// Where a ray meets a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the (unit) direction.
    pub t: f32,
    /// Index of the triangle in [`Mesh::triangles`].
    pub triangle: u32,
    /// Weight of the triangle's second vertex.
    pub u: f32,
    /// Weight of the triangle's third vertex; the first has 1 − u − v.
    pub v: f32,
}

/// A bounding volume hierarchy over the triangles of a mesh. Both sides of a triangle block.
#[derive(Debug, Clone)]
pub struct Bvh {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// Entries that a traversal's stack may need.
    stack: usize,
}

/// Rays in a task of a batch.
const BATCH: usize = 1024;

impl Bvh {
    /// The hierarchy of `mesh`. Triangles with an index out of range or a corner that is not finite are left
    /// out.
    pub fn build(mesh: &Mesh) -> Self {
        build::build(mesh)
    }

    /// The nearest hit at a distance in (0, `t_max`); where several are equally near, that of the lowest
    /// index.
    pub fn closest(&self, ray: &Ray, t_max: f32) -> Option<Hit> {
        let mut hit = [None];
        run(Closest { bvh: self, rays: std::slice::from_ref(ray), t_max, out: &mut hit });
        hit[0]
    }

    /// Is there any hit at a distance in (0, `t_max`)?
    pub fn occluded(&self, ray: &Ray, t_max: f32) -> bool {
        let mut hit = [false];
        run(Occluded { bvh: self, rays: std::slice::from_ref(ray), t_max, out: &mut hit });
        hit[0]
    }

    /// [`Bvh::closest`] for many rays, on all cores.
    pub fn closest_many(&self, rays: &[Ray], t_max: f32) -> Vec<Option<Hit>> {
        let mut out = vec![None; rays.len()];
        out.par_chunks_mut(BATCH)
            .zip(rays.par_chunks(BATCH))
            .for_each(|(out, rays)| run(Closest { bvh: self, rays, t_max, out }));
        out
    }

    /// [`Bvh::occluded`] for many rays, on all cores.
    pub fn occluded_many(&self, rays: &[Ray], t_max: f32) -> Vec<bool> {
        let mut out = vec![false; rays.len()];
        out.par_chunks_mut(BATCH)
            .zip(rays.par_chunks(BATCH))
            .for_each(|(out, rays)| run(Occluded { bvh: self, rays, t_max, out }));
        out
    }

    /// [`Bvh::occluded`] for each ray, on this thread; `out` is as long as `rays`.
    pub fn occluded_each(&self, rays: &[Ray], t_max: f32, out: &mut [bool]) {
        run(Occluded { bvh: self, rays, t_max, out });
    }

    /// [`Bvh::closest`] for each ray, on this thread; `out` is as long as `rays`.
    pub fn closest_each(&self, rays: &[Ray], t_max: f32, out: &mut [Option<Hit>]) {
        run(Closest { bvh: self, rays, t_max, out });
    }

    /// Appends to `out` the triangles of all hits at a distance in (0, `t_max`), in no particular order.
    pub fn every(&self, ray: &Ray, t_max: f32, out: &mut Vec<u32>) {
        run(Every { bvh: self, ray, t_max, out });
    }

    /// The hierarchy as [`crate::shadow::Flat::Rays`] has it: boxes and triangles.
    pub(crate) fn rows(&self) -> (Vec<[f32; 8]>, Vec<[f32; 9]>) {
        let (mut boxes, mut triangles) = (Vec::new(), Vec::new());
        self.rows_below(0, &mut boxes, &mut triangles);
        (boxes, triangles)
    }

    /// Rows of boxes or of triangles at most.
    pub(crate) fn most_rows(&self) -> usize {
        LANES * self.nodes.len().max(self.blocks.len())
    }

    fn rows_below(&self, node: usize, boxes: &mut Vec<[f32; 8]>, triangles: &mut Vec<[f32; 9]>) {
        let node = &self.nodes[node];
        for k in 0..LANES {
            let [lx, hx, ly, hy, lz, hz] = node.planes.map(|p| p[k]);
            if lx > hx {
                continue;
            }
            let (at, child, first) = (boxes.len(), node.children[k], triangles.len());
            boxes.push([lx, ly, lz, 0.0, hx, hy, hz, first as f32]);
            if child & LEAF == 0 {
                self.rows_below(child as usize, boxes, triangles);
                boxes[at][3] = boxes.len() as f32;
                continue;
            }
            let block = &self.blocks[(child ^ LEAF) as usize];
            for i in (0..LANES).filter(|i| block.ids[*i] != u32::MAX) {
                let corner = |n: usize| block.corners[n / 3][n % 3][i];
                triangles.push(std::array::from_fn(corner));
            }
            boxes[at][3] = first as f32 - triangles.len() as f32;
        }
    }

    /// Bytes of the hierarchy.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>() + self.blocks.len() * size_of::<Block>()
    }
}

#[cfg(test)]
mod tests;
