//! Textures on surfaces.

use super::Wrap;

/// One level of a texture, rows from the top.
#[derive(Debug, Clone)]
struct Level {
    width: usize,
    height: usize,
    texels: Vec<[f32; 3]>,
}

/// A linear RGB texture with its chain of box-filtered levels; coordinates repeat outside 0 … 1 unless
/// [`Texture::with_wrap`] says otherwise.
#[derive(Debug, Clone)]
pub struct Texture {
    levels: Vec<Level>,
    wrap: [Wrap; 2],
}

impl Texture {
    /// A texture of linear planes of `width`·`height` values, rows from the top. `None` where it is empty or
    /// a plane is too short.
    pub fn new(width: usize, height: usize, planes: &[Vec<f32>; 3]) -> Option<Self> {
        let n = width.checked_mul(height)?;
        if n == 0 || planes.iter().any(|p| p.len() < n) {
            return None;
        }
        let texels = (0..n).map(|i| [planes[0][i], planes[1][i], planes[2][i]]).collect();
        Some(Self { levels: chain(Level { width, height, texels }), wrap: [Wrap::Repeat; 2] })
    }

    /// One colour everywhere.
    pub fn constant(colour: [f32; 3]) -> Self {
        Self { levels: vec![Level { width: 1, height: 1, texels: vec![colour] }], wrap: [Wrap::Repeat; 2] }
    }

    /// Is every texel 1 in every channel, so that multiplying by it changes nothing?
    pub fn is_white(&self) -> bool {
        self.levels[0].texels.iter().all(|t| *t == [1.0; 3])
    }

    /// The mean of all texels.
    pub fn mean(&self) -> [f32; 3] {
        self.levels[self.levels.len() - 1].texels[0]
    }

    /// The texture of `f` of this one's value and `other`'s, at the resolution of the finer one, with this
    /// one's wrap mode; its levels are the means of its own texels.
    pub fn joined(&self, other: &Self, f: impl Fn([f32; 3], [f32; 3]) -> [f32; 3]) -> Self {
        let (a, b) = (self.size(), other.size());
        let (width, height) = (a.0.max(b.0), a.1.max(b.1));
        let texel = |i: usize| {
            let u = ((i % width) as f32 + 0.5) / width as f32;
            let v = ((i / width) as f32 + 0.5) / height as f32;
            f(self.sample(u, v, 0.0), other.sample(u, v, 0.0))
        };
        let texels = (0..width * height).map(texel).collect();
        // A texture of a single colour has no meaningful wrap mode.
        let wrap = if a == (1, 1) { other.wrap } else { self.wrap };
        Self { levels: chain(Level { width, height, texels }), wrap }
    }

    /// The texture with these wrap modes in u and v.
    pub fn with_wrap(mut self, wrap: [Wrap; 2]) -> Self {
        self.wrap = wrap;
        self
    }

    /// The texture whose texels are `f` of the texels of this one and of `other` at the same places; both
    /// have one size.
    pub fn zip(&self, other: &Self, f: impl Fn([f32; 3], [f32; 3]) -> [f32; 3]) -> Self {
        let level = |(a, b): (&Level, &Level)| Level {
            texels: a.texels.iter().zip(&b.texels).map(|(a, b)| f(*a, *b)).collect(),
            ..*a
        };
        Self { levels: self.levels.iter().zip(&other.levels).map(level).collect(), wrap: self.wrap }
    }

    /// Wrap modes in u and v.
    pub fn wrap(&self) -> [Wrap; 2] {
        self.wrap
    }

    /// Width and height of the finest level.
    pub fn size(&self) -> (usize, usize) {
        (self.levels[0].width, self.levels[0].height)
    }

    /// Width, height and texels of every level, the finest first.
    pub fn levels(&self) -> impl Iterator<Item = (usize, usize, &[[f32; 3]])> {
        self.levels.iter().map(|l| (l.width, l.height, l.texels.as_slice()))
    }

    /// The value at (u, v), v downwards, averaged over a square of side `footprint` in texture coordinates:
    /// bilinear in the two nearest levels.
    pub fn sample(&self, u: f32, v: f32, footprint: f32) -> [f32; 3] {
        let finest = self.levels[0].width.max(self.levels[0].height) as f32;
        let last = (self.levels.len() - 1) as f32;
        let lod = (footprint * finest).max(1.0).log2().clamp(0.0, last);
        let (low, t) = (lod as usize, lod.fract());
        let a = self.levels[low].bilinear(u, v, self.wrap);
        if t == 0.0 {
            return a;
        }
        let b = self.levels[low + 1].bilinear(u, v, self.wrap);
        std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
    }
}

/// A level and all that are coarser.
fn chain(finest: Level) -> Vec<Level> {
    let mut levels = vec![finest];
    while let Some(next) = levels.last().and_then(Level::half) {
        levels.push(next);
    }
    levels
}

impl Level {
    /// The next coarser level, each texel the area average of the finer ones under it; `None` at 1 × 1.
    fn half(&self) -> Option<Self> {
        if self.width == 1 && self.height == 1 {
            return None;
        }
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let (sx, sy) = (self.width as f32 / width as f32, self.height as f32 / height as f32);
        let texels = (0..width * height)
            .map(|i| self.average((i % width) as f32 * sx, (i / width) as f32 * sy, sx, sy))
            .collect();
        Some(Self { width, height, texels })
    }

    /// Mean over the box of corner (x, y) and size (w, h), in texels.
    fn average(&self, x: f32, y: f32, w: f32, h: f32) -> [f32; 3] {
        let overlap =
            |i: usize, from: f32, size: f32| ((i + 1) as f32).min(from + size) - (i as f32).max(from);
        let mut sum = [0.0; 3];
        for j in y as usize..((y + h).ceil() as usize).min(self.height) {
            for i in x as usize..((x + w).ceil() as usize).min(self.width) {
                let weight = overlap(i, x, w) * overlap(j, y, h) / (w * h);
                let c = self.texels[j * self.width + i];
                (0..3).for_each(|k| sum[k] += weight * c[k]);
            }
        }
        sum
    }

    fn bilinear(&self, u: f32, v: f32, wrap: [Wrap; 2]) -> [f32; 3] {
        let (x0, x1, fx) = columns(u, self.width, wrap[0]);
        let (y0, y1, fy) = columns(v, self.height, wrap[1]);
        let at = |x: usize, y: usize| self.texels[y * self.width + x];
        let (a, b, c, d) = (at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1));
        std::array::from_fn(|k| {
            let top = a[k] + (b[k] - a[k]) * fx;
            let bottom = c[k] + (d[k] - c[k]) * fx;
            top + (bottom - top) * fy
        })
    }
}

/// The two texels of `n` about coordinate `u`, and the weight of the second.
pub(super) fn columns(u: f32, n: usize, wrap: Wrap) -> (usize, usize, f32) {
    let u = if u.is_finite() { u } else { 0.0 };
    let folded = match wrap {
        Wrap::Repeat => u - u.floor(),
        // Two units are the period of mirrored copies.
        Wrap::Mirror => u - 2.0 * (0.5 * u).floor(),
        Wrap::Clamp => u.clamp(0.0, 1.0),
    };
    let x = folded * n as f32 - 0.5;
    let low = x.floor();
    let texel = |i: isize| {
        let n = n as isize;
        let i = match wrap {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Mirror => i.rem_euclid(2 * n).min(2 * n - 1 - i.rem_euclid(2 * n)),
            Wrap::Clamp => i.clamp(0, n - 1),
        };
        i as usize
    };
    (texel(low as isize), texel(low as isize + 1), x - low)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(w: usize, h: usize) -> Texture {
        let p: Vec<f32> = (0..w * h).map(|i| (i % w) as f32).collect();
        Texture::new(w, h, &[p.clone(), p.clone(), p]).unwrap()
    }

    #[test]
    fn every_level_keeps_the_mean_of_odd_sizes_too() {
        let t = ramp(7, 5);
        for l in &t.levels {
            let mean = l.texels.iter().map(|c| c[0]).sum::<f32>() / l.texels.len() as f32;
            assert!((mean - 3.0).abs() < 1e-5, "{} × {}: {mean}", l.width, l.height);
        }
    }

    #[test]
    fn joined_textures_have_the_finer_resolution_and_their_own_means() {
        let (a, b) = (ramp(4, 4), Texture::constant([2.0; 3]));
        let t = a.joined(&b, |x, y| [x[0] * y[0], x[0] * x[0], 1.0]);
        assert_eq!((t.size(), t.sample(0.625, 0.125, 0.0)), ((4, 4), [4.0, 4.0, 1.0]));
        assert_eq!(t.mean(), [3.0, 3.5, 1.0]);
        assert!(Texture::constant([1.0; 3]).is_white() && !a.is_white());
        assert_eq!(b.joined(&a, |x, y| [x[0], y[0], 0.0]).sample(0.875, 0.5, 0.0), [2.0, 3.0, 0.0]);
    }

    #[test]
    fn beyond_the_unit_square_lies_what_the_wrap_says() {
        let t = |w| ramp(4, 4).with_wrap([w; 2]);
        let at = |w, u: f32| t(w).sample(u, 0.5, 0.0)[0];
        assert_eq!((at(Wrap::Repeat, 1.125), at(Wrap::Repeat, -0.125)), (0.0, 3.0));
        assert_eq!((at(Wrap::Mirror, 1.125), at(Wrap::Mirror, -0.375)), (3.0, 1.0));
        assert_eq!((at(Wrap::Clamp, 7.0), at(Wrap::Clamp, -0.125)), (3.0, 0.0));
        assert_eq!((at(Wrap::Mirror, 1.0), at(Wrap::Clamp, 1.0), at(Wrap::Repeat, 1.0)), (3.0, 3.0, 1.5));
    }

    #[test]
    fn centres_return_texels_and_coordinates_repeat() {
        let t = ramp(8, 4);
        assert_eq!(t.sample(3.5 / 8.0, 0.125, 0.0)[0], 3.0);
        assert_eq!(t.sample(-4.5 / 8.0, 7.125, 0.0)[0], 3.0);
        assert!((t.sample(0.3, 0.4, 1.0)[0] - 3.5).abs() < 1e-5);
        assert!(t.sample(f32::NAN, f32::INFINITY, 0.0)[0].is_finite());
        assert!(Texture::new(2, 2, &[vec![], vec![], vec![]]).is_none());
    }
}
