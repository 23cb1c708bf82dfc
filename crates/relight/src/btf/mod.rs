//! Bidirectional texture functions (Dana, van Ginneken, Nayar & Koenderink 1999, *Reflectance and Texture of
//! Real-World Surfaces*): the radiance of each texel of a surface in every view under every light, with
//! bumps, their shadows, occlusion and interreflection included; and three methods to compress them (STAR04
//! 6.4.5).
//!
//! A function is a table B(x, v, l) of texels x, views v and lights l in red, green and blue. A number of 1
//! is the value of a white Lambertian surface under a light that it faces: radiance is E B/π under the
//! irradiance E across the light's direction, the cosine of its angle is in B. Directions are x to the right
//! of the picture, y up, z out of it; patches repeat.
//!
//! | [`Method`] | source | what stands for B(x, v, l) |
//! |---|---|---|
//! | view | Sattler, Sarlette & Klein 2003 | μ_v(x) + Σ_j w_j(v, l) E_vj(x): principal components of each view's pictures |
//! | local | Müller, Meseth & Klein 2003 | μ_k(v, l) + Σ_j a_j(x) e_kj(v, l), k the cluster of x: principal components of clusters of texels |
//! | chained | Suykens, vom Berge, Lagae & Dutré 2003 | R(l) Σ_j P_j(x, h) Q_j(d): a sum of products over half vector and difference, chained with one over the light |
//!
//! Every number is decoded on its own, by [`Compressed::decode`]: nothing is unpacked beforehand.

mod chained;
mod directions;
mod levels;
mod linear;
mod local;
mod net;
#[cfg(test)]
mod tests;
mod view;

pub use chained::{Chained, Corners};
pub use directions::{Pairing, around, bonn, spread};
pub use levels::{Levels, Tap};
pub use local::Local;
pub use net::{Net, Triangle};
pub use view::View;

use glam::DVec3;
use half::f16;
use half::slice::HalfFloatSliceExt;
use steradian_parallel::prelude::*;

/// Returns whether to go on; the caller ends early once it returns false, as it does from then on.
pub type GoOn<'a> = &'a (dyn Fn() -> bool + Sync);

/// Most directions of light or view, and most texels a side.
const MOST: usize = 1 << 16;
/// Largest number of half precision.
const LARGEST_HALF: f32 = 65504.0;

/// Why there is no function.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BtfError {
    /// Nothing to hold.
    #[error("{0} x {1} texels, {2} views and {3} lights: each must be 1 at least, and {MOST} at most")]
    Size(usize, usize, usize, usize),
    /// A direction that is not above the surface.
    #[error("{0} has the direction ({1:.3}, {2:.3}, {3:.3}): it must be above the surface, z > 0")]
    Below(&'static str, f64, f64, f64),
    /// A picture of another size.
    #[error("is of {got} texels where the first picture has {want}")]
    Texels {
        /// Its number of texels.
        got: usize,
        /// Number of texels of the first picture.
        want: usize,
    },
    /// A number that is not finite.
    #[error("texel ({0}, {1}) is not finite")]
    Finite(usize, usize),
    /// A number beyond half precision.
    #[error("texel ({0}, {1}) has {2}, and numbers are kept in half precision, up to 65504")]
    Large(usize, usize, f32),
    /// A view without one of the lights.
    #[error(
        "the view at theta {view_theta:.2}, phi {view_phi:.2} lacks the light at theta {theta:.2}, phi {phi:.2}: each view must have each \
         light ({missing} of {all} pictures are missing)"
    )]
    Missing {
        /// The view's angle from the normal, degrees.
        view_theta: f64,
        /// Azimuth of the view.
        view_phi: f64,
        /// The light's angle from the normal.
        theta: f64,
        /// Azimuth of the light.
        phi: f64,
        /// Pictures that are missing.
        missing: usize,
        /// Pictures of all views under all lights.
        all: usize,
    },
    /// Two pictures of one view and light.
    #[error("pictures {0} and {1} are of the same view and light")]
    Twice(usize, usize),
}

/// The numbers: texel after texel; in each the views, in these the lights, in these red, green and blue.
#[derive(Debug, Clone, PartialEq)]
enum Values {
    Single(Vec<f32>),
    Half(Vec<f16>),
}

/// A bidirectional texture function.
#[derive(Debug, Clone, PartialEq)]
pub struct Btf {
    width: usize,
    height: usize,
    views: Vec<DVec3>,
    lights: Vec<DVec3>,
    values: Values,
}

impl Btf {
    /// A function that is 0 everywhere, with numbers of half precision or of single precision. Directions
    /// become unit vectors.
    pub fn new(
        (width, height): (usize, usize),
        views: &[DVec3],
        lights: &[DVec3],
        half: bool,
    ) -> Result<Self, BtfError> {
        let size = BtfError::Size(width, height, views.len(), lights.len());
        let fits = |n: usize| (1..=MOST).contains(&n);
        if ![width, height, views.len(), lights.len()].into_iter().all(fits) {
            return Err(size);
        }
        let product = width.checked_mul(height).and_then(|n| n.checked_mul(3 * views.len() * lights.len()));
        let Some(count) = product else { return Err(size) };
        let unit = |what: &'static str, all: &[DVec3]| -> Result<Vec<DVec3>, BtfError> {
            let one = |d: &DVec3| {
                let unit = d.try_normalize().filter(|u| u.z > 0.0);
                unit.ok_or(BtfError::Below(what, d.x, d.y, d.z))
            };
            all.iter().map(one).collect()
        };
        let (views, lights) = (unit("a view", views)?, unit("a light", lights)?);
        let values =
            if half { Values::Half(vec![f16::ZERO; count]) } else { Values::Single(vec![0.0; count]) };
        Ok(Self { width, height, views, lights, values })
    }

    /// The function of a formula of texel, view and light, in single precision.
    pub fn of(
        size: (usize, usize),
        views: &[DVec3],
        lights: &[DVec3],
        f: impl Fn(usize, usize, usize) -> [f32; 3] + Sync,
    ) -> Result<Self, BtfError> {
        let mut out = Self::new(size, views, lights, false)?;
        let (n, l) = (out.dimension(), lights.len());
        if let Values::Single(all) = &mut out.values {
            all.par_chunks_exact_mut(n).enumerate().for_each(|(x, row)| {
                for (p, to) in row.chunks_exact_mut(3).enumerate() {
                    to.copy_from_slice(&f(x, p / l, p % l));
                }
            });
        }
        Ok(out)
    }

    /// Puts the picture of a view under a light in: red, green and blue, rows from the top.
    ///
    /// # Panics
    /// If there is no such view or light.
    pub fn set(&mut self, view: usize, light: usize, planes: [&[f32]; 3]) -> Result<(), BtfError> {
        assert!(view < self.views.len() && light < self.lights.len(), "a view and a light of this function");
        let want = self.texels();
        if let Some(p) = planes.iter().find(|p| p.len() != want) {
            return Err(BtfError::Texels { got: p.len(), want });
        }
        let place = |k: usize| (k % self.width, k / self.width);
        for p in planes {
            if let Some(k) = p.iter().position(|v| !v.is_finite()) {
                let (i, j) = place(k);
                return Err(BtfError::Finite(i, j));
            }
            if let (Values::Half(_), Some(k)) = (&self.values, p.iter().position(|v| v.abs() > LARGEST_HALF))
            {
                let (i, j) = place(k);
                return Err(BtfError::Large(i, j, p[k]));
            }
        }
        let (stride, first) = (self.dimension(), 3 * (view * self.lights.len() + light));
        for k in 0..want {
            for c in 0..3 {
                let (at, v) = (k * stride + first + c, planes[c][k]);
                match &mut self.values {
                    Values::Single(all) => all[at] = v,
                    Values::Half(all) => all[at] = f16::from_f32(v),
                }
            }
        }
        Ok(())
    }

    /// Texels a row and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Texels.
    pub fn texels(&self) -> usize {
        self.width * self.height
    }

    /// Unit directions to the viewers.
    pub fn views(&self) -> &[DVec3] {
        &self.views
    }

    /// Unit directions to the lights.
    pub fn lights(&self) -> &[DVec3] {
        &self.lights
    }

    /// Pairs of a view and a light.
    pub fn pairs(&self) -> usize {
        self.views.len() * self.lights.len()
    }

    /// Numbers of a texel.
    pub fn dimension(&self) -> usize {
        3 * self.pairs()
    }

    /// Red, green and blue of a texel under a pair.
    pub fn value(&self, texel: usize, view: usize, light: usize) -> [f32; 3] {
        let at = texel * self.dimension() + 3 * (view * self.lights.len() + light);
        match &self.values {
            Values::Single(all) => [all[at], all[at + 1], all[at + 2]],
            Values::Half(all) => [all[at], all[at + 1], all[at + 2]].map(f16::to_f32),
        }
    }

    /// Some numbers of a texel, from number `first` on.
    fn part(&self, texel: usize, first: usize, to: &mut [f32]) {
        let at = texel * self.dimension() + first;
        match &self.values {
            Values::Single(all) => to.copy_from_slice(&all[at..at + to.len()]),
            Values::Half(all) => all[at..at + to.len()].convert_to_f32_slice(to),
        }
    }

    /// Largest absolute number.
    pub fn largest(&self) -> f32 {
        let of = |x: usize| {
            let mut row = vec![0.0; self.dimension()];
            self.part(x, 0, &mut row);
            row.iter().fold(0.0f32, |m, v| m.max(v.abs()))
        };
        let all: Vec<f32> = (0..self.texels()).into_par_iter().map(of).collect();
        all.into_iter().fold(0.0, f32::max)
    }

    /// Σ B², texel by texel.
    fn energy(&self) -> f64 {
        let of = |x: usize| {
            let mut row = vec![0.0; self.dimension()];
            self.part(x, 0, &mut row);
            linear::dot(&row, &row)
        };
        let all: Vec<f64> = (0..self.texels()).into_par_iter().map(of).collect();
        all.iter().sum()
    }
}

/// Method of compression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Sattler, Sarlette & Klein 2003, *Efficient and Realistic Visualization of Cloth*.
    View {
        /// Pictures of each view in addition to their mean; no more than there are lights.
        components: usize,
    },
    /// Müller, Meseth & Klein 2003, *Compression and Real-Time Rendering of Measured BTFs Using Local PCA*.
    Local {
        /// Clusters of texels; no more than there are texels.
        clusters: usize,
        /// Tables of a cluster in addition to its mean.
        components: usize,
    },
    /// Suykens, vom Berge, Lagae & Dutré 2003, *Interactive Rendering with Bidirectional Texture Functions*.
    Chained {
        /// Products that are added.
        terms: usize,
        /// Half vectors of a table.
        halves: usize,
        /// Difference vectors of one.
        differences: usize,
    },
}

/// Compressed form of the function.
#[derive(Debug, Clone, PartialEq)]
pub enum Model {
    /// Model of [`Method::View`].
    View(View),
    /// Model of [`Method::Local`].
    Local(Local),
    /// Model of [`Method::Chained`].
    Chained(Chained),
}

/// A small function.
#[derive(Debug, Clone, PartialEq)]
pub struct Compressed {
    /// Its texels and the coarser levels.
    pub levels: Levels,
    /// Unit directions to the viewers.
    pub views: Vec<DVec3>,
    /// Unit directions to the lights.
    pub lights: Vec<DVec3>,
    /// The numbers.
    pub model: Model,
    /// Mean squared error over the mean square of the function, after each step of the method: no step raises
    /// it.
    pub errors: Vec<f64>,
}

impl Compressed {
    /// Compresses a function. The bits do not depend on the number of threads. `None` once `go_on` returns
    /// false.
    pub fn new(of: &Btf, method: Method, go_on: GoOn<'_>) -> Option<Self> {
        let levels = Levels::new(of.width, of.height);
        let energy = of.energy();
        let (model, errors) = match method {
            Method::View { components } => {
                let (m, e) = View::new(of, &levels, components, go_on)?;
                (Model::View(m), e)
            }
            Method::Local { clusters, components } => {
                let (m, e) = Local::new(of, &levels, [clusters, components], go_on)?;
                (Model::Local(m), e)
            }
            Method::Chained { terms, halves, differences } => {
                let (m, e) = Chained::new(of, &levels, [terms, halves, differences], go_on)?;
                (Model::Chained(m), e)
            }
        };
        let relative = |e: f64| if energy > 0.0 { e.max(0.0) / energy } else { 0.0 };
        let errors = errors.into_iter().map(relative).collect();
        Some(Self { levels, views: of.views.clone(), lights: of.lights.clone(), model, errors })
    }

    /// Relative RMS error over all texels and pairs.
    pub fn error(&self) -> f64 {
        self.errors.last().copied().unwrap_or(0.0).sqrt()
    }

    /// Numbers that are kept of the finest texels, the cluster of a texel counted as half a number.
    pub fn numbers(&self) -> f64 {
        let texels = self.levels.texels(0);
        match &self.model {
            Model::View(m) => m.numbers(texels),
            Model::Local(m) => m.numbers(texels),
            Model::Chained(m) => m.numbers(texels),
        }
    }

    /// Numbers of the function per number that is kept.
    pub fn ratio(&self) -> f64 {
        let all = 3 * self.levels.texels(0) * self.views.len() * self.lights.len();
        all as f64 / self.numbers()
    }

    /// Red, green and blue of a texel (of any level) under a pair, alone.
    pub fn decode(&self, texel: usize, view: usize, light: usize) -> [f32; 3] {
        match &self.model {
            Model::View(m) => m.decode(texel, view, light),
            Model::Local(m) => m.decode(texel, view * self.lights.len() + light),
            Model::Chained(m) => m.decode(texel, view * self.lights.len() + light, light),
        }
    }

    /// Σ |B̂ − B|² and Σ |B|² of the pairs of each view, over the finest texels.
    pub fn by_view(&self, of: &Btf) -> Vec<[f64; 2]> {
        let one = |v: usize| {
            let (mut off, mut all) = (0.0, 0.0);
            for x in 0..of.texels() {
                for l in 0..of.lights.len() {
                    let (a, b) = (self.decode(x, v, l), of.value(x, v, l));
                    for c in 0..3 {
                        off += f64::from(a[c] - b[c]).powi(2);
                        all += f64::from(b[c]).powi(2);
                    }
                }
            }
            [off, all]
        };
        (0..of.views.len()).into_par_iter().with_max_len(1).map(one).collect()
    }
}
