//! Lines through the colours of a subset, before anything is rounded.

/// A colour on the scale of interpolation.
pub(super) type Point = [f32; 3];

/// 1, r, g, b, rr, rg, rb, gg, gb, bb, and two places that make twelve of them.
type Sums = [f32; 12];

/// The texels of a block on the scale of interpolation, and sums that subsets share.
pub(super) struct Cloud {
    pub x: [Point; 16],
    /// Of each texel, about the block's mean.
    moments: [Sums; 16],
    mean: Point,
    limit: (f32, f32),
}

/// Variance along the main axis and across it, times the number of texels.
#[derive(Clone, Copy, Default)]
pub(super) struct Spread {
    pub along: f32,
    pub across: f32,
}

impl Cloud {
    pub fn new(x: [Point; 16], signed: bool) -> Self {
        let mean = std::array::from_fn(|c| x.iter().map(|p| p[c]).sum::<f32>() / 16.0);
        let moments = x.map(|p| {
            let [r, g, b]: Point = std::array::from_fn(|c| p[c] - mean[c]);
            [1.0, r, g, b, r * r, r * g, r * b, g * g, g * b, b * b, 0.0, 0.0]
        });
        Self { x, moments, mean, limit: if signed { (-32767.0, 32767.0) } else { (0.0, 65535.0) } }
    }

    /// Sums over the texels of `mask`.
    fn sums(&self, mask: u16) -> Sums {
        let mut s = [0.0; 12];
        for (i, m) in self.moments.iter().enumerate() {
            let w = f32::from(mask >> i & 1);
            s.iter_mut().zip(m).for_each(|(s, m)| *s += w * m);
        }
        s
    }

    /// How far the texels of both subsets of every shape are from two lines.
    pub fn spreads(&self, shapes: &[u16; 32]) -> [[Spread; 2]; 32] {
        let all = self.sums(u16::MAX);
        shapes.map(|shape| {
            let one = self.sums(shape);
            [spread(&std::array::from_fn(|i| all[i] - one[i])), spread(&one)]
        })
    }

    /// The ends of the best line through the texels of `mask`, the outermost projections, and its direction.
    pub fn line(&self, mask: u16) -> (Point, Point) {
        let a = Axis::of(&self.sums(mask));
        let center: Point = std::array::from_fn(|c| self.mean[c] + a.mean[c]);
        let (mut low, mut high) = (0.0f32, 0.0f32);
        for i in members(mask) {
            let t: f32 = (0..3).map(|c| (self.x[i][c] - center[c]) * a.direction[c]).sum();
            (low, high) = (low.min(t), high.max(t));
        }
        let at = |t: f32| std::array::from_fn(|c| self.within(center[c] + t * a.direction[c]));
        (at(low), at(high))
    }

    /// The ends that fit best when each texel takes the nearest of the `levels` points between `a` and `b`.
    pub fn refined(&self, mask: u16, (a, b): (Point, Point), levels: usize) -> (Point, Point) {
        let steps = (levels - 1) as f32;
        let d: Point = std::array::from_fn(|c| b[c] - a[c]);
        let length: f32 = d.iter().map(|d| d * d).sum();
        if length < 1.0 {
            return (a, b);
        }
        let (mut ss, mut st, mut tt) = (0.0f32, 0.0f32, 0.0f32);
        let (mut sx, mut tx) = ([0.0f32; 3], [0.0f32; 3]);
        for i in members(mask) {
            let x = &self.x[i];
            let t = (0..3).map(|c| (x[c] - a[c]) * d[c]).sum::<f32>() / length;
            let t = (t.clamp(0.0, 1.0) * steps).round() / steps;
            let s = 1.0 - t;
            (ss, st, tt) = (ss + s * s, st + s * t, tt + t * t);
            for c in 0..3 {
                sx[c] += s * x[c];
                tx[c] += t * x[c];
            }
        }
        let det = ss * tt - st * st;
        if det < 1e-4 {
            return (a, b);
        }
        let end = |p: f32, q: f32, from: &[f32; 3], other: &[f32; 3]| -> Point {
            std::array::from_fn(|c| self.within((p * from[c] - q * other[c]) / det))
        };
        (end(tt, st, &sx, &tx), end(ss, st, &tx, &sx))
    }

    fn within(&self, v: f32) -> f32 {
        v.clamp(self.limit.0, self.limit.1)
    }
}

/// The texels of a mask.
pub(super) fn members(mask: u16) -> impl Iterator<Item = usize> {
    (0..16).filter(move |i| mask >> i & 1 == 1)
}

/// Mean and covariance rr, rg, rb, gg, gb, bb, times the number of texels.
fn covariance(s: &Sums) -> (Point, [f32; 6]) {
    let n = s[0].max(1.0);
    let mean: Point = [s[1] / n, s[2] / n, s[3] / n];
    let k = [
        s[4] - s[1] * mean[0],
        s[5] - s[1] * mean[1],
        s[6] - s[1] * mean[2],
        s[7] - s[2] * mean[1],
        s[8] - s[2] * mean[2],
        s[9] - s[3] * mean[2],
    ];
    (mean, k)
}

fn trace(k: &[f32; 6]) -> f32 {
    k[0] + k[3] + k[5]
}

/// The trace of the product of two symmetric matrices.
fn product(a: &[f32; 6], b: &[f32; 6]) -> f32 {
    a[0] * b[0] + a[3] * b[3] + a[5] * b[5] + 2.0 * (a[1] * b[1] + a[2] * b[2] + a[4] * b[4])
}

/// With λ₁ estimated by tr K³/tr K², which is exact on a line and low by λ₂²/λ₁ near one.
fn spread(s: &Sums) -> Spread {
    let (_, k) = covariance(s);
    let square = squared(&k);
    let along = product(&k, &square) / trace(&square).max(1e-20);
    Spread { along, across: (trace(&k) - along).max(0.0) }
}

struct Axis {
    mean: Point,
    direction: Point,
}

impl Axis {
    /// Of the sums of a subset.
    fn of(s: &Sums) -> Self {
        let (mean, k) = covariance(s);
        let size = trace(&k);
        if size < 1e-3 {
            return Self { mean, direction: [0.0; 3] };
        }
        // Powers of the matrix turn every column towards the main axis: the sixteenth is enough to start
        // from.
        let mut p = k.map(|v| v / size);
        for _ in 0..4 {
            p = squared(&p);
            let t = trace(&p).max(1e-30);
            p = p.map(|v| v / t);
        }
        let columns = [[p[0], p[1], p[2]], [p[1], p[3], p[4]], [p[2], p[4], p[5]]];
        let size = |v: &Point| v.iter().map(|v| v * v).sum::<f32>();
        let mut best = columns[0];
        for c in &columns[1..] {
            if size(c) > size(&best) {
                best = *c;
            }
        }
        let length = size(&best).sqrt().max(1e-30);
        Self { mean, direction: best.map(|v| v / length) }
    }
}

/// The square of a symmetric matrix.
fn squared(k: &[f32; 6]) -> [f32; 6] {
    let [a, b, c, d, e, f] = *k;
    [
        a * a + b * b + c * c,
        a * b + b * d + c * e,
        a * c + b * e + c * f,
        b * b + d * d + e * e,
        b * c + d * e + e * f,
        c * c + e * e + f * f,
    ]
}
