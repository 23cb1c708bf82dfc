//! The second pass of 5.22 over one panel: Σ g_q(θ) f_lq(θ) over its circles, eight q side by side.

use super::kernel::Request;
use super::rule::{Node, POINTS};
use super::theta::Polar;
use steradian_simd::{Arch, Kernel, Vector, run};

/// Number of orders q that are summed in lanes: as many as the widest register has.
const SIDE: usize = 8;
/// Number of circles at a time, whose recursions hide each other's latency.
const CIRCLES: usize = 5;

/// One number for each of the orders side by side.
type Lanes = [f64; SIDE];
/// Lanes of each channel.
pub(super) type Rgb = [Lanes; 3];

/// Eight q and their recursion f_l = a cos θ f_{l−1} − b f_{l−2}, for l from the lowest q on; a = b = 0 up to
/// l = q, where f_qq comes in.
struct Block {
    first: usize,
    steps: Vec<[Lanes; 2]>,
}

/// All q ≤ Q in blocks, with the sums of one panel.
pub(super) struct Bands {
    bands: usize,
    q: usize,
    /// √((2q + 1)/(2q)) of the sectoral step.
    sectoral: Vec<f64>,
    blocks: Vec<Block>,
    /// Block after block, from its first q on to l = F: the 15-point rule.
    pub sum: Vec<Rgb>,
    /// The sum minus that of the 7-point rule, as an error estimate.
    difference: Vec<Rgb>,
}

impl Bands {
    pub fn new(request: &Request, polar: &Polar) -> Self {
        let (bands, q) = (request.f + 1, request.q);
        let block = |first: usize| {
            let step = |l: usize| {
                let of = |k: usize| {
                    std::array::from_fn(|i| {
                        let q = first + i;
                        if q <= request.q && l > q { polar.step(q, l)[k] } else { 0.0 }
                    })
                };
                [of(0), of(1)]
            };
            Block { first, steps: (first..bands).map(step).collect() }
        };
        let blocks: Vec<Block> = (0..=q).step_by(SIDE).map(block).collect();
        let len = blocks.iter().map(|b| b.steps.len()).sum();
        let empty = vec![[[0.0; SIDE]; 3]; len];
        let sectoral = (0..=q).map(|q| polar.sectoral(q)).collect();
        Self { bands, q, sectoral, blocks, sum: empty.clone(), difference: empty }
    }

    /// Overwrites the sums by those over circles at `thetas`, g_q of channel c being `rings[node][3q + c]`;
    /// returns the norm of the difference between both rules.
    pub fn project(
        &mut self,
        nodes: &[Node; POINTS],
        thetas: &[f64; POINTS],
        rings: &[f64],
        width: usize,
    ) -> f64 {
        let ring = |node: usize| &rings[node * width..][..3 * (self.q + 1)];
        let grey =
            (0..POINTS).all(|n| ring(n).as_chunks::<3>().0.iter().all(|g| g[0] == g[1] && g[1] == g[2]));
        let angles = thetas.map(f64::sin_cos);
        let mut seeds = [(0.25 / std::f64::consts::PI).sqrt(); POINTS];
        let (mut at, mut square) = (0, 0.0);
        for block in &self.blocks {
            let len = block.steps.len();
            let mut circles = [Circle::default(); POINTS];
            for (n, circle) in circles.iter_mut().enumerate() {
                circle.cosine = angles[n].1;
                for i in 0..SIDE.min(self.q + 1 - block.first) {
                    let q = block.first + i;
                    if q > 0 {
                        seeds[n] *= self.sectoral[q] * angles[n].0;
                    }
                    circle.seed[i] = seeds[n];
                    for (c, g) in ring(n)[3 * q..3 * q + 3].iter().enumerate() {
                        circle.weight[c][i] = nodes[n].weight * g;
                        circle.difference[c][i] = nodes[n].difference * g;
                    }
                }
            }
            let (sum, difference) = (&mut self.sum[at..at + len], &mut self.difference[at..at + len]);
            let steps = &block.steps;
            if grey {
                run(Sums::<1> { steps, circles: &circles, sum, difference });
            } else {
                run(Sums::<3> { steps, circles: &circles, sum, difference });
            }
            square += squares(difference, block.first);
            at += len;
        }
        square.sqrt()
    }

    /// `[q][c][l]` of sums as [`Bands::sum`] has them.
    pub fn rows(&self, sum: &[Rgb]) -> Vec<f64> {
        let mut out = vec![0.0; 3 * self.bands * (self.q + 1)];
        let mut at = 0;
        for block in &self.blocks {
            for (l, sum) in (block.first..).zip(&sum[at..at + block.steps.len()]) {
                for q in block.first..(block.first + SIDE).min(self.q + 1) {
                    (0..3).for_each(|c| out[(3 * q + c) * self.bands + l] = sum[c][q - block.first]);
                }
            }
            at += block.steps.len();
        }
        out
    }
}

/// Σ d² over bands and channels, q and −q both counted.
fn squares(difference: &[Rgb], first: usize) -> f64 {
    let mut lanes = [0.0; SIDE];
    for d in difference.as_flattened() {
        (0..SIDE).for_each(|i| lanes[i] += d[i] * d[i]);
    }
    let all: f64 = lanes.iter().sum();
    if first == 0 { 2.0 * all - lanes[0] } else { 2.0 * all }
}

/// A circle of a panel: cos θ, f_qq, and its integrals times the rule's weights.
#[derive(Clone, Copy, Default)]
struct Circle {
    cosine: f64,
    seed: Lanes,
    weight: Rgb,
    difference: Rgb,
}

/// The sums of one block; channels are copies of the first where C = 1.
struct Sums<'a, const C: usize> {
    steps: &'a [[Lanes; 2]],
    circles: &'a [Circle; POINTS],
    sum: &'a mut [Rgb],
    difference: &'a mut [Rgb],
}

impl<const C: usize> Kernel for Sums<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        // Closures, as of std::array::from_fn, would not be compiled for the instruction set.
        let Self { steps, circles, sum, difference } = self;
        for lane in (0..SIDE).step_by(A::F64::LANES) {
            for (group, circles) in circles.as_chunks::<CIRCLES>().0.iter().enumerate() {
                let zero = A::F64::splat(0.0);
                let mut cosine = [zero; CIRCLES];
                for k in 0..CIRCLES {
                    cosine[k] = A::F64::splat(circles[k].cosine);
                }
                let (mut now, mut before) = ([zero; CIRCLES], [zero; CIRCLES]);
                for (l, [a, b]) in steps.iter().enumerate() {
                    let (a, b) = (A::F64::load(&a[lane..]), A::F64::load(&b[lane..]));
                    let (mut s, mut d) = ([zero; C], [zero; C]);
                    if group > 0 {
                        for c in 0..C {
                            s[c] = A::F64::load(&sum[l][c][lane..]);
                            d[c] = A::F64::load(&difference[l][c][lane..]);
                        }
                    }
                    for k in 0..CIRCLES {
                        let mut next = b.fnma(before[k], a.mul(cosine[k]).mul(now[k]));
                        if l < SIDE {
                            let mut one = [0.0; SIDE];
                            one[l] = circles[k].seed[l];
                            next = next.add(A::F64::load(&one[lane..]));
                        }
                        (before[k], now[k]) = (now[k], next);
                        for c in 0..C {
                            s[c] = A::F64::load(&circles[k].weight[c][lane..]).fma(next, s[c]);
                            d[c] = A::F64::load(&circles[k].difference[c][lane..]).fma(next, d[c]);
                        }
                    }
                    for c in 0..3 {
                        s[c % C].store(&mut sum[l][c][lane..]);
                        d[c % C].store(&mut difference[l][c][lane..]);
                    }
                }
            }
        }
    }
}
