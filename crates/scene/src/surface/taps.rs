//! The texels that a lookup of a texture mixes, for data that are decoded before they are averaged.

use super::Wrap;
use super::texture::columns;

/// A texel of a patch's levels and its weight.
pub type Tap = (usize, f32);

/// The levels of a texture as one list of texels: the finest first, rows from the top, each half as wide and
/// high as the one before it, down to one texel.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    levels: Vec<(usize, usize, usize)>,
    wrap: [Wrap; 2],
}

impl Patch {
    /// The levels of `width` · `height` texels; `None` where there are none, or more than memory addresses.
    pub fn new(width: usize, height: usize, wrap: [Wrap; 2]) -> Option<Self> {
        // All levels have less than twice the texels of the finest, plus those that are one texel wide.
        width.checked_mul(height)?.checked_mul(4).filter(|n| *n > 0)?;
        let (mut levels, mut first, mut size) = (Vec::new(), 0, (width, height));
        loop {
            levels.push((size.0, size.1, first));
            first += size.0 * size.1;
            if size == (1, 1) {
                return Some(Self { levels, wrap });
            }
            size = ((size.0 / 2).max(1), (size.1 / 2).max(1));
        }
    }

    /// Texels a row and rows of the finest level.
    pub fn size(&self) -> (usize, usize) {
        (self.levels[0].0, self.levels[0].1)
    }

    /// Wrap modes in u and v.
    pub fn wrap(&self) -> [Wrap; 2] {
        self.wrap
    }

    /// Number of levels.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// Texels of all levels.
    pub fn texels(&self) -> usize {
        self.levels.last().map_or(0, |l| l.2 + 1)
    }

    /// The texels that [`super::Texture::sample`] mixes, and their weights, which sum to 1: bilinear in the
    /// two nearest levels.
    #[inline]
    pub fn taps(&self, [u, v]: [f32; 2], footprint: f32) -> [Tap; 8] {
        let (width, height, _) = self.levels[0];
        let last = self.levels.len() - 1;
        let lod = (footprint * width.max(height) as f32).max(1.0).log2().clamp(0.0, last as f32);
        let (low, t) = (lod as usize, lod.fract());
        let mut out = [(0, 0.0); 8];
        for (four, (level, weight)) in out.chunks_exact_mut(4).zip([(low, 1.0 - t), ((low + 1).min(last), t)])
        {
            let (width, height, first) = self.levels[level];
            let (x0, x1, fx) = columns(u, width, self.wrap[0]);
            let (y0, y1, fy) = columns(v, height, self.wrap[1]);
            let at = |x: usize, y: usize| first + y * width + x;
            four[0] = (at(x0, y0), weight * (1.0 - fx) * (1.0 - fy));
            four[1] = (at(x1, y0), weight * fx * (1.0 - fy));
            four[2] = (at(x0, y1), weight * (1.0 - fx) * fy);
            four[3] = (at(x1, y1), weight * fx * fy);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::super::Texture;
    use super::*;

    /// Sums over the taps are what textures give, whatever the wrap mode and the footprint.
    #[test]
    fn taps_sum_to_the_textures_value() {
        for (w, h) in [(7, 5), (16, 2), (1, 9), (8, 8)] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                let p: Vec<f32> = (0..w * h).map(|k| ((k * 7) % 11) as f32).collect();
                let t = Texture::new(w, h, &[p.clone(), p.clone(), p]).unwrap().with_wrap([wrap; 2]);
                let all: Vec<f32> = t.levels().flat_map(|l| l.2.iter().map(|x| x[0])).collect();
                let patch = Patch::new(w, h, [wrap; 2]).unwrap();
                assert_eq!((patch.texels(), patch.levels()), (all.len(), t.levels().count()));
                for k in 0..40 {
                    let uv = [0.17 * k as f32 - 2.0, 3.0 - 0.23 * k as f32];
                    let footprint = 0.01 * (k * k) as f32;
                    let taps = patch.taps(uv, footprint);
                    let sum: f32 = taps.iter().map(|(i, w)| w * all[*i]).sum();
                    let want = t.sample(uv[0], uv[1], footprint)[0];
                    assert!((sum - want).abs() < 1e-5 * 11.0, "{w} {h} {wrap:?} {k}: {sum} {want}");
                }
            }
        }
        assert_eq!(Patch::new(0, 3, [Wrap::Repeat; 2]), None);
        assert_eq!(Patch::new(usize::MAX, 3, [Wrap::Repeat; 2]), None);
    }
}
