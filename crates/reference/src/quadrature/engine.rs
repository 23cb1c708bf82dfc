//! Adaptive integration over all distant light of one point: the worst rectangle is cut first.

use super::cells::{Block, Corners, ImageCells, Moments, corner_moments};
use super::geometry::{Axis, Chart, Nodes, Patch, Rect};
use super::hints::Hints;
use super::horizon::{Horizon, Side};
use super::pyramid::Pyramid;
use super::rule::{Found, Integrand, clipped, product};
use std::borrow::Cow;
use std::collections::BinaryHeap;

/// Source of a rectangle's light.
#[derive(Debug, Clone, Copy)]
enum Place {
    /// A stored block.
    Tree(u32),
    /// A block below the stored ones.
    Cells(Block),
    /// A part of one cell of the image.
    Part { i: u32, j: u32, rect: Rect },
    /// A part of a disk light; the index counts charts (0 is the image).
    Disk { chart: usize, rect: Rect },
}

/// A chart with its horizon.
pub(super) struct View {
    pub chart: Chart,
    pub horizon: Horizon,
}

impl View {
    /// An engine for a chart.
    pub fn new(chart: Chart) -> Self {
        Self { horizon: Horizon::of(&chart), chart }
    }

    /// Position of a rectangle relative to the horizon; most are far from it.
    fn side(&self, patch: &Patch) -> Side {
        let z = self.chart.at(patch.centre).z;
        if z > patch.reach {
            Side::Above
        } else if z < -patch.reach {
            Side::Below
        } else {
            self.horizon.side(patch)
        }
    }
}

/// All distant light as one point sees it.
pub(super) struct Scene<'a> {
    /// The image's cells and tree.
    pub image: Option<(ImageCells<'a>, &'a Pyramid)>,
    /// The image's chart, then one for each disk.
    pub views: Vec<View>,
    /// Angular radius and radiance of each disk.
    pub disks: Vec<(f64, [f64; 3])>,
    /// Ridges of the reflectance.
    pub hints: Hints,
    /// The relative error that is aimed at.
    pub tolerance: f64,
    /// Is f_cos zero below the horizon?
    pub clip: bool,
}

/// A rectangle that counts.
struct Leaf {
    place: Place,
    found: Found,
    alive: bool,
}

/// Heap order: larger error first, then the older.
#[derive(PartialEq)]
struct Entry(f64, u32);

impl Eq for Entry {}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}

/// Rectangles smaller than this, radians, are not subdivided.
const SMALLEST: f64 = 1e-10;

/// Room for leaves from the start: most points take fewer.
const LEAVES: usize = 256;

/// Sums are recomputed after so many subdivisions, to bound rounding errors.
const REFRESH: u32 = 1 << 12;

/// A sum with its error.
#[derive(Debug, Clone, Copy)]
pub(super) struct Total {
    pub value: [f64; 3],
    pub error: f64,
}

/// One integration under way.
pub(super) struct Engine<'a, 'b> {
    scene: &'a Scene<'a>,
    g: &'b mut Integrand<'a>,
    leaves: Vec<Leaf>,
    heap: BinaryHeap<Entry>,
    budget: u64,
}

impl<'a, 'b> Engine<'a, 'b> {
    /// Ready to run with so many evaluations at most, about.
    pub fn new(scene: &'a Scene<'a>, g: &'b mut Integrand<'a>, budget: u64) -> Self {
        Self { scene, g, leaves: Vec::with_capacity(LEAVES), heap: BinaryHeap::with_capacity(LEAVES), budget }
    }

    /// Subdivides until the errors sum to `tolerance` times the largest channel of the integral plus `known`.
    pub fn run(mut self, tolerance: f64, known: [f64; 3]) -> Total {
        self.roots();
        let target =
            |t: &Total| tolerance * (0..3).fold(0.0, |m: f64, c| m.max((t.value[c] + known[c]).abs()));
        let mut total = self.sum();
        let mut cuts = 0u32;
        loop {
            if total.error <= target(&total) || cuts >= REFRESH {
                total = self.sum();
                cuts = 0;
                if total.error <= target(&total) {
                    break;
                }
            }
            if self.g.evaluations >= self.budget {
                break;
            }
            let Some(Entry(_, k)) = self.heap.pop() else { break };
            self.cut(k as usize, &mut total);
            cuts += 1;
        }
        self.sum()
    }

    fn sum(&self) -> Total {
        let mut t = Total { value: [0.0; 3], error: 0.0 };
        let mut size = 0.0;
        for leaf in self.leaves.iter().filter(|l| l.alive) {
            add(&mut t, &leaf.found, 1.0);
            size += leaf.found.value.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        }
        t.error += 1e-15 * size;
        t
    }

    fn roots(&mut self) {
        if self.scene.image.is_some() {
            self.admit(Place::Tree(0));
        }
        for (k, (radius, _)) in self.scene.disks.iter().enumerate() {
            use std::f64::consts::PI;
            self.admit(Place::Disk { chart: k + 1, rect: Rect { phi: [-PI, PI], theta: [0.0, *radius] } });
        }
    }

    /// Replaces leaf k by its halves.
    fn cut(&mut self, k: usize, total: &mut Total) {
        let leaf = &mut self.leaves[k];
        leaf.alive = false;
        add(total, &leaf.found, -1.0);
        let (place, axis) = (leaf.place, leaf.found.axis);
        let before = self.leaves.len();
        for half in self.halves(&place, axis) {
            self.admit(half);
        }
        for leaf in &self.leaves[before..] {
            add(total, &leaf.found, 1.0);
        }
    }

    /// Samples a place, or its parts where it is too large; drops places that are dark or below the horizon.
    fn admit(&mut self, place: Place) {
        let mut stack = vec![place];
        while let Some(place) = stack.pop() {
            let (view, patch) = self.patch(&place);
            let rect = patch.rect;
            let side = if self.scene.clip { view.side(&patch) } else { Side::Above };
            if side == Side::Below || self.is_dark(&place) {
                continue;
            }
            let hints = &self.scene.hints;
            let large = hints.must_cut(&view.chart, &patch)
                || (side == Side::Crossing && hints.must_cut_at_horizon(&patch));
            if self.g.evaluations < self.budget && large {
                let [a, b] = self.halves(&place, patch.long_axis());
                stack.extend([b, a]);
                continue;
            }
            let lit = self.lit(&place, &rect);
            if lit.is_dark() {
                continue;
            }
            if self.g.evaluations < self.budget && self.is_heavy(&lit, &rect) {
                let [a, b] = self.halves(&place, patch.long_axis());
                stack.extend([b, a]);
                continue;
            }
            let found = self.integrate(&lit, view, (&place, &patch), side);
            let index = self.leaves.len() as u32;
            let [a, b] = patch.angular;
            if found.error > 0.0 && a.max(b) > SMALLEST {
                self.heap.push(Entry(found.error, index));
            }
            self.leaves.push(Leaf { place, found, alive: true });
        }
    }

    fn image(&self) -> &'a (ImageCells<'a>, &'a Pyramid) {
        self.scene.image.as_ref().expect("blocks are only admitted where there is an image")
    }

    fn patch(&self, place: &Place) -> (&'a View, Cow<'a, Patch>) {
        let chart = if let Place::Disk { chart, .. } = place { *chart } else { 0 };
        let patch = match *place {
            Place::Tree(k) => Cow::Borrowed(&self.image().1.nodes[k as usize].patch),
            Place::Cells(block) => Cow::Owned(Patch::new(self.image().0.rect(&block))),
            Place::Part { rect, .. } | Place::Disk { rect, .. } => Cow::Owned(Patch::new(rect)),
        };
        (&self.scene.views[chart], patch)
    }

    /// Is it dark, as the hierarchy tells without reading texels?
    fn is_dark(&self, place: &Place) -> bool {
        matches!(*place, Place::Tree(k) if self.image().1.nodes[k as usize].moments.is_dark())
    }

    fn halves(&self, place: &Place, axis: Axis) -> [Place; 2] {
        match *place {
            Place::Tree(k) => {
                let node = &self.image().1.nodes[k as usize];
                match node.child {
                    0 => self.block_halves(&node.block, axis),
                    child => [Place::Tree(child), Place::Tree(child + 1)],
                }
            }
            Place::Cells(block) => self.block_halves(&block, axis),
            Place::Part { i, j, rect } => rect.halves(axis).map(|rect| Place::Part { i, j, rect }),
            Place::Disk { chart, rect } => rect.halves(axis).map(|rect| Place::Disk { chart, rect }),
        }
    }

    fn block_halves(&self, block: &Block, axis: Axis) -> [Place; 2] {
        let cells = &self.image().0;
        if block.len() == 1 {
            let (i, j) = (block.i[0], block.j[0]);
            return cells.rect(block).halves(axis).map(|rect| Place::Part { i, j, rect });
        }
        block.halves(axis).map(|b| match b.len() {
            1 => Place::Part { i: b.i[0], j: b.j[0], rect: cells.rect(&b) },
            _ => Place::Cells(b),
        })
    }

    fn lit(&self, place: &Place, rect: &Rect) -> Lit<'a> {
        match *place {
            Place::Tree(k) => Lit::Stored(&self.image().1.nodes[k as usize].moments),
            Place::Cells(block) => Lit::Summed(Box::new(self.image().0.moments(&block))),
            Place::Part { i, j, .. } => Lit::Corners(self.image().0.corners(i, j, rect)),
            Place::Disk { chart, .. } => Lit::Corners(self.scene.disks[chart - 1].1.map(|v| [v; 4])),
        }
    }

    fn is_heavy(&self, lit: &Lit<'_>, rect: &Rect) -> bool {
        lit.moments().is_some_and(|m| self.image().1.is_heavy(m, rect, self.scene.tolerance))
    }

    fn integrate(
        &mut self,
        lit: &Lit<'_>,
        view: &View,
        (place, patch): (&Place, &Patch),
        side: Side,
    ) -> Found {
        let horizon = (side == Side::Crossing).then_some(&view.horizon);
        let chart = &view.chart;
        match (lit, horizon) {
            (Lit::Stored(m), h) => match *place {
                Place::Tree(k) => {
                    product(self.g, chart, h, (patch, &self.image().1.nodes[k as usize].nodes), m)
                }
                _ => product(self.g, chart, h, (patch, &Nodes::new(patch)), m),
            },
            (Lit::Summed(m), h) => product(self.g, chart, h, (patch, &Nodes::new(patch)), m),
            (Lit::Corners(l), Some(h)) => clipped(self.g, chart, h, patch, l),
            (Lit::Corners(l), None) => {
                let moments = corner_moments(l, &patch.rect);
                product(self.g, chart, None, (patch, &Nodes::new(patch)), &moments)
            }
        }
    }
}

/// The light on a rectangle.
enum Lit<'a> {
    Stored(&'a Moments),
    Summed(Box<Moments>),
    Corners(Corners),
}

impl Lit<'_> {
    fn moments(&self) -> Option<&Moments> {
        match self {
            Self::Stored(m) => Some(m),
            Self::Summed(m) => Some(m),
            Self::Corners(_) => None,
        }
    }

    fn is_dark(&self) -> bool {
        match self {
            Self::Corners(l) => l.iter().flatten().all(|v| *v == 0.0),
            _ => self.moments().is_some_and(Moments::is_dark),
        }
    }
}

fn add(t: &mut Total, found: &Found, sign: f64) {
    for c in 0..3 {
        t.value[c] += sign * found.value[c];
    }
    t.error += sign * found.error;
}
