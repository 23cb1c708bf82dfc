//! Any-hit rays of one origin, traced together: a node is fetched, and the origin subtracted from its planes,
//! once for all rays that reach it, and no ray's test waits for that of another (Wald et al. 2001,
//! Interactive Rendering with Coherent Ray Tracing; the eight boxes of a node stay side by side in a register
//! here). A ray that is alone below a node goes on as a single one. Rays visit the boxes and triangles that
//! they visit alone, so that results are the same to the bit.

use super::node::{LEAF, Slabs};
use super::traverse::any;
use super::triangle::Shear;
use super::{Bvh, LANES};
use crate::Ray;
use steradian_simd::Lanes;

/// Rays of a packet at most.
pub const PACKET: usize = 16;

/// Directions are similar if the ranges of their components along the axes sum to at most this: packets of
/// others would part at once.
const SIMILAR: f32 = 1.5;

/// Have the rays one origin and similar directions?
pub fn form_packet(rays: &[Ray]) -> bool {
    let [first, rest @ ..] = rays else { return false };
    let (mut low, mut high) = (first.direction, first.direction);
    let mut same = !rest.is_empty();
    for ray in rest {
        same &= ray.origin == first.origin;
        (low, high) = (low.min(ray.direction), high.max(ray.direction));
    }
    // NaN is similar to nothing.
    same && (high - low).element_sum() <= SIMILAR
}

/// Stacks of a traversal: nodes with the rays that reach them, and nodes of a ray alone.
pub struct Stacks<'a> {
    pub packet: &'a mut [(u32, u32)],
    pub single: &'a mut [u32],
}

/// Is there any hit in (0, `t_max`), for each ray of a packet?
#[inline(always)]
pub fn packet<L: Lanes>(bvh: &Bvh, rays: &[Ray], t_max: f32, stacks: &mut Stacks, out: &mut [bool]) {
    let Some(first) = rays.first() else { return };
    let mut slabs = [Slabs::<L>::new(first.origin, first.direction); PACKET];
    let mut shears = [Shear::<L>::new(first.origin, first.direction); PACKET];
    for (k, ray) in rays.iter().enumerate().skip(1) {
        slabs[k] = Slabs::new(ray.origin, ray.direction);
        shears[k] = Shear::new(ray.origin, ray.direction);
    }
    // A bit for every ray that has hit nothing yet.
    let mut free = u32::MAX >> (32 - rays.len().min(32));
    let mut top = 1;
    stacks.packet[0] = (0, free);
    while top > 0 {
        top -= 1;
        let (index, reach) = stacks.packet[top];
        let reach = reach & free;
        if reach & reach.wrapping_sub(1) == 0 {
            let ray = reach.trailing_zeros() as usize % PACKET;
            if reach != 0 && any(bvh, index, &slabs[ray], &shears[ray], t_max, stacks.single) {
                free &= !reach;
            }
            continue;
        }
        let node = &bvh.nodes[index as usize];
        let from = &slabs[0];
        let planes = [
            from.relative(node, 0),
            from.relative(node, 1),
            from.relative(node, 2),
            from.relative(node, 3),
            from.relative(node, 4),
            from.relative(node, 5),
        ];
        // A byte for every ray: the boxes that it enters.
        let mut boxes = [0u64; PACKET / 8];
        let mut union = 0;
        let mut left = reach;
        while left != 0 {
            let ray = left.trailing_zeros() as usize % PACKET;
            left &= left - 1;
            let entered = slabs[ray].enter_relative(&planes, t_max);
            union |= entered;
            boxes[ray / 8] |= u64::from(entered) << (8 * (ray % 8));
        }
        let boxes = [transposed(boxes[0]), transposed(boxes[1])];
        while union != 0 {
            let lane = union.trailing_zeros() as usize % LANES;
            union &= union - 1;
            let child = node.children[lane];
            let byte = |half: u64| (half >> (8 * lane)) as u32 & 0xff;
            let mut reach = (byte(boxes[0]) | byte(boxes[1]) << 8) & free;
            if child & LEAF == 0 {
                stacks.packet[top] = (child, reach);
                top += 1;
                continue;
            }
            let block = &bvh.blocks[(child ^ LEAF) as usize];
            while reach != 0 {
                let ray = reach.trailing_zeros() as usize % PACKET;
                let bit = reach & reach.wrapping_neg();
                reach ^= bit;
                if shears[ray].hit(block, t_max).is_some() {
                    free &= !bit;
                }
            }
        }
    }
    for (k, out) in out.iter_mut().enumerate() {
        *out = free >> k & 1 == 0;
    }
}

/// The transpose of a matrix of 8 × 8 bits (Warren 2012, Hacker's Delight, section 7-3).
#[inline(always)]
fn transposed(mut x: u64) -> u64 {
    for (shift, mask) in
        [(7, 0x00aa_00aa_00aa_00aa), (14, 0x0000_cccc_0000_cccc), (28, 0x0000_0000_f0f0_f0f0)]
    {
        let t = (x ^ (x >> shift)) & mask;
        x ^= t ^ (t << shift);
    }
    x
}
