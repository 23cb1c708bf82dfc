//! The traversals. Everything here is inlined into code that is compiled per instruction set.

use super::node::{Cone, LEAF, Node, Slabs};
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
        let stack = room(self.bvh.stack, &mut fixed, &mut heap);
        // Not made for single rays, for which there are no bundles: making it would cost about a twentieth of
        // their time, measured by runs that vary by more.
        let mut front = None;
        for (out, rays) in self.out.chunks_mut(BUNDLE).zip(self.rays.chunks(BUNDLE)) {
            let below = match cone::<A::F32x8>(rays) {
                Some(cone) => {
                    let front = match &mut front {
                        Some(known) => known,
                        none => none.insert([Node::EMPTY; FRONT]),
                    };
                    entered(self.bvh, &cone, self.t_max, front)
                }
                None => &self.bvh.nodes[..1],
            };
            for (out, ray) in out.iter_mut().zip(rays) {
                *out = any::<A::F32x8>(self.bvh, below, ray, self.t_max, stack);
            }
        }
    }
}

/// Number of rays that are traced as a bundle, where they have one origin and similar directions.
const BUNDLE: usize = 16;
/// Nodes that hold the boxes from which a bundle's rays start in place of the root: those that any of its
/// rays may meet.
const FRONT: usize = 4;
/// Directions are similar if the ranges of their components along the axes sum to at most this.
const SIMILAR: f32 = 1.5;

/// The cone around `rays`; `None` unless they form a bundle.
#[inline(always)]
fn cone<L: Lanes>(rays: &[Ray]) -> Option<Cone<L>> {
    let first = rays.first().filter(|_| rays.len() == BUNDLE)?;
    let (mut low, mut high) = (first.direction, first.direction);
    let mut same = true;
    for ray in rays {
        same &= ray.origin == first.origin;
        (low, high) = (low.min(ray.direction), high.max(ray.direction));
    }
    // NaN is similar to nothing.
    (same && (high - low).element_sum() <= SIMILAR).then(|| Cone::new(first.origin, low, high))
}

/// The children of any nodes that a ray of a cone may meet, without their ancestors: no ray meets a box but
/// by way of them.
#[inline(always)]
fn entered<'a, L: Lanes>(bvh: &Bvh, cone: &Cone<L>, t_max: f32, front: &'a mut [Node; FRONT]) -> &'a [Node] {
    const MOST: usize = FRONT * LANES;
    let (mut waiting, mut top, mut count) = ([0u32; MOST], 1, 0);
    // Nodes that wait have room in the front for one child each: with their number it is bounded.
    while top > 0 {
        top -= 1;
        let node = &bvh.nodes[waiting[top] as usize];
        let mut mask = cone.enter(node, t_max);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & (LANES - 1);
            mask &= mask - 1;
            let child = node.children[lane];
            if child & LEAF == 0 && count + (top + 1) * LANES + mask.count_ones() as usize <= MOST {
                waiting[top] = child;
                top += 1;
                continue;
            }
            let (to, at) = (&mut front[count / LANES], count % LANES);
            for (to, from) in to.planes.iter_mut().zip(&node.planes) {
                to[at] = from[lane];
            }
            to.children[at] = child;
            count += 1;
        }
    }
    let used = count.div_ceil(LANES);
    // Clears entries that an earlier bundle left.
    for at in count..used * LANES {
        let to = &mut front[at / LANES];
        to.children[at % LANES] = LEAF;
        for (k, plane) in to.planes.iter_mut().enumerate() {
            plane[at % LANES] = Node::EMPTY.planes[k][0];
        }
    }
    &front[..used]
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

/// All children of the nodes `below` that the ray enters are visited, the last (the largest) first.
#[inline(always)]
fn any<L: Lanes>(bvh: &Bvh, below: &[Node], ray: &Ray, t_max: f32, stack: &mut [u32]) -> bool {
    let slabs = Slabs::<L>::new(ray.origin, ray.direction);
    let shear = Shear::<L>::new(ray.origin, ray.direction);
    for mut node in below {
        let mut top = 0;
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
                break;
            }
            top -= 1;
            node = &bvh.nodes[stack[top] as usize];
        }
    }
    false
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
