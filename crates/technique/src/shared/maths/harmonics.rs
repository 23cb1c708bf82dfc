//! Real spherical harmonics y_pq in single precision, as shading sums them: no trigonometry, no poles.
//!
//! y_pq = f̃_p|q|(z) a_q, a_q = 1, √2 Re (x + iy)^q, √2 Im (x + iy)^|q|, where f̃_pq = f_pq/sin^q θ is a
//! polynomial in z: f̃_qq is constant, and f̃_pq = A_pq z f̃_{p−1,q} − B_pq f̃_{p−2,q} with A_pq² = (4p² −
//! 1)/(p² − q²), B_pq = A_pq/A_{p−1,q}. `harmonics.wgsl` has the same functions.

use crate::shared::maths::vector::dot;
use std::f64::consts::PI;
use steradian_simd::Vector;

/// Number of directions that [`Harmonics::eval_lanes`] evaluates together.
pub const LANES: usize = 16;
/// Most terms.
pub const MAX_TERMS: usize = 128;

/// The functions y_pq with p ≤ P and |q| ≤ min(p, Q). Order: q = 0 with p = 0 … P, then for q = 1 … Q and p =
/// q … P the cosine and the sine (−q): the order of complete local maps
/// ([`steradian_prefilter::shrm::pairs`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Harmonics {
    p: usize,
    q: usize,
    /// √2 f̃_qq of every q (without the √2 for q = 0).
    start: Vec<f32>,
    /// A_pq, B_pq for q = 0 … Q and p = q + 1 … P.
    steps: Vec<[f32; 2]>,
}

/// Number of terms.
pub fn count(p: usize, q: usize) -> usize {
    let q = q.min(p);
    (p + 1) + (1..=q).map(|q| 2 * (p + 1 - q)).sum::<usize>()
}

/// Place of (p, q), q signed, among the terms; |q| ≤ p.
pub fn place(order: usize, p: usize, q: isize) -> usize {
    let m = q.unsigned_abs();
    if m == 0 {
        return p;
    }
    count(order, m - 1) + 2 * (p - m) + usize::from(q < 0)
}

/// Places of the coefficients l² + l + m among the terms of order P = Q.
pub fn places(order: usize) -> Vec<usize> {
    let lm = (0..=order).flat_map(|l| (0..2 * l + 1).map(move |k| (l, k as isize - l as isize)));
    lm.map(|(l, m)| place(order, l, m)).collect()
}

/// `fn harmonics(d: vec3<f32>) -> array<f32, N>` in WGSL: all y_lm up to `order` in the order l² + l + m,
/// written out.
pub fn wgsl(order: usize) -> String {
    let n = (order + 1) * (order + 1);
    let h = Harmonics::new(order, order);
    let mut step = h.steps.iter();
    let mut out = format!(
        "fn harmonics(d: vec3<f32>) -> array<f32, {n}> {{\n    var y: array<f32, {n}>;\n    var a = vec2<f32>(1.0, 0.0);\n    var f = vec2<f32>(0.0);\n"
    );
    for q in 0..=order {
        out += &format!("    f = vec2<f32>({:?}, 0.0);\n", h.start[q]);
        for p in q..=order {
            if p > q {
                let [a, b] = step.next().copied().unwrap_or_default();
                out += &format!("    f = vec2<f32>({a:?} * d.z * f.x - {b:?} * f.y, f.x);\n");
            }
            let at = p * p + p;
            if q > 0 {
                out += &format!("    y[{}] = f.x * a.x;\n    y[{}] = f.x * a.y;\n", at + q, at - q);
            } else {
                out += &format!("    y[{at}] = f.x;\n");
            }
        }
        if q < order {
            out += "    a = vec2<f32>(a.x * d.x - a.y * d.y, a.x * d.y + a.y * d.x);\n";
        }
    }
    out + "    return y;\n}\n"
}

impl Harmonics {
    /// Orders P and Q; at most [`MAX_TERMS`] terms, further q are left out.
    pub fn new(p: usize, q: usize) -> Self {
        let p = p.min(MAX_TERMS - 1);
        let q = (0..=q.min(p)).rev().find(|q| count(p, *q) <= MAX_TERMS).unwrap_or(0);
        let a = |p: usize, q: usize| {
            let (p, q) = (p as f64, q as f64);
            ((4.0 * p * p - 1.0) / (p * p - q * q)).sqrt()
        };
        let mut f_qq = (0.25 / PI).sqrt();
        let mut start = vec![f_qq as f32];
        for q in 1..=q {
            f_qq *= ((2 * q + 1) as f64 / (2 * q) as f64).sqrt();
            start.push((f_qq * 2.0_f64.sqrt()) as f32);
        }
        let step = |p: usize, q: usize| {
            let b = if p == q + 1 { 0.0 } else { a(p, q) / a(p - 1, q) };
            [a(p, q) as f32, b as f32]
        };
        let steps = (0..=q).flat_map(|q| (q + 1..=p).map(move |p| step(p, q))).collect();
        Self { p, q, start, steps }
    }

    /// P.
    pub fn p(&self) -> usize {
        self.p
    }

    /// Q.
    pub fn q(&self) -> usize {
        self.q
    }

    /// Number of terms.
    #[expect(clippy::len_without_is_empty, reason = "there is always y_00")]
    pub fn len(&self) -> usize {
        count(self.p, self.q)
    }

    /// Writes all terms at unit `d`; `y` beyond them keeps its values.
    #[inline(always)]
    pub fn eval(&self, d: [f32; 3], y: &mut [f32; MAX_TERMS]) {
        let [x, yy, z] = d;
        let (mut re, mut im) = (1.0f32, 0.0f32);
        let (mut at, mut step) = (0, 0);
        for q in 0..=self.q {
            let (mut now, mut before) = (self.start[q], 0.0f32);
            for i in 0..=self.p - q {
                if i > 0 {
                    let [a, b] = self.steps[step];
                    step += 1;
                    (now, before) = (a * z * now - b * before, now);
                }
                if q > 0 {
                    y[at] = now * re;
                    y[at + 1] = now * im;
                    at += 2;
                } else {
                    y[at] = now;
                    at += 1;
                }
            }
            (re, im) = (re * x - im * yy, re * yy + im * x);
        }
    }

    /// [`Harmonics::eval`] of as many directions as `V` has lanes: term by term, from `lane` on.
    #[inline(always)]
    pub fn eval_lanes<V: Vector<T = f32>>(
        &self,
        [x, yy, z]: [V; 3],
        lane: usize,
        y: &mut [[f32; LANES]; MAX_TERMS],
    ) {
        let (mut re, mut im) = (V::splat(1.0), V::splat(0.0));
        let (mut at, mut step) = (0, 0);
        for q in 0..=self.q {
            let (mut now, mut before) = (V::splat(self.start[q]), V::splat(0.0));
            for i in 0..=self.p - q {
                if i > 0 {
                    let [a, b] = self.steps[step];
                    step += 1;
                    let next = V::splat(a).mul(z).mul(now);
                    (now, before) = (V::splat(b).fnma(before, next), now);
                }
                now.mul(re).store(&mut y[at][lane..]);
                at += 1;
                if q > 0 {
                    now.mul(im).store(&mut y[at][lane..]);
                    at += 1;
                }
            }
            (re, im) = (im.fnma(yy, re.mul(x)), re.fma(yy, im.mul(x)));
        }
    }

    /// start of every q, then A, B of every step: what the WGSL twin reads.
    pub fn constants(&self) -> Vec<f32> {
        self.start.iter().copied().chain(self.steps.iter().flatten().copied()).collect()
    }
}

/// x' = ∂C/∂α and y' = C × x' of the frame at unit C whose pole is +Y (α = acos C.y, β = atan2(C.z, C.x), 0
/// on the poles).
#[inline(always)]
pub fn frame([x, y, z]: [f32; 3]) -> [[f32; 3]; 2] {
    let s = (x * x + z * z).sqrt();
    let (cos, sin) = if s > 0.0 { (x / s, z / s) } else { (1.0, 0.0) };
    // z' × x' with z' = (s cos, y, s sin) of length 1.
    [[y * cos, -s, y * sin], [sin, 0.0, -cos]]
}

/// Coordinates of `v` in the frame at `c`.
#[inline(always)]
pub fn local(c: [f32; 3], v: [f32; 3]) -> [f32; 3] {
    let [x, y] = frame(c);
    [dot(x, v), dot(y, v), dot(c, v)]
}

/// 0.5 + β/2π and α/π, both in [0, 1], of a direction of any length.
#[inline(always)]
pub fn globe_uv([x, y, z]: [f32; 3]) -> [f32; 2] {
    let s = (x * x + z * z).sqrt();
    let turn = if s > 0.0 { z.atan2(x) * std::f32::consts::FRAC_1_PI * 0.5 } else { 0.0 };
    [0.5 + turn, s.atan2(y) * std::f32::consts::FRAC_1_PI]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use steradian_sphere::sh;

    #[test]
    fn they_are_the_library_s_harmonics() {
        for (p, q) in [(0, 0), (1, 1), (5, 5), (7, 2), (40, 0), (9, 9)] {
            let h = Harmonics::new(p, q);
            assert_eq!(h.q(), q);
            let mut want = vec![0.0; sh::count(p)];
            for k in 0..60 {
                let d = steradian_prefilter::probe::direction(k, 60);
                sh::eval(p, d, &mut want);
                let mut got = [0.0; MAX_TERMS];
                h.eval(d.as_vec3().to_array(), &mut got);
                for l in 0..=p {
                    for m in -(l.min(q) as isize)..=l.min(q) as isize {
                        let (a, b) = (f64::from(got[place(p, l, m)]), want[sh::index(l, m)]);
                        assert!((a - b).abs() < 1e-5 * (1 + l) as f64, "{l} {m}: {a} {b}");
                    }
                }
            }
            assert_eq!(h.len(), count(p, q));
        }
    }

    #[test]
    fn frames_are_right_handed_and_turn_with_the_azimuth_at_the_poles() {
        let mut all: Vec<_> = (0..50).map(|k| steradian_prefilter::probe::direction(k, 50)).collect();
        all.extend([DVec3::Y, DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z]);
        for c in all {
            let [x, y] = frame(c.as_vec3().to_array()).map(|v| glam::Vec3::from_array(v).as_dvec3());
            assert!(x.cross(y).distance(c) < 1e-6 && x.dot(c).abs() < 1e-6, "{c}");
            // Towards growing α: downwards.
            assert!(x.y <= 0.0);
        }
    }
}
