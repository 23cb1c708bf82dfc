//! The two traversals. Everything here is inlined into code that is compiled per instruction set.

use super::node::{LEAF, Slabs};
use super::triangle::Shear;
use super::{Bvh, Hit, LANES};
use crate::Ray;

/// Stack entries that need no allocation: trees of more than eighteen levels are rare.
const FIXED: usize = 136;

/// Any hit in (0, `t_max`)?
#[inline(always)]
pub fn occluded(bvh: &Bvh, ray: &Ray, t_max: f32) -> bool {
    if bvh.stack <= FIXED {
        any(bvh, ray, t_max, &mut [0; FIXED])
    } else {
        any(bvh, ray, t_max, &mut vec![0; bvh.stack])
    }
}

/// All children that the ray enters are visited, in no particular order.
#[inline(always)]
fn any(bvh: &Bvh, ray: &Ray, t_max: f32, stack: &mut [u32]) -> bool {
    let slabs = Slabs::new(ray.origin, ray.direction);
    let shear = Shear::new(ray.origin, ray.direction);
    let mut top = 1;
    stack[0] = 0;
    while top > 0 {
        top -= 1;
        let node = &bvh.nodes[stack[top] as usize];
        let (_, mut mask) = slabs.enter(node, t_max);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            let child = node.children[lane & (LANES - 1)];
            if child & LEAF == 0 {
                stack[top] = child;
                top += 1;
            } else if shear.any(&bvh.blocks[(child ^ LEAF) as usize], t_max) {
                return true;
            }
        }
    }
    false
}

/// The nearest hit in (0, `t_max`).
#[inline(always)]
pub fn closest(bvh: &Bvh, ray: &Ray, t_max: f32) -> Option<Hit> {
    if bvh.stack <= FIXED {
        nearest(bvh, ray, t_max, &mut [(0, 0.0); FIXED])
    } else {
        nearest(bvh, ray, t_max, &mut vec![(0, 0.0); bvh.stack])
    }
}

/// Children wait on the stack, the nearest on top; those behind the hit are dropped.
#[inline(always)]
fn nearest(bvh: &Bvh, ray: &Ray, t_max: f32, stack: &mut [(u32, f32)]) -> Option<Hit> {
    let slabs = Slabs::new(ray.origin, ray.direction);
    let shear = Shear::new(ray.origin, ray.direction);
    let (mut best, mut limit) = (None, t_max);
    let mut top = 1;
    stack[0] = (0, 0.0);
    while top > 0 {
        top -= 1;
        let (index, enter) = stack[top];
        if enter > limit {
            continue;
        }
        if index & LEAF != 0 {
            closer(bvh, &shear, index ^ LEAF, t_max, &mut limit, &mut best);
            continue;
        }
        let node = &bvh.nodes[index as usize];
        let (enter, mut mask) = slabs.enter(node, limit);
        let base = top;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & (LANES - 1);
            mask &= mask - 1;
            let entry = (node.children[lane], enter[lane]);
            // Insertion: farthest at the bottom.
            let mut at = top;
            while at > base && stack[at - 1].1 < entry.1 {
                stack[at] = stack[at - 1];
                at -= 1;
            }
            stack[at] = entry;
            top += 1;
        }
    }
    best
}

/// Tests a block; of hits at one distance the lowest index wins, whatever the tree's shape.
#[inline(always)]
fn closer(bvh: &Bvh, shear: &Shear, block: u32, t_max: f32, limit: &mut f32, best: &mut Option<Hit>) {
    let block = &bvh.blocks[block as usize];
    let (t, [_, u, v]) = shear.hit(block, t_max);
    for i in 0..LANES {
        let triangle = block.ids[i];
        if t[i] < *limit || (t[i] == *limit && best.is_some_and(|b: Hit| triangle < b.triangle)) {
            *limit = t[i];
            *best = Some(Hit { t: t[i], triangle, u: u[i], v: v[i] });
        }
    }
}
