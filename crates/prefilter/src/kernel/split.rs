//! A sharp kernel in two parts: K = K χ + K (1 − χ), with χ a smooth step from 1 at the centre to 0 outwards.
//!
//! K χ reaches a few texels and is summed directly; K (1 − χ) is as smooth as χ, however sharp K is, and goes
//! through frequency space.

use super::zonal::quadrature;
use crate::Zonal;

/// The two parts.
pub(crate) struct Split<'a> {
    kernel: &'a dyn Zonal,
    /// Chord² where χ becomes 0.
    reach2: f64,
}

/// χ at v = chord²/reach²: one less the polynomial step of degree 9, four times smooth at both ends. In θ it
/// is flat up to about 0.4 of the reach.
#[inline(always)]
pub(crate) fn step(v: f32) -> f32 {
    let v = v.min(1.0);
    let v2 = v * v;
    1.0 - v2 * v2 * v * (126.0 + v * (-420.0 + v * (540.0 + v * (-315.0 + v * 70.0))))
}

/// [`step`] in double precision.
fn step64(v: f64) -> f64 {
    let v = v.min(1.0);
    1.0 - v.powi(5) * (126.0 + v * (-420.0 + v * (540.0 + v * (-315.0 + v * 70.0))))
}

impl<'a> Split<'a> {
    /// Splits at the reach `turns`/`order` radians: the energy of the smooth part in bands above `order`
    /// falls with `turns`, and about 20 leave 1e-3 of the part of K around the step.
    pub fn new(kernel: &'a dyn Zonal, order: usize, turns: f64) -> Self {
        let reach = (turns / order.max(16) as f64).min(1.5);
        Self { kernel, reach2: (2.0 * (0.5 * reach).sin()).powi(2) }
    }

    /// Chord² beyond which the near part is zero.
    pub fn reach2(&self) -> f64 {
        self.reach2
    }

    /// The angle beyond which the near part is zero.
    pub fn reach(&self) -> f64 {
        2.0 * (0.5 * self.reach2.sqrt()).min(1.0).asin()
    }

    /// K (1 − χ) at x = cos θ.
    pub fn far_value(&self, x: f64) -> f64 {
        let c2 = (2.0 * (1.0 - x)).max(0.0);
        self.kernel.value(x) * (1.0 - step64(c2 / self.reach2))
    }

    /// K χ as a kernel of its own.
    pub fn near(&self) -> NearPart<'_> {
        NearPart { split: self, reach: self.reach() }
    }

    /// Coefficients of K (1 − χ).
    pub fn far(&self, order: usize) -> Vec<f64> {
        let width = self.kernel.width().min(0.1 * self.reach());
        quadrature(|x| self.far_value(x), width, self.kernel.support(), order)
    }
}

/// K χ.
pub(crate) struct NearPart<'a> {
    split: &'a Split<'a>,
    reach: f64,
}

impl Zonal for NearPart<'_> {
    fn value(&self, x: f64) -> f64 {
        let c2 = (2.0 * (1.0 - x)).max(0.0);
        self.split.kernel.value(x) * step64(c2 / self.split.reach2)
    }

    /// χ changes over a quarter of the reach.
    fn width(&self) -> f64 {
        self.split.kernel.width().min(0.25 * self.reach)
    }

    fn support(&self) -> f64 {
        self.reach.min(self.split.kernel.support())
    }

    fn signed(&self) -> bool {
        self.split.kernel.signed()
    }

    fn fill(&self, s2: &[f32], out: &mut [f32]) {
        self.split.kernel.fill(s2, out);
        let scale = (4.0 / self.split.reach2) as f32;
        out.iter_mut().zip(s2).for_each(|(k, s2)| *k *= step(scale * s2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;

    #[test]
    fn the_parts_add_up_and_the_far_one_is_smooth() {
        for alpha in [1e-4, 1e-3, 5e-3] {
            let k = Lobe::ggx(alpha);
            let split = Split::new(&k, 500, 40.0);
            let far = split.far(600);
            // ∫ K χ by a quadrature of its own.
            let near = |x: f64| k.value(x) * f64::from(step((2.0 * (1.0 - x) / split.reach2()) as f32));
            let near = quadrature(near, alpha, split.reach(), 0)[0];
            assert!((near + far[0] - 1.0).abs() < 1e-5, "{alpha}: {near} {}", far[0]);
            assert!(far[500..].iter().all(|k| k.abs() < 3e-5), "{alpha}: {:e}", far[500]);
        }
    }
}
