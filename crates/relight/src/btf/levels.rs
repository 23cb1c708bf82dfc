//! The coarser levels of a patch that repeats, and the texels that a square of it covers.

/// A level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Level {
    width: usize,
    height: usize,
    /// Number of its first texel.
    first: usize,
}

/// Texels of all levels, numbered one after the other, the finest first, rows from the top. Each level halves
/// the sides, rounded down, to 1 at least; its texels are area averages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Levels(Vec<Level>);

/// A texel and its weight.
pub type Tap = (usize, f32);

impl Levels {
    /// The levels of a patch.
    pub fn new(width: usize, height: usize) -> Self {
        let (mut width, mut height, mut first) = (width.max(1), height.max(1), 0);
        let mut all = Vec::new();
        loop {
            all.push(Level { width, height, first });
            if (width, height) == (1, 1) {
                return Self(all);
            }
            first += width * height;
            (width, height) = ((width / 2).max(1), (height / 2).max(1));
        }
    }

    /// Number of levels.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Never: there is always a level.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Texels of a level.
    pub fn texels(&self, level: usize) -> usize {
        self.0[level].width * self.0[level].height
    }

    /// Texels a row, rows, and the number of the first texel of a level.
    pub fn level(&self, level: usize) -> (usize, usize, usize) {
        let l = self.0[level];
        (l.width, l.height, l.first)
    }

    /// Texels of all levels.
    pub fn all(&self) -> usize {
        self.0.iter().map(|l| l.width * l.height).sum()
    }

    /// The texels of the next finer level that texel `k` of a coarser one is the mean of; their weights sum
    /// to 1.
    pub fn covers(&self, level: usize, k: usize) -> Vec<Tap> {
        let (fine, coarse) = (self.0[level - 1], self.0[level]);
        let spans = |i: usize, n: usize, m: usize| {
            let (from, to) = (i as f64 * n as f64 / m as f64, (i + 1) as f64 * n as f64 / m as f64);
            let weigh = move |a: usize| (((a + 1) as f64).min(to) - (a as f64).max(from)) / (to - from);
            (from as usize..(to.ceil() as usize).min(n)).map(move |a| (a, weigh(a)))
        };
        let mut out = Vec::new();
        for (j, v) in spans(k / coarse.width, fine.height, coarse.height) {
            for (i, u) in spans(k % coarse.width, fine.width, coarse.width) {
                out.push((fine.first + j * fine.width + i, (u * v) as f32));
            }
        }
        out
    }

    /// The texels, with weights, for a square of side `footprint` at `uv` (v downwards, both in patches):
    /// bilinear in the two nearest levels. The coordinates repeat.
    pub fn taps(&self, uv: [f32; 2], footprint: f32) -> [Tap; 8] {
        let finest = self.0[0].width.max(self.0[0].height) as f32;
        let last = (self.0.len() - 1) as f32;
        // False for NaN too.
        let side = if footprint * finest > 1.0 { footprint * finest } else { 1.0 };
        let lod = side.log2().clamp(0.0, last);
        let (low, t) = (lod as usize, lod.fract());
        let high = (low + 1).min(self.0.len() - 1);
        let (a, b) = (self.bilinear(low, uv, 1.0 - t), self.bilinear(high, uv, t));
        [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]
    }

    fn bilinear(&self, level: usize, [u, v]: [f32; 2], weight: f32) -> [Tap; 4] {
        let l = self.0[level];
        let [(i, fx), (j, fy)] = [(u, l.width), (v, l.height)].map(|(u, n)| {
            let x = (u - u.floor()) * n as f32 - 0.5;
            let i = x.floor();
            ((i + n as f32) as usize % n, x - i)
        });
        let (i1, j1) = ((i + 1) % l.width, (j + 1) % l.height);
        let at = |i: usize, j: usize| l.first + j * l.width + i;
        [
            (at(i, j), weight * (1.0 - fx) * (1.0 - fy)),
            (at(i1, j), weight * fx * (1.0 - fy)),
            (at(i, j1), weight * (1.0 - fx) * fy),
            (at(i1, j1), weight * fx * fy),
        ]
    }
}
