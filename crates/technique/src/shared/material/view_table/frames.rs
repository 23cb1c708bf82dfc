//! Frames of the sites of a geometry, where light or view stands still.

use super::vectors::{SIDE, read, tangents};
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Geometry, Part, Sites};
use glam::Vec3;
use steradian_simd::{Arch, Kernel};

/// Normals, tangents and positions of sites. Tangents are unit vectors perpendicular to the normals; where a
/// mesh has none, those of the conventional frame about a normal are used.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SiteFrames {
    pub(super) n: [Vec<f32>; 3],
    pub(super) t: [Vec<f32>; 3],
    pub(super) p: [Vec<f32>; 3],
}

fn planes(v: impl Iterator<Item = Vec3>) -> [Vec<f32>; 3] {
    let mut out: [Vec<f32>; 3] = Default::default();
    v.for_each(|v| out.iter_mut().zip(v.to_array()).for_each(|(o, x)| o.push(x)));
    out
}

impl SiteFrames {
    /// The frames of a geometry's sites.
    pub fn new(slug: &'static str, g: &Geometry) -> Result<Self, BakeError> {
        let sites = crate::shared::geometry::transport::sites(slug, g)?;
        let none = vec![Vec3::ZERO; sites.len()];
        let along = match &g.sites {
            Sites::Vertices | Sites::Slots(_) if g.mesh.tangents.len() == sites.len() => {
                g.mesh.tangents.iter().map(|t| t.truncate()).collect()
            }
            _ => none,
        };
        let mut frames = Self {
            n: planes(sites.iter().map(|s| s.n)),
            t: planes(along.into_iter()),
            p: planes(sites.iter().map(|s| s.p)),
        };
        steradian_simd::run(Complete(&mut frames));
        Ok(frames)
    }

    /// Number of sites.
    pub fn len(&self) -> usize {
        self.n[0].len()
    }

    /// Are there none?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Normal and tangent of a site.
    pub fn at(&self, k: usize) -> [Vec3; 2] {
        [&self.n, &self.t].map(|v| Vec3::new(v[0][k], v[1][k], v[2][k]))
    }

    /// Position of a site, metres.
    pub fn position(&self, k: usize) -> Vec3 {
        let p = &self.p;
        Vec3::new(p[0][k], p[1][k], p[2][k])
    }

    /// Normals and tangents, six numbers a site, for GPUs.
    pub fn numbers(&self) -> Vec<f32> {
        (0..self.len()).flat_map(|k| self.at(k).map(|v| v.to_array())).flatten().collect()
    }
}

/// Makes tangents of what lies along them.
struct Complete<'a>(&'a mut SiteFrames);

impl Kernel for Complete<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let (n, t, len) = (&self.0.n, &mut self.0.t, self.0.n[0].len());
        for first in (0..len).step_by(SIDE) {
            let normals = read::<A>([&n[0], &n[1], &n[2]], first, len);
            let whole = tangents::<A>(&normals, &read::<A>([&t[0], &t[1], &t[2]], first, len));
            let of = SIDE.min(len - first);
            for k in 0..3 {
                t[k][first..first + of].copy_from_slice(&whole[k][..of]);
            }
        }
    }
}

impl Part for SiteFrames {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let all = self.n.iter().chain(&self.t).chain(&self.p).flatten().copied().collect();
        put_f32(to, format!("{prefix}.frames"), vec![9, self.len()], all);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.frames");
        let (shape, v) = get_f32(from, &name, 2)?;
        if shape[0] != 9 {
            return Err(PartError::Unexpected(name));
        }
        let of = |first: usize| {
            std::array::from_fn(|k| v[(first + k) * shape[1]..(first + k + 1) * shape[1]].to_vec())
        };
        Ok(Self { n: of(0), t: of(3), p: of(6) })
    }

    fn bytes(&self) -> usize {
        36 * self.len()
    }
}
