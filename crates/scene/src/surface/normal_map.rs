//! Normal maps that do not alias: every level holds the mean of the normals under a texel and their
//! covariance.
//!
//! Schilling (1997), *Towards Real-Time Photorealistic Rendering*; Kautz's course notes (2006), "Environment
//! Map Anti-Aliasing"; Olano & Baker (2010), *LEAN Mapping*, which filters moments of slopes. Here the
//! moments are those of the unit normal's x and y, which are bounded and to which the rotation of the
//! reflection by a tilted normal is proportional:
//!
//! > n̄ = E\[n\],  Σ = E\[(x, y)(x, y)ᵀ\] − (x̄, ȳ)(x̄, ȳ)ᵀ
//!
//! Both are area averages, so they filter linearly; at the finest level Σ = 0, and the map is the ordinary
//! one.

use super::{Texture, Wrap};
use glam::{Vec2, Vec3};

/// A tangent-space normal map: x along the tangent, y along the bitangent, z outwards.
#[derive(Debug, Clone)]
pub struct NormalMap {
    /// E[n].
    mean: Texture,
    /// Σ: xx, xy, yy.
    spread: Texture,
}

/// Average of a normal map over a square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normals {
    /// Mean normal, unit.
    pub mean: Vec3,
    /// Covariance of the normals' x and y: xx, xy, yy.
    pub spread: [f32; 3],
}

impl NormalMap {
    /// The map of `width`·`height` values in 0 … 1 per plane, rows from the top, as glTF 2.0 (3.9.3) reads
    /// them: n = normalize((2c − 1) · (scale, scale, 1)). `None` where it is empty or a plane is too short.
    pub fn new(width: usize, height: usize, planes: &[Vec<f32>; 3], scale: f32) -> Option<Self> {
        let n = width.checked_mul(height)?;
        if planes.iter().any(|p| p.len() < n) {
            return None;
        }
        let normal = |i: usize| {
            let c = Vec3::from(planes.each_ref().map(|p| 2.0 * p[i] - 1.0));
            (c * Vec3::new(scale, scale, 1.0)).try_normalize().unwrap_or(Vec3::Z)
        };
        Self::from_normals(width, height, &(0..n).map(normal).collect::<Vec<_>>())
    }

    /// The map of unit normals, rows from the top. `None` where there are not `width`·`height`.
    pub fn from_normals(width: usize, height: usize, normals: &[Vec3]) -> Option<Self> {
        if normals.len() != width.checked_mul(height)? {
            return None;
        }
        let texture = |f: &dyn Fn(&Vec3) -> [f32; 3]| {
            let values: Vec<[f32; 3]> = normals.iter().map(f).collect();
            Texture::new(width, height, &[0, 1, 2].map(|k| values.iter().map(|v| v[k]).collect()))
        };
        let mean = texture(&|n| n.to_array())?;
        let moments = texture(&|n| [n.x * n.x, n.x * n.y, n.y * n.y])?;
        let spread = moments.zip(&mean, |m, n| {
            let (xx, yy) = ((m[0] - n[0] * n[0]).max(0.0), (m[2] - n[1] * n[1]).max(0.0));
            // Rounding must leave a covariance.
            let most = (xx * yy).sqrt();
            [xx, (m[1] - n[0] * n[1]).clamp(-most, most), yy]
        });
        Some(Self { mean, spread })
    }

    /// The map of heights (any unit) of texels one such unit apart, times `scale`; repeats.
    pub fn from_heights(width: usize, height: usize, heights: &[f32], scale: f32) -> Option<Self> {
        if heights.len() != width.checked_mul(height)? {
            return None;
        }
        let at = |x: usize, y: usize| heights[y % height * width + x % width];
        let normal = |i: usize| {
            let (x, y) = (i % width, i / width);
            let slope = |a: f32, b: f32| 0.5 * scale * (b - a);
            let dx = slope(at(x + width - 1, y), at(x + 1, y));
            // v runs down, the bitangent up.
            let dy = slope(at(x, y + 1), at(x, y + height - 1));
            Vec3::new(-dx, -dy, 1.0).normalize()
        };
        Self::from_normals(width, height, &(0..width * height).map(normal).collect::<Vec<_>>())
    }

    /// The map with these wrap modes in u and v.
    pub fn with_wrap(self, wrap: [Wrap; 2]) -> Self {
        Self { mean: self.mean.with_wrap(wrap), spread: self.spread.with_wrap(wrap) }
    }

    /// Mean normals, not normalised.
    pub fn mean(&self) -> &Texture {
        &self.mean
    }

    /// Covariances: xx, xy, yy.
    pub fn spread(&self) -> &Texture {
        &self.spread
    }

    /// The average over a square of side `footprint` (in texture coordinates) at `uv`.
    pub fn sample(&self, uv: Vec2, footprint: f32) -> Normals {
        let mean = Vec3::from(self.mean.sample(uv.x, uv.y, footprint));
        Normals {
            mean: mean.try_normalize().unwrap_or(Vec3::Z),
            spread: self.spread.sample(uv.x, uv.y, footprint),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coarsest_level_has_the_moments_of_the_whole() {
        let n = 16;
        let at = |i: usize| {
            let (u, v) = ((i % n) as f32 / n as f32, (i / n) as f32 / n as f32);
            let (a, b) = ((6.0 * u).sin(), (4.0 * v).cos());
            Vec3::new(0.4 * a, 0.2 * b + 0.1 * a, 1.0).normalize()
        };
        let normals: Vec<Vec3> = (0..n * n).map(at).collect();
        let map = NormalMap::from_normals(n, n, &normals).expect("as many as it says");
        let whole = map.sample(Vec2::splat(0.5), 1.0);
        let mean = |f: &dyn Fn(&Vec3) -> f32| normals.iter().map(f).sum::<f32>() / (n * n) as f32;
        let (x, y) = (mean(&|m| m.x), mean(&|m| m.y));
        for (k, want) in
            [mean(&|m| m.x * m.x) - x * x, mean(&|m| m.x * m.y) - x * y, mean(&|m| m.y * m.y) - y * y]
                .into_iter()
                .enumerate()
        {
            assert!((whole.spread[k] - want).abs() < 1e-5, "{k}: {} {want}", whole.spread[k]);
        }
        assert_eq!(map.sample(Vec2::new(0.3, 0.7), 0.0).spread, [0.0; 3]);
    }

    #[test]
    fn files_and_heights_mean_what_gltf_says() {
        // (1, ½, ½) leans to the tangent; scale 0 flattens; heights that rise with u lean against it.
        let planes = [vec![1.0], vec![0.5], vec![0.5]];
        let at = |m: Option<NormalMap>| m.map(|m| m.sample(Vec2::ZERO, 0.0).mean);
        assert_eq!(at(NormalMap::new(1, 1, &planes, 1.0)), Some(Vec3::X));
        assert_eq!(at(NormalMap::new(1, 1, &planes, 0.0)), Some(Vec3::Z));
        let ramp: Vec<f32> = (0..64).map(|i| (i % 8) as f32).collect();
        let m = NormalMap::from_heights(8, 8, &ramp, 1.0).expect("64 heights");
        let n = m.sample(Vec2::new(0.5, 0.5), 0.0).mean;
        assert!((n - Vec3::new(-0.5f32.sqrt(), 0.0, 0.5f32.sqrt())).length() < 1e-6, "{n}");
        assert!(NormalMap::new(2, 2, &planes, 1.0).is_none());
    }
}
