//! Building: obvhs makes a binary tree (PLOC, Meister and Bittner 2017, with parallel reinsertion, 2018); it
//! is opened here to nodes of eight children and leaves of up to eight triangles.

use super::node::{LEAF, Node};
use super::triangle::Block;
use super::{Bvh, LANES};
use crate::Mesh;
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Share of the nodes that each pass of reinsertion moves.
const REINSERTION: f32 = 0.05;
/// Cost of a node, in triangles, in the heuristic that decides how full leaves are: a block of eight
/// triangles costs as much as one.
const TRAVERSAL_COST: f32 = 8.0;

/// The tree of a mesh. Triangles with a bad index or a corner that is not finite are left out, and so are all
/// but the first of those with the same corners: no box separates them, so that every ray would visit each.
pub fn build(mesh: &Mesh) -> Bvh {
    let corner = |i: u32| mesh.positions.get(i as usize).copied().unwrap_or(Vec3::NAN);
    let (mut ids, mut corners) = (Vec::new(), Vec::new());
    for (i, t) in mesh.triangles.iter().enumerate() {
        let t = t.map(corner);
        if t.iter().all(|p| p.is_finite()) {
            ids.push(i as u32);
            corners.push(t);
        }
    }
    drop_repeated(&mut ids, &mut corners);
    if ids.is_empty() {
        return Bvh { nodes: vec![Node::EMPTY], blocks: vec![Block::EMPTY], stack: LANES };
    }
    let tree = binary(&corners);
    let mut maker =
        Maker { tree: &tree, corners: &corners, ids: &ids, nodes: Vec::new(), blocks: vec![Block::EMPTY] };
    let depth = maker.make();
    // Every level leaves at most seven siblings waiting.
    Bvh { nodes: maker.nodes, blocks: maker.blocks, stack: depth * (LANES - 1) + LANES }
}

/// Keeps the first of each set of triangles with bitwise equal corners in the same order.
fn drop_repeated(ids: &mut Vec<u32>, corners: &mut Vec<[Vec3; 3]>) {
    let bits = |k: u32| corners[k as usize].map(|p| p.to_array().map(f32::to_bits));
    let hash = |k: u32| {
        // FNV-1a (Fowler, Noll and Vo) by words; only equal corners are dropped, so that a collision costs
        // nothing.
        let step = |h: u64, b: u32| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3);
        bits(k).into_iter().flatten().fold(0xcbf2_9ce4_8422_2325, step)
    };
    let mut order: Vec<(u64, u32)> = (0..corners.len() as u32).map(|k| (hash(k), k)).collect();
    order.sort_unstable();
    let mut keep = vec![true; corners.len()];
    for w in order.windows(2) {
        if w[0].0 == w[1].0 && bits(w[0].1) == bits(w[1].1) {
            keep[w[1].1 as usize] = false;
        }
    }
    let mut kept = keep.iter();
    ids.retain(|_| *kept.next().expect("one of each"));
    let mut kept = keep.iter();
    corners.retain(|_| *kept.next().expect("one of each"));
}

/// The binary tree. Its boxes only shape it, so they are brought to the unit cube first: no square of an area
/// overflows, whatever the unit of length.
fn binary(corners: &[[Vec3; 3]]) -> Bvh2 {
    let all = || corners.iter().flatten();
    let lo = all().copied().reduce(Vec3::min).unwrap_or_default();
    let hi = all().copied().reduce(Vec3::max).unwrap_or_default();
    let largest = (0.5 * hi - 0.5 * lo).max_element();
    let (centre, scale) = (0.5 * lo + 0.5 * hi, if largest > 0.0 { 1.0 / largest } else { 1.0 });
    let scale = if scale.is_finite() { scale } else { 1.0 };
    let boxes: Vec<Aabb> =
        corners.iter().map(|t| Aabb::from_points(&t.map(|p| Vec3A::from((p - centre) * scale)))).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        &boxes,
        (0..boxes.len() as u32).collect(),
        SortPrecision::U64,
        3,
    );
    let mut optimizer = ReinsertionOptimizer::default();
    optimizer.run(&mut tree, REINSERTION, None);
    collapse(&mut tree, LANES as u32, TRAVERSAL_COST);
    optimizer.run(&mut tree, 2.0 * REINSERTION, None);
    tree
}

struct Maker<'a> {
    tree: &'a Bvh2,
    corners: &'a [[Vec3; 3]],
    ids: &'a [u32],
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

impl Maker<'_> {
    /// Makes all nodes from the root; returns the number of levels.
    fn make(&mut self) -> usize {
        self.nodes.push(Node::EMPTY);
        // Nodes to fill: index here, the binary nodes that become its children, level.
        let mut waiting = vec![(0usize, vec![0u32], 1usize)];
        let mut depth = 0;
        while let Some((at, mut members, level)) = waiting.pop() {
            depth = depth.max(level);
            self.open(&mut members);
            // Any-hit rays visit the last child first: the largest is the likeliest to block.
            members.sort_by(|a, b| self.area(*a).total_cmp(&self.area(*b)));
            for (lane, &m) in members.iter().enumerate() {
                let (first, count) = self.span(m);
                let (child, lo, hi) = if count > 0 {
                    self.leaf(first, count)
                } else {
                    let index = self.nodes.len();
                    self.nodes.push(Node::EMPTY);
                    waiting.push((index, vec![first, first + 1], level + 1));
                    let (lo, hi) = self.bounds(m);
                    (index as u32, lo, hi)
                };
                self.place(at, lane, child, lo, hi);
            }
        }
        depth
    }

    fn span(&self, node: u32) -> (u32, u32) {
        let n = &self.tree.nodes[node as usize];
        (n.first_index, n.prim_count)
    }

    fn area(&self, node: u32) -> f32 {
        self.tree.nodes[node as usize].aabb().half_area()
    }

    /// Opens the inner member of the largest box until there are eight members.
    fn open(&self, members: &mut Vec<u32>) {
        while members.len() < LANES {
            let inner = (0..members.len()).filter(|&i| self.span(members[i]).1 == 0);
            let Some(i) = inner.max_by(|&a, &b| self.area(members[a]).total_cmp(&self.area(members[b])))
            else {
                break;
            };
            let (first, _) = self.span(members[i]);
            members[i] = first;
            members.push(first + 1);
        }
    }

    fn place(&mut self, at: usize, lane: usize, child: u32, lo: Vec3, hi: Vec3) {
        let node = &mut self.nodes[at];
        node.children[lane] = child;
        for k in 0..3 {
            node.planes[2 * k][lane] = lo[k];
            node.planes[2 * k + 1][lane] = hi[k];
        }
    }

    /// A block of the triangles of a binary leaf and its exact box.
    fn leaf(&mut self, first: u32, count: u32) -> (u32, Vec3, Vec3) {
        let mut block = Block::EMPTY;
        let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let members = &self.tree.primitive_indices[first as usize..][..count as usize];
        for (lane, &p) in members.iter().enumerate() {
            block.ids[lane] = self.ids[p as usize];
            for (v, corner) in self.corners[p as usize].iter().enumerate() {
                (lo, hi) = (lo.min(*corner), hi.max(*corner));
                for k in 0..3 {
                    block.corners[v][k][lane] = corner[k];
                }
            }
        }
        self.blocks.push(block);
        (LEAF | (self.blocks.len() - 1) as u32, lo, hi)
    }

    /// The exact box of everything below a binary node.
    fn bounds(&self, node: u32) -> (Vec3, Vec3) {
        let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut stack = vec![node];
        while let Some(n) = stack.pop() {
            let (first, count) = self.span(n);
            if count == 0 {
                stack.extend([first, first + 1]);
                continue;
            }
            for &p in &self.tree.primitive_indices[first as usize..][..count as usize] {
                for corner in &self.corners[p as usize] {
                    (lo, hi) = (lo.min(*corner), hi.max(*corner));
                }
            }
        }
        (lo, hi)
    }
}
