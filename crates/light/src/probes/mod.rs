//! Incident light that varies over space: captured at points of a scene, interpolated between them (Kautz,
//! Sloan & Snyder 2002, *Fast, Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical Harmonics*,
//! section 4).

mod file;
mod weights;

pub use file::NoProbes;

use crate::Environment;
use glam::{DVec3, UVec3, Vec3};
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};

/// Most bands of a probe.
pub const MAX_BANDS: usize = 64;

/// Incident light at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Coefficients of incident radiance, W sr⁻¹ m⁻², over world axes.
    pub sh: ShRgb,
    /// The same as a lat-long image, where that was captured: it holds what the bands of `sh` do not.
    pub image: Option<SphereImage>,
}

/// Where the probes of a field are.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// The corners of a grid and what divides it evenly; x goes fastest, then y.
    Grid {
        /// The first probe and the last, metres.
        bounds: [DVec3; 2],
        /// Probes along x, y and z.
        size: UVec3,
    },
    /// Anywhere, metres.
    Points(Vec<DVec3>),
}

/// A light field.
#[derive(Debug, Clone, PartialEq)]
pub struct Probes {
    /// Where its probes are.
    pub places: Places,
    /// What each sees; `None` inside solids. All have the same bands, and all have an image or none.
    pub light: Vec<Option<Probe>>,
}

impl Places {
    /// Number of probes; `None` where it overflows.
    pub fn count(&self) -> Option<usize> {
        match self {
            Self::Grid { size, .. } => {
                size.to_array().iter().try_fold(1usize, |n, k| n.checked_mul(*k as usize))
            }
            Self::Points(p) => Some(p.len()),
        }
    }

    /// Where probe `k` is; along an axis with one probe of a grid, in the middle.
    pub fn position(&self, k: usize) -> DVec3 {
        match self {
            Self::Grid { bounds, size } => {
                let [nx, ny, nz] = size.to_array().map(|n| n.max(1) as usize);
                let at = [k % nx, k / nx % ny, k / (nx * ny)];
                let part = |i: usize, n: usize| if n == 1 { 0.5 } else { i as f64 / (n - 1) as f64 };
                let t = DVec3::new(part(at[0], nx), part(at[1], ny), part(at[2], nz));
                bounds[0] + (bounds[1] - bounds[0]) * t
            }
            Self::Points(p) => p[k],
        }
    }

    /// All positions.
    pub fn positions(&self) -> Vec<DVec3> {
        (0..self.count().unwrap_or(0)).map(|k| self.position(k)).collect()
    }
}

impl Probe {
    /// The light as an environment: the image, or one of 16 × 8 texels a band (64 × 32 at least), with
    /// harmonics added so that those of its texels, constant over their cells, are the probe's.
    pub fn environment(&self) -> Environment {
        let height = 32.max(8 * (self.sh.order + 1));
        let blank = || SphereImage::new(Layout::LatLong, 2 * height, height);
        let mut image = self.image.clone().unwrap_or_else(blank);
        // What a cell averages away is a small part of a band: each turn leaves that part of what was
        // missing.
        for _ in 0..5 {
            let mut missing = sh::project(&image, self.sh.order);
            let pairs = missing.c.iter_mut().flatten().zip(self.sh.c.iter().flatten());
            pairs.for_each(|(m, want)| *m = want - *m);
            let more = sh::synthesize(&missing, Layout::LatLong, image.width, image.height);
            for (to, from) in image.planes.iter_mut().zip(&more.planes) {
                to.iter_mut().zip(from).for_each(|(t, x)| *t += x);
            }
        }
        Environment { image }
    }

    /// A weighted sum; `None` of no probes.
    pub fn sum<'a>(probes: impl IntoIterator<Item = (&'a Self, f64)>) -> Option<Self> {
        let mut out: Option<Self> = None;
        for (probe, w) in probes {
            let to = out.get_or_insert_with(|| Self {
                sh: ShRgb::zero(probe.sh.order),
                image: probe.image.as_ref().map(|i| SphereImage::new(i.layout, i.width, i.height)),
            });
            let pairs = to.sh.c.iter_mut().flatten().zip(probe.sh.c.iter().flatten());
            pairs.for_each(|(t, x)| *t += w * x);
            if let (Some(to), Some(from)) = (&mut to.image, &probe.image) {
                for (to, from) in to.planes.iter_mut().zip(&from.planes) {
                    to.iter_mut().zip(from).for_each(|(t, x)| *t += w as f32 * x);
                }
            }
        }
        out
    }
}

impl Probes {
    /// Bands of every probe; 0 where all are inside solids.
    pub fn bands(&self) -> usize {
        self.light.iter().flatten().next().map_or(0, |p| p.sh.order + 1)
    }

    /// Width and height of the images of probes.
    pub fn image_size(&self) -> Option<(usize, usize)> {
        let image = self.light.iter().flatten().next()?.image.as_ref()?;
        Some((image.width, image.height))
    }

    /// Coefficients of incident light at `p`: the sum over [`Probes::weights`]. `None` where p is not finite
    /// or no probe is outside solids.
    pub fn at(&self, p: DVec3) -> Option<ShRgb> {
        let weights = self.weights(p);
        let mut out: Option<ShRgb> = None;
        for (k, w) in weights {
            let Some(probe) = &self.light[k] else { continue };
            let to = out.get_or_insert_with(|| ShRgb::zero(probe.sh.order));
            let pairs = to.c.iter_mut().flatten().zip(probe.sh.c.iter().flatten());
            pairs.for_each(|(t, x)| *t += w * x);
        }
        out
    }

    /// The probes, in order, that [`Probes::weights`] may name at points of these triangles.
    pub fn around<'a>(&self, triangles: impl IntoIterator<Item = &'a [Vec3; 3]>) -> Vec<usize> {
        let mut needed = vec![false; self.light.len()];
        match &self.places {
            Places::Grid { .. } => {
                for corners in triangles {
                    let lo = corners.iter().fold(Vec3::INFINITY, |a, b| a.min(*b)).as_dvec3();
                    let hi = corners.iter().fold(Vec3::NEG_INFINITY, |a, b| a.max(*b)).as_dvec3();
                    self.mark_cells([lo, hi], &mut needed);
                }
            }
            Places::Points(_) => needed.fill(true),
        }
        (0..needed.len()).filter(|k| needed[*k] && self.light[*k].is_some()).collect()
    }
}

#[cfg(test)]
mod tests;
