//! The tree of blocks over an image, each with its moments.
//!
//! Blocks are halved along their longer side on the sphere, so that blocks near the poles span many columns.

use super::cells::{Block, ImageCells, Moments};
use super::geometry::{Axis, Nodes, Patch, Rect};
use super::hints::ROUGH;
use super::legendre::{N, affine};
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;

/// Cells of a stored leaf: few in images of up to [`FINE`] leaves, more in larger ones, whose tree would not
/// fit into a cache.
const LEAF: [usize; 2] = [4, 32];

/// Number of leaves up to which they are small.
const FINE: usize = 1 << 13;

/// Most stored leaves, about: larger images get larger leaves.
const LEAVES: usize = 1 << 16;

/// Blocks with more than this part of all light are not sampled as one.
const HEAVY: f64 = 1.0 / 48.0;

/// The share at tolerances of [`ROUGH`] and more.
const HEAVY_ROUGH: f64 = 1.0 / 12.0;

/// One block.
#[derive(Debug, Clone)]
pub(super) struct Node {
    /// Its cells.
    pub block: Block,
    /// Index of the first child; the second follows it. 0 for a leaf.
    pub child: u32,
    /// Its moments.
    pub moments: Moments,
    /// Its rectangle.
    pub patch: Patch,
    /// Where it is sampled.
    pub nodes: Nodes,
}

impl Node {
    fn new(block: Block, cells: &ImageCells<'_>) -> Self {
        let rect = cells.rect(&block);
        let patch = Patch::new(rect);
        Self { block, child: 0, moments: Moments::ZERO, patch, nodes: Nodes::new(&patch) }
    }
}

/// All blocks, level by level from the root.
#[derive(Debug, Clone)]
pub(super) struct Pyramid {
    /// The nodes.
    pub nodes: Vec<Node>,
    /// ∫ |L| dω per channel, about.
    pub power: [f64; 3],
}

impl Pyramid {
    /// Builds the tree over every cell.
    pub fn build(cells: &ImageCells<'_>, task: &Task) -> Result<Self, Cancelled> {
        let root = cells.all();
        let leaf = (root.len() / FINE).clamp(LEAF[0], LEAF[1]).max(root.len() / LEAVES);
        let mut nodes = vec![Node::new(root, cells)];
        let mut levels = vec![0];
        let mut from = 0;
        while from < nodes.len() {
            let to = nodes.len();
            for k in from..to {
                let block = nodes[k].block;
                if block.len() > leaf {
                    nodes[k].child = nodes.len() as u32;
                    let halves = block.halves(nodes[k].patch.long_axis());
                    nodes.extend(halves.map(|block| Node::new(block, cells)));
                }
            }
            levels.push(to);
            from = to;
        }
        for w in levels.windows(2).rev() {
            task.check()?;
            let (upper, lower) = nodes.split_at_mut(w[1]);
            let offset = w[1];
            upper[w[0]..].par_iter_mut().with_min_len(16).for_each(|node| {
                node.moments = match node.child as usize {
                    0 => cells.moments(&node.block),
                    k => merged(cells, &node.block, [&lower[k - offset], &lower[k + 1 - offset]]),
                };
            });
        }
        let mut power = [0.0; 3];
        for node in nodes.iter().filter(|n| n.child == 0) {
            let share = on_sphere(&node.moments, &node.patch.rect);
            for c in 0..3 {
                power[c] += share[c];
            }
        }
        Ok(Self { nodes, power })
    }

    /// Does a block hold so much of all light that its texels should be resolved, whatever f is?
    pub fn is_heavy(&self, moments: &Moments, rect: &Rect, tolerance: f64) -> bool {
        let (share, heavy) = (on_sphere(moments, rect), if tolerance < ROUGH { HEAVY } else { HEAVY_ROUGH });
        (0..3).any(|c| share[c] > heavy * self.power[c])
    }
}

/// Approximate ∫ |L| dω of a block.
fn on_sphere(moments: &Moments, rect: &Rect) -> [f64; 3] {
    let s = rect.centre()[1].sin();
    moments.abs.map(|v| v * s)
}

/// Moments of a block from those of its halves.
fn merged(cells: &ImageCells<'_>, block: &Block, halves: [&Node; 2]) -> Moments {
    let parent = cells.rect(block);
    let mut out = Moments::ZERO;
    for half in halves {
        let rect = half.patch.rect;
        let axis = if half.block.i == block.i { Axis::Theta } else { Axis::Phi };
        add_half(&mut out, &parent, &half.moments, &rect, axis);
        if half.moments.peak[0] > out.peak[0] {
            out.peak = half.moments.peak;
        }
    }
    let [dx, dy] = parent.size();
    for c in 0..3 {
        let mean = out.m[c][0][0] / (dx * dy);
        for half in halves {
            let [hx, hy] = half.patch.rect.size();
            let h = &half.moments;
            out.spread[c] += h.spread[c] + (h.m[c][0][0] - mean * hx * hy).abs();
        }
        out.spread[c] = out.spread[c].min(2.0 * out.abs[c]);
    }
    out
}

fn add_half(out: &mut Moments, parent: &Rect, half: &Moments, rect: &Rect, axis: Axis) {
    let (p, r) = match axis {
        Axis::Phi => (parent.phi, rect.phi),
        Axis::Theta => (parent.theta, rect.theta),
    };
    let scale = 1.0 / (p[1] - p[0]);
    let a = affine((r[0] + r[1] - p[0] - p[1]) * scale, (r[1] - r[0]) * scale);
    for c in 0..3 {
        out.abs[c] += half.abs[c];
        let (to, from) = (&mut out.m[c], &half.m[c]);
        for i in 0..N {
            for j in 0..N {
                to[i][j] += match axis {
                    Axis::Phi => (0..=i).map(|k| a[i][k] * from[k][j]).sum::<f64>(),
                    Axis::Theta => (0..=j).map(|k| a[j][k] * from[i][k]).sum::<f64>(),
                };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cells::Lookup;
    use super::*;
    use steradian_sphere::{Layout, SphereImage};

    fn noise(w: usize, h: usize) -> SphereImage {
        let mut image = SphereImage::new(Layout::LatLong, w, h);
        let mut s = 1u32;
        for plane in &mut image.planes {
            for v in plane {
                s = s.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *v = (s >> 8) as f32 / 1.6e7;
            }
        }
        image
    }

    #[test]
    fn root_moments_are_those_summed_from_the_image() {
        for (w, h) in [(64, 32), (37, 19), (5, 100), (1, 1), (200, 1)] {
            for lookup in [Lookup::Constant, Lookup::Bilinear] {
                let image = noise(w, h);
                let cells = ImageCells::new(&image, lookup);
                let tree = Pyramid::build(&cells, &Task::quiet()).expect("nobody cancels");
                let direct = cells.moments(&cells.all());
                let root = &tree.nodes[0].moments;
                for c in 0..3 {
                    for i in 0..N {
                        for j in 0..N {
                            assert!((root.m[c][i][j] - direct.m[c][i][j]).abs() < 1e-11, "{w}x{h} {i}{j}");
                        }
                    }
                    assert!(root.spread[c] >= direct.spread[c] - 1e-12);
                    assert!((root.abs[c] - direct.abs[c]).abs() < 1e-11);
                }
            }
        }
    }
}
