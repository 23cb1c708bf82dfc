//! Texels to a block.
//!
//! A line is fitted to all texels, and to both subsets of the most promising shapes; its ends are moved to
//! the least squares of the levels that the texels take, rounded in every mode whose precision can pay, and
//! the best result is searched for better ends, channel by channel, until none is found.

use super::fit::{Cloud, Point, members};
use super::modes::{
    ANCHORS, Endpoints, MODES, Mode, PADDED, SHAPES, WEIGHTS16, finish, index_bits, interpolate, unquantise,
    weights,
};

/// Shapes of two subsets that are tried.
const SHAPES_TRIED: usize = 4;

/// What is asked of a block: its texels as bits of halves with their sign.
struct Target {
    /// Per channel.
    h: [[f32; 16]; 3],
    cloud: Cloud,
    signed: bool,
}

/// A way to write it.
#[derive(Clone)]
struct Found {
    mode: usize,
    /// Of the table of shapes; 0 with one subset.
    shape: usize,
    /// As they are stored, differences resolved.
    q: Endpoints,
    index: [u8; 16],
    /// Sum of squared differences.
    error: f32,
}

/// The block of sixteen colours, bits of halves with their sign.
pub(super) fn block(texels: &[[i32; 3]; 16], signed: bool) -> u128 {
    let target = Target::new(texels, signed);
    let mut best = target.one_line();
    // Where half a code is the mean error there is nothing to gain.
    if best.error > 12.0 {
        target.two_lines(&mut best);
    }
    target.descend(&mut best);
    best.packed()
}

impl Target {
    fn new(texels: &[[i32; 3]; 16], signed: bool) -> Self {
        let scale = |h: i32| -> f32 {
            // The middle of what `finish` turns into h.
            match (h, signed) {
                (0, _) => 0.0,
                (h, false) => ((64 * h + 32) as f32 / 31.0).min(65535.0),
                (h, true) => ((32 * h + 16 * h.signum()) as f32 / 31.0).clamp(-32767.0, 32767.0),
            }
        };
        Self {
            h: std::array::from_fn(|c| std::array::from_fn(|i| texels[i][c] as f32)),
            cloud: Cloud::new(texels.map(|t| t.map(scale)), signed),
            signed,
        }
    }

    /// Squared differences of bits per squared difference on the scale of interpolation.
    fn per_unit(&self) -> f32 {
        if self.signed { (31.0f32 / 32.0).powi(2) } else { (31.0f32 / 64.0).powi(2) }
    }

    /// Ends of the line through a subset, such that the index of texel `anchor` is in the lower half.
    fn ends(&self, mask: u16, anchor: usize, levels: usize) -> [Point; 2] {
        let mut line = self.cloud.line(mask);
        for _ in 0..2 {
            line = self.cloud.refined(mask, line, levels);
        }
        let (a, b) = line;
        let x = &self.cloud.x[anchor];
        let t: f32 = (0..3).map(|c| (x[c] - 0.5 * (a[c] + b[c])) * (b[c] - a[c])).sum();
        if t > 0.0 { [b, a] } else { [a, b] }
    }

    fn one_line(&self) -> Found {
        let [a, b] = self.ends(u16::MAX, 0, 16);
        let ends = [a, b, a, b];
        let tried = MODES.iter().enumerate().filter(|(_, m)| m.subsets == 1);
        let q = Endpoints::default();
        let mut best = Found { mode: 10, shape: 0, q, index: [0; 16], error: f32::INFINITY };
        for (mode, _) in tried {
            self.try_mode(mode, 0, &ends, &mut best);
        }
        best
    }

    fn two_lines(&self, best: &mut Found) {
        let unit = self.per_unit();
        let spreads = self.cloud.spreads(&SHAPES);
        let mut shapes: Vec<(f32, usize)> = spreads
            .iter()
            .enumerate()
            .filter(|(_, s)| (s[0].across + s[1].across) * unit < best.error)
            // Eight levels cut the line's variance by about 7² and a little more.
            .map(|(i, s)| (s.iter().map(|s| s.across + s.along / 60.0).sum::<f32>(), i))
            .collect();
        shapes.sort_by(|a, b| a.0.total_cmp(&b.0));
        for &(_, shape) in shapes.iter().take(SHAPES_TRIED) {
            let mask = SHAPES[shape];
            let [a, b] = self.ends(!mask, 0, 8);
            let [c, d] = self.ends(mask, ANCHORS[shape], 8);
            let ends = [a, b, c, d];
            // In order of precision; what fits without a change makes coarser modes pointless.
            let mut whole = 0;
            for mode in [2, 3, 4, 0, 5, 6, 7, 8, 1, 9] {
                let precision = MODES[mode].precision;
                if whole > precision {
                    break;
                }
                if self.try_mode(mode, shape, &ends, best) {
                    whole = precision;
                }
            }
        }
    }

    /// Rounds the ends to a mode and keeps the result where it is better; ends that are too far from the
    /// first one come as near as the mode needs. Did none have to?
    fn try_mode(&self, mode: usize, shape: usize, ends: &[Point; 4], best: &mut Found) -> bool {
        let m = &MODES[mode];
        let mut q = Endpoints::default();
        let mut moved = 0.0f32;
        for e in 0..2 * m.subsets {
            for c in 0..3 {
                let nearest = quantise(ends[e][c], m.precision, self.signed);
                q[e][c] = if e == 0 { nearest } else { near(m, q[0][c], nearest, c) };
                if q[e][c] != nearest {
                    moved += (unquantise(q[e][c], m.precision, self.signed) as f32 - ends[e][c]).powi(2);
                }
            }
        }
        // A moved end shifts a third of its texels' squares or so, at least one texel's.
        if moved * self.per_unit() > 2.0 * best.error {
            return false;
        }
        let mut found = Found { mode, shape, q, index: [0; 16], error: 0.0 };
        self.choose(&mut found);
        if found.error < best.error {
            *best = found;
        }
        moved == 0.0
    }

    /// The nearest level of each texel, and the error.
    fn choose(&self, found: &mut Found) {
        let m = &MODES[found.mode];
        let levels = weights(m.subsets);
        let mut index = [0u8; 16];
        let mut least = [f32::INFINITY; 16];
        for subset in 0..m.subsets {
            let mask = found.mask(subset);
            let palette = self.palette(found, subset);
            let (mut best, mut at) = ([f32::INFINITY; 16], [0f32; 16]);
            for k in 0..levels.len() {
                self.nearer([palette[0][k], palette[1][k], palette[2][k]], k as f32, &mut best, &mut at);
            }
            for i in members(mask) {
                (least[i], index[i]) = (best[i], at[i] as u8);
            }
            // The anchor's index has one bit less.
            let anchor = found.anchor(subset);
            let half = levels.len() / 2;
            if usize::from(index[anchor]) >= half {
                (least[anchor], index[anchor]) = self.nearest(anchor, &palette, half);
            }
        }
        found.index = index;
        found.error = least.iter().sum();
    }

    /// Takes the level `k` of colour `p` for every texel to which it is nearer.
    fn nearer(&self, p: Point, k: f32, best: &mut [f32; 16], at: &mut [f32; 16]) {
        for i in 0..16 {
            let (r, g, b) = (self.h[0][i] - p[0], self.h[1][i] - p[1], self.h[2][i] - p[2]);
            let d = r * r + g * g + b * b;
            at[i] = if d < best[i] { k } else { at[i] };
            best[i] = best[i].min(d);
        }
    }

    fn nearest(&self, texel: usize, palette: &[[f32; 16]; 3], levels: usize) -> (f32, u8) {
        let distance = |k: usize| (0..3).map(|c| (self.h[c][texel] - palette[c][k]).powi(2)).sum::<f32>();
        let all = (0..levels).map(|k| (distance(k), k as u8));
        all.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f32::INFINITY, 0))
    }

    /// The colours of a subset's levels by channel.
    fn palette(&self, found: &Found, subset: usize) -> [[f32; 16]; 3] {
        std::array::from_fn(|c| self.ramp(found.mode, found.q[2 * subset][c], found.q[2 * subset + 1][c]))
    }

    fn ramp(&self, mode: usize, a: i32, b: i32) -> [f32; 16] {
        let m = &MODES[mode];
        let (a, b) = (unquantise(a, m.precision, self.signed), unquantise(b, m.precision, self.signed));
        // Sixteen levels or eight, the rest unused: a loop of fixed length is a few vector instructions.
        let w: &[i32; 16] = if m.subsets == 2 { &PADDED } else { &WEIGHTS16 };
        std::array::from_fn(|k| finish(interpolate(a, b, w[k]), self.signed) as f32)
    }

    /// Moves ends by single steps for as long as that helps. Channels are independent while the levels stay.
    fn descend(&self, found: &mut Found) {
        for _ in 0..6 {
            let before = found.error;
            let mut next = found.clone();
            let mut changed = false;
            for subset in 0..MODES[found.mode].subsets {
                for c in 0..3 {
                    changed |= self.better_ends(&mut next, subset, c);
                }
            }
            if !changed {
                return;
            }
            self.choose(&mut next);
            if next.error >= before {
                return;
            }
            *found = next;
        }
    }

    /// The best ends of one channel near these, levels kept.
    fn better_ends(&self, found: &mut Found, subset: usize, c: usize) -> bool {
        const STEPS: [(i32, i32); 8] = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)];
        let (e, f) = (2 * subset, 2 * subset + 1);
        let level = Levels::new(&self.h[c], found.mask(subset), &found.index);
        let error = |mode: usize, a: i32, b: i32| level.error(&self.ramp(mode, a, b));
        let mut least = error(found.mode, found.q[e][c], found.q[f][c]);
        let mut changed = false;
        for _ in 0..4 {
            let (a, b) = (found.q[e][c], found.q[f][c]);
            let mut best = None;
            for (da, db) in STEPS {
                let now = error(found.mode, a + da, b + db);
                if now < least && found.allows(c, e, a + da, b + db, self.signed) {
                    least = now;
                    best = Some((a + da, b + db));
                }
            }
            let Some((a, b)) = best else { break };
            (found.q[e][c], found.q[f][c]) = (a, b);
            changed = true;
        }
        changed
    }
}

/// The texels of a subset, gathered by their levels: their number and their sum, about a value near them all.
struct Levels {
    near: f32,
    n: [f32; 16],
    sum: [f32; 16],
}

impl Levels {
    fn new(h: &[f32; 16], mask: u16, index: &[u8; 16]) -> Self {
        let near = h[mask.trailing_zeros() as usize & 15];
        let (mut n, mut sum) = ([0.0; 16], [0.0; 16]);
        for i in members(mask) {
            n[index[i] as usize & 15] += 1.0;
            sum[index[i] as usize & 15] += h[i] - near;
        }
        Self { near, n, sum }
    }

    /// The squared error of a ramp, but for what all ramps have in common.
    fn error(&self, ramp: &[f32; 16]) -> f32 {
        let terms: [f32; 16] = std::array::from_fn(|k| {
            let p = ramp[k] - self.near;
            p * (self.n[k] * p - 2.0 * self.sum[k])
        });
        let pairs: [f32; 4] =
            std::array::from_fn(|k| (terms[k] + terms[k + 4]) + (terms[k + 8] + terms[k + 12]));
        (pairs[0] + pairs[1]) + (pairs[2] + pairs[3])
    }
}

/// The stored number whose value is nearest.
fn quantise(v: f32, precision: u32, signed: bool) -> i32 {
    let step = f32::from(2u8).powi(16 - precision as i32);
    let guess = if precision >= 15 { v.round() as i32 } else { (v / step).floor() as i32 };
    let (low, high) = range(precision, signed);
    let distance = |q: i32| (unquantise(q, precision, signed) as f32 - v).abs();
    let near = (guess - 1..=guess + 1).map(|q| q.clamp(low, high));
    near.min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap_or(0)
}

/// What is stored without a difference.
fn range(precision: u32, signed: bool) -> (i32, i32) {
    if signed { (1 - (1 << (precision - 1)), (1 << (precision - 1)) - 1) } else { (0, (1 << precision) - 1) }
}

/// `q` as near as the mode's differences allow to the first endpoint's.
fn near(m: &Mode, first: i32, q: i32, c: usize) -> i32 {
    m.delta.map_or(q, |d| q.clamp(first - (1 << (d[c] - 1)), first + (1 << (d[c] - 1)) - 1))
}

impl Found {
    fn mask(&self, subset: usize) -> u16 {
        match (MODES[self.mode].subsets, subset) {
            (1, _) => u16::MAX,
            (_, 0) => !SHAPES[self.shape],
            _ => SHAPES[self.shape],
        }
    }

    fn anchor(&self, subset: usize) -> usize {
        if subset == 0 { 0 } else { ANCHORS[self.shape] }
    }

    /// May channel `c` of endpoints `e` and `e` + 1 be `a` and `b`?
    fn allows(&self, c: usize, e: usize, a: i32, b: i32, signed: bool) -> bool {
        let m = &MODES[self.mode];
        let (low, high) = range(m.precision, signed);
        if a.min(b) < low || a.max(b) > high {
            return false;
        }
        let first = if e == 0 { a } else { self.q[0][c] };
        let mut others = (1..2 * m.subsets).map(|i| match i {
            i if i == e => a,
            i if i == e + 1 => b,
            i => self.q[i][c],
        });
        others.all(|q| near(m, first, q, c) == q)
    }

    fn packed(&self) -> u128 {
        let m = &MODES[self.mode];
        let mut out = u128::from(m.code);
        let stored = |e: usize, c: usize| {
            if e > 0 && m.delta.is_some() { self.q[e][c] - self.q[0][c] } else { self.q[e][c] }
        };
        for (at, &(e, c, bit)) in m.bits.iter().enumerate() {
            let one = stored(e.into(), c.into()) >> bit & 1;
            out |= (one as u128) << (m.code_bits as usize + at);
        }
        let mut at = 65;
        if m.subsets == 2 {
            out |= (self.shape as u128) << 77;
            at = 82;
        }
        for (i, index) in self.index.iter().enumerate() {
            let anchor = (0..m.subsets).any(|s| self.anchor(s) == i);
            out |= u128::from(*index) << at;
            at += index_bits(m.subsets) - u32::from(anchor);
        }
        out
    }
}
