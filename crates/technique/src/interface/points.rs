//! Batches of surface points, structure of arrays.

use super::{PointChart, PointLobe};
use glam::{Vec2, Vec3};
use steradian_parallel::prelude::*;

/// Points of a block that one core shades: several registers, and few enough that points which see a sun,
/// and take far longer than others, fall into different blocks.
const BLOCK: usize = 32;

/// A batch of surface points in world space; unit vectors point away from the surface. All slices have one
/// length, except those of `p`, `uv`, `chart`, `site` and `lobe`, which may be empty.
#[derive(Debug, Clone, Copy, Default)]
pub struct Points<'a> {
    /// Normals.
    pub n: [&'a [f32]; 3],
    /// Tangents; techniques without anisotropy ignore them.
    pub t: [&'a [f32]; 3],
    /// Directions to the viewer.
    pub wo: [&'a [f32]; 3],
    /// Positions, metres.
    pub p: [&'a [f32]; 3],
    /// Texture coordinates.
    pub uv: [&'a [f32]; 2],
    /// How texture coordinates lie on the surface, in the order of [`PointChart::to_array`]; where empty,
    /// along `n` and `t`.
    pub chart: [&'a [f32]; PointChart::LEN],
    /// Where transfer data were baked.
    pub site: SitesAt<'a>,
    /// Each point's own lobe, as [`PointLobe::to_array`] orders its numbers; empty: the material's. Read by
    /// bakes that [`crate::AnyBake::varies`]; needs `t`.
    pub lobe: [&'a [f32]; PointLobe::LEN],
}

/// Positions of the points among the sites of a bake: three site indices and two barycentric weights a point
/// (the third is 1 − u − v). A vertex is its own index three times.
#[derive(Debug, Clone, Copy, Default)]
pub struct SitesAt<'a> {
    /// Site indices of the three corners.
    pub index: [&'a [u32]; 3],
    /// Weights of the second and third corner.
    pub weight: [&'a [f32]; 2],
}

impl Points<'_> {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.n[0].len()
    }

    /// No points at all?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Has every point its own lobe?
    pub fn has_lobes(&self) -> bool {
        !self.lobe[0].is_empty()
    }

    /// Do all slices that must be of equal length have it?
    pub fn is_consistent(&self) -> bool {
        let len = self.len();
        let full = |s: &[f32]| s.len() == len;
        let optional = |s: &[f32]| s.is_empty() || s.len() == len;
        self.n.iter().chain(&self.wo).all(|s| full(s))
            && self
                .t
                .iter()
                .chain(&self.p)
                .chain(&self.uv)
                .chain(&self.chart)
                .chain(&self.site.weight)
                .all(|s| optional(s))
            && self.site.index.iter().all(|s| s.is_empty() || s.len() == len)
            && (self.lobe.iter().all(|s| s.is_empty()) || self.lobe.iter().chain(&self.t).all(|s| full(s)))
    }
}

/// Points that own their arrays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointsBuf {
    /// Normals.
    pub n: [Vec<f32>; 3],
    /// Tangents.
    pub t: [Vec<f32>; 3],
    /// Directions to the viewer.
    pub wo: [Vec<f32>; 3],
    /// Positions.
    pub p: [Vec<f32>; 3],
    /// Lobes: all points have one, or none.
    pub lobe: [Vec<f32>; PointLobe::LEN],
    /// Texture coordinates: all points have some, or none.
    pub uv: [Vec<f32>; 2],
    /// Charts: all points have one, or none.
    pub chart: [Vec<f32>; PointChart::LEN],
    /// Sites of the three corners: all points have some, or none.
    pub corners: [Vec<u32>; 3],
    /// Weights of the second and third corner, as many as there are corners.
    pub weights: [Vec<f32>; 2],
}

impl PointsBuf {
    /// Room for `n` points.
    pub fn with_capacity(n: usize) -> Self {
        let v = || std::array::from_fn(|_| Vec::with_capacity(n));
        Self { n: v(), t: v(), wo: v(), p: v(), ..Self::default() }
    }

    /// Appends a point.
    pub fn push(&mut self, n: Vec3, t: Vec3, wo: Vec3, p: Vec3) {
        for (to, v) in [(&mut self.n, n), (&mut self.t, t), (&mut self.wo, wo), (&mut self.p, p)] {
            for (k, x) in v.to_array().into_iter().enumerate() {
                to[k].push(x);
            }
        }
        if !self.lobe[0].is_empty() {
            self.lobe.iter_mut().zip(PointLobe::PLAIN.to_array()).for_each(|(to, x)| to.push(x));
        }
    }

    /// Appends a point with a lobe of its own; earlier points without one get the material's lobe.
    pub fn push_lobe(&mut self, [n, t, wo, p]: [Vec3; 4], lobe: PointLobe) {
        self.push(n, t, wo, p);
        let (len, plain) = (self.len(), PointLobe::PLAIN.to_array());
        for (k, x) in lobe.to_array().into_iter().enumerate() {
            self.lobe[k].resize(len, plain[k]);
            self.lobe[k][len - 1] = x;
        }
    }

    /// Says where the point pushed last lies on its mesh: texture coordinates, the triangle's three vertices,
    /// and the barycentric weights of the second and third. Earlier points without these data get zeros.
    pub fn locate(&mut self, uv: Vec2, corners: [u32; 3], weights: [f32; 2]) {
        let Some(last) = self.len().checked_sub(1) else { return };
        for (to, x) in
            self.uv.iter_mut().chain(&mut self.weights).zip(uv.to_array().into_iter().chain(weights))
        {
            to.resize(last, 0.0);
            to.push(x);
        }
        for (to, x) in self.corners.iter_mut().zip(corners) {
            to.resize(last, 0);
            to.push(x);
        }
    }

    /// Says how texture coordinates lie on the surface at the point pushed last; earlier points without these
    /// data get zeros.
    pub fn chart(&mut self, chart: PointChart) {
        let Some(last) = self.len().checked_sub(1) else { return };
        for (to, x) in self.chart.iter_mut().zip(chart.to_array()) {
            to.resize(last, 0.0);
            to.push(x);
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.n[0].len()
    }

    /// No points at all?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Forgets the points and keeps the memory.
    pub fn clear(&mut self) {
        for v in [&mut self.n, &mut self.t, &mut self.wo, &mut self.p] {
            v.iter_mut().for_each(Vec::clear);
        }
        self.lobe
            .iter_mut()
            .chain(&mut self.uv)
            .chain(&mut self.chart)
            .chain(&mut self.weights)
            .for_each(Vec::clear);
        self.corners.iter_mut().for_each(Vec::clear);
    }

    /// The batch of all points.
    pub fn as_points(&self) -> Points<'_> {
        self.slice(0..self.len())
    }

    /// Radiance of the points as `shade` writes it, in blocks on all cores: a point shades to the same bits
    /// in every batch.
    pub fn shaded<E: Send>(
        &self,
        shade: &(dyn Fn(&Points<'_>, &mut Radiance<'_>) -> Result<(), E> + Sync),
    ) -> Result<Vec<[f32; 3]>, E> {
        let block = |k: usize| {
            let q = self.slice(k * BLOCK..(k + 1) * BLOCK);
            let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
            shade(&q, &mut Radiance::of(&mut rgb))?;
            Ok((0..q.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]]).collect::<Vec<_>>())
        };
        let blocks: Vec<_> =
            (0..self.len().div_ceil(BLOCK)).into_par_iter().map(block).collect::<Result<_, E>>()?;
        Ok(blocks.concat())
    }

    /// The points in `range`, clamped to the batch.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Points<'_> {
        let end = range.end.min(self.len());
        let start = range.start.min(end);
        let view = |v: &'_ [Vec<f32>; 3]| -> [std::ops::Range<usize>; 3] {
            std::array::from_fn(|k| if v[k].is_empty() { 0..0 } else { start..end })
        };
        fn cut(v: &[Vec<f32>; 3], r: [std::ops::Range<usize>; 3]) -> [&[f32]; 3] {
            let [a, b, c] = r;
            [&v[0][a], &v[1][b], &v[2][c]]
        }
        Points {
            n: cut(&self.n, view(&self.n)),
            t: cut(&self.t, view(&self.t)),
            wo: cut(&self.wo, view(&self.wo)),
            p: cut(&self.p, view(&self.p)),
            lobe: self.lobe.each_ref().map(|v| v.get(start..end).unwrap_or_default()),
            uv: self.uv.each_ref().map(|v| v.get(start..end).unwrap_or_default()),
            chart: self.chart.each_ref().map(|v| v.get(start..end).unwrap_or_default()),
            site: SitesAt {
                index: self.corners.each_ref().map(|v| v.get(start..end).unwrap_or_default()),
                weight: self.weights.each_ref().map(|v| v.get(start..end).unwrap_or_default()),
            },
        }
    }
}

/// Outgoing radiance of a batch, W sr⁻¹ m⁻²: written, not added to.
#[derive(Debug)]
pub struct Radiance<'a> {
    /// Red, green, blue; each as long as the batch.
    pub rgb: [&'a mut [f32]; 3],
}

impl<'a> Radiance<'a> {
    /// Radiance that is written to these planes.
    pub fn of(rgb: &'a mut [Vec<f32>; 3]) -> Self {
        Self { rgb: rgb.each_mut().map(Vec::as_mut_slice) }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.rgb[0].len()
    }

    /// No points at all?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
