//! Kernels at many angles at once, in single precision and in vector registers. Their argument is s² =
//! sin²(θ/2).

use steradian_simd::functions::{exp, ln};
use steradian_simd::{Arch, Kernel, run};

/// A function of one number, to be mapped over slices.
trait Map: Copy {
    fn at(self, s2: f32) -> f32;
}

struct Over<'a, M> {
    s2: &'a [f32],
    out: &'a mut [f32],
    map: M,
}

impl<M: Map> Kernel for Over<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        for (out, &s2) in self.out.iter_mut().zip(self.s2) {
            *out = self.map.at(s2);
        }
    }
}

/// `scale` x₊/(a2 + b s²)², x = cos θ: GGX.
pub(crate) fn rational(s2: &[f32], out: &mut [f32], a2: f32, b: f32, scale: f32) {
    #[derive(Clone, Copy)]
    struct Ggx(f32, f32, f32);
    impl Map for Ggx {
        #[inline(always)]
        fn at(self, s2: f32) -> f32 {
            let q = self.0 + self.1 * s2;
            self.2 * (1.0 - 2.0 * s2).max(0.0) / (q * q)
        }
    }
    run(Over { s2, out, map: Ggx(a2, b, scale) });
}

/// `scale` exp(−k s²/c²)/c⁴ · x₊, c² = 1 − s²: Beckmann.
pub(crate) fn beckmann(s2: &[f32], out: &mut [f32], k: f32, scale: f32) {
    #[derive(Clone, Copy)]
    struct Beckmann(f32, f32);
    impl Map for Beckmann {
        #[inline(always)]
        fn at(self, s2: f32) -> f32 {
            let r = 1.0 / (1.0 - s2).max(0.25);
            self.1 * exp(-self.0 * s2 * r) * r * r * (1.0 - 2.0 * s2).max(0.0)
        }
    }
    run(Over { s2, out, map: Beckmann(k, scale) });
}

/// `scale` (1 − a s²)₊^n · (1 − b s²)₊ for (n, a, b): Phong and Blinn–Phong.
pub(crate) fn power(s2: &[f32], out: &mut [f32], (n, a, b): (f32, f32, f32), scale: f32) {
    #[derive(Clone, Copy)]
    struct Power(f32, f32, f32, f32);
    impl Map for Power {
        #[inline(always)]
        fn at(self, s2: f32) -> f32 {
            let u = self.1 * s2;
            // ln(1 − u) = −2 atanh(u/(2 − u)): to 1e-7 up to u = ½, beyond which large powers have vanished
            // and the series still falls.
            let z = u / (2.0 - u).max(1.0);
            let z2 = z * z;
            let tail = 1.0 / 7.0 + z2 * (1.0 / 9.0 + z2 * (1.0 / 11.0 + z2 * (1.0 / 13.0 + z2 / 15.0)));
            let ln = -2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (0.2 + z2 * tail)));
            let rest = (1.0 - self.2 * s2).max(0.0);
            let inside = if u < 1.0 { self.3 * rest } else { 0.0 };
            exp(self.0 * ln) * inside
        }
    }
    run(Over { s2, out, map: Power(n, a, b, scale) });
}

/// `scale` exp(−k θ²) for narrow ones: Gaussian.
pub(crate) fn gaussian(s2: &[f32], out: &mut [f32], k: f32, scale: f32) {
    #[derive(Clone, Copy)]
    struct Gaussian(f32, f32);
    impl Map for Gaussian {
        #[inline(always)]
        fn at(self, s2: f32) -> f32 {
            // θ² = 4 asin² s = 2 Σ (2s)^{2n}/(n² C(2n, n)).
            let tail = 128.0 / 1575.0 + s2 * (128.0 / 2079.0 + s2 * (2048.0 / 42042.0));
            let theta2 =
                4.0 * s2 * (1.0 + s2 * (1.0 / 3.0 + s2 * (8.0 / 45.0 + s2 * (4.0 / 35.0 + s2 * tail))));
            self.1 * exp(-self.0 * theta2)
        }
    }
    run(Over { s2, out, map: Gaussian(k, scale) });
}

/// `scale` (2 s²)^n (1 − 2 s²)₊: Charlie sheen.
pub(crate) fn sheen(s2: &[f32], out: &mut [f32], n: f32, scale: f32) {
    #[derive(Clone, Copy)]
    struct Sheen(f32, f32);
    impl Map for Sheen {
        #[inline(always)]
        fn at(self, s2: f32) -> f32 {
            exp((self.0 * ln(2.0 * s2)).min(0.0)) * self.1 * (1.0 - 2.0 * s2).max(0.0)
        }
    }
    run(Over { s2, out, map: Sheen(n, scale) });
}

/// `scale` exp(−k s²): spherical Gaussian.
pub(crate) fn exponential(s2: &[f32], out: &mut [f32], k: f32, scale: f32) {
    #[derive(Clone, Copy)]
    struct Exponential(f32, f32);
    impl Map for Exponential {
        #[inline(always)]
        fn at(self, s2: f32) -> f32 {
            self.1 * exp(-self.0 * s2)
        }
    }
    run(Over { s2, out, map: Exponential(k, scale) });
}

#[cfg(test)]
mod tests {
    use crate::{Lobe, Zonal};

    #[test]
    fn every_profile_is_its_kernel() {
        let s2: Vec<f32> = (0..1200).map(|k| (k as f32 / 1199.0).powi(3)).collect();
        let mut out = vec![0.0; s2.len()];
        for w in [1e-3, 0.02, 0.1, 0.4, 1.0] {
            let n = 2.0 / (w * w);
            let lobes = [
                Lobe::ggx(w),
                Lobe::beckmann(w),
                Lobe::charlie(w),
                Lobe::blinn_phong(n),
                Lobe::phong(n),
                Lobe::lambert(),
                Lobe::gaussian(w),
                Lobe::spherical_gaussian(w),
            ];
            for lobe in lobes {
                lobe.fill(&s2, &mut out);
                let peak = s2.iter().map(|s| lobe.value(1.0 - 2.0 * f64::from(*s))).fold(0.0, f64::max);
                for (s2, k) in s2.iter().zip(&out) {
                    let exact = lobe.value(1.0 - 2.0 * f64::from(*s2));
                    let off = (f64::from(*k) - exact).abs();
                    assert!(off <= 3e-6 * exact + 1e-7 * peak, "{lobe:?} at {s2}: {k} {exact}");
                }
            }
        }
    }
}
