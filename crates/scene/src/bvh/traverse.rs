//! The traversals. Everything here is inlined into code that is compiled per instruction set.

use super::node::{LEAF, Slabs};
use super::packet::{PACKET, Stacks, form_packet, packet};
use super::triangle::Shear;
use super::{Bvh, Hit, LANES};
use crate::Ray;
use steradian_simd::{Arch, Kernel, Lanes};

/// Stack entries that need no allocation: trees of more than nine levels are rare.
const FIXED: usize = 72;

/// Is there any hit in (0, `t_max`), for each ray?
pub struct Occluded<'a> {
    pub bvh: &'a Bvh,
    pub rays: &'a [Ray],
    pub t_max: f32,
    pub out: &'a mut [bool],
}

impl Kernel for Occluded<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let (mut fixed, mut heap) = ([0; FIXED], Vec::new());
        let single = room(self.bvh.stack, &mut fixed, &mut heap);
        // Of packets; made only where there are any.
        let mut memory = None;
        for (out, rays) in self.out.chunks_mut(PACKET).zip(self.rays.chunks(PACKET)) {
            if form_packet(rays) {
                let (fixed, heap) = memory.get_or_insert(([(0, 0); FIXED], Vec::new()));
                let both = room(self.bvh.stack, fixed, heap);
                packet::<A::F32x8>(self.bvh, rays, self.t_max, &mut Stacks { packet: both, single }, out);
                continue;
            }
            for (out, ray) in out.iter_mut().zip(rays) {
                let slabs = Slabs::<A::F32x8>::new(ray.origin, ray.direction);
                let shear = Shear::<A::F32x8>::new(ray.origin, ray.direction);
                *out = any(self.bvh, 0, &slabs, &shear, self.t_max, single);
            }
        }
    }
}

/// The nearest hit in (0, `t_max`), for each ray.
pub struct Closest<'a> {
    pub bvh: &'a Bvh,
    pub rays: &'a [Ray],
    pub t_max: f32,
    pub out: &'a mut [Option<Hit>],
}

impl Kernel for Closest<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let (mut fixed, mut heap) = ([(0, 0.0); FIXED], Vec::new());
        let stack = room(self.bvh.stack, &mut fixed, &mut heap);
        for (out, ray) in self.out.iter_mut().zip(self.rays) {
            *out = nearest::<A::F32x8>(self.bvh, ray, self.t_max, stack);
        }
    }
}

/// All hits in (0, `t_max`).
pub struct Every<'a> {
    pub bvh: &'a Bvh,
    pub ray: &'a Ray,
    pub t_max: f32,
    pub out: &'a mut Vec<u32>,
}

impl Kernel for Every<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let (mut fixed, mut heap) = ([0; FIXED], Vec::new());
        let stack = room(self.bvh.stack, &mut fixed, &mut heap);
        let slabs = Slabs::<A::F32x8>::new(self.ray.origin, self.ray.direction);
        let shear = Shear::<A::F32x8>::new(self.ray.origin, self.ray.direction);
        let mut top = 1;
        stack[0] = 0;
        while top > 0 {
            top -= 1;
            let node = &self.bvh.nodes[stack[top] as usize];
            let (_, mut mask) = slabs.enter(node, self.t_max);
            while mask != 0 {
                let child = node.children[mask.trailing_zeros() as usize & (LANES - 1)];
                mask &= mask - 1;
                if child & LEAF == 0 {
                    stack[top] = child;
                    top += 1;
                    continue;
                }
                let block = &self.bvh.blocks[(child ^ LEAF) as usize];
                let mut met = shear.hit(block, self.t_max).map_or(0, |met| met.mask);
                while met != 0 {
                    self.out.push(block.ids[met.trailing_zeros() as usize & (LANES - 1)]);
                    met &= met - 1;
                }
            }
        }
    }
}

/// A stack of `size` entries: the fixed one where it is large enough.
#[inline(always)]
fn room<'a, T: Copy + Default>(size: usize, fixed: &'a mut [T], heap: &'a mut Vec<T>) -> &'a mut [T] {
    if size <= fixed.len() {
        return fixed;
    }
    heap.resize(size, T::default());
    heap
}

/// Does the ray hit anything below a node? All children that it enters are visited, the last (the largest)
/// first.
#[inline(always)]
pub fn any<L: Lanes>(
    bvh: &Bvh,
    node: u32,
    slabs: &Slabs<L>,
    shear: &Shear<L>,
    t_max: f32,
    stack: &mut [u32],
) -> bool {
    let (mut node, mut top) = (&bvh.nodes[node as usize], 0);
    loop {
        let (_, mut mask) = slabs.enter(node, t_max);
        while mask != 0 {
            let child = node.children[mask.trailing_zeros() as usize & (LANES - 1)];
            mask &= mask - 1;
            if child & LEAF == 0 {
                stack[top] = child;
                top += 1;
            } else if shear.hit(&bvh.blocks[(child ^ LEAF) as usize], t_max).is_some() {
                return true;
            }
        }
        if top == 0 {
            return false;
        }
        top -= 1;
        node = &bvh.nodes[stack[top] as usize];
    }
}

/// Children wait on the stack, the nearest on top; those behind the hit are dropped.
#[inline(always)]
fn nearest<L: Lanes>(bvh: &Bvh, ray: &Ray, t_max: f32, stack: &mut [(u32, f32)]) -> Option<Hit> {
    let slabs = Slabs::<L>::new(ray.origin, ray.direction);
    let shear = Shear::<L>::new(ray.origin, ray.direction);
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
        let enter = enter.store();
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
fn closer<L: Lanes>(
    bvh: &Bvh,
    shear: &Shear<L>,
    block: u32,
    t_max: f32,
    limit: &mut f32,
    best: &mut Option<Hit>,
) {
    let block = &bvh.blocks[block as usize];
    let Some(met) = shear.hit(block, t_max) else { return };
    let (mut mask, t, [u, v]) = (met.mask, met.t.store(), [met.uv[0].store(), met.uv[1].store()]);
    while mask != 0 {
        let i = mask.trailing_zeros() as usize & (LANES - 1);
        mask &= mask - 1;
        let triangle = block.ids[i];
        if t[i] < *limit || (t[i] == *limit && best.is_some_and(|b: Hit| triangle < b.triangle)) {
            *limit = t[i];
            *best = Some(Hit { t: t[i], triangle, u: u[i], v: v[i] });
        }
    }
}
