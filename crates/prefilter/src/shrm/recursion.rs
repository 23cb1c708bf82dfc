//! Rotation of y_lq about the pole into y_lq about another direction: combinations of Wigner's d over a block
//! of rings.
//!
//! With u = (x, z, y), in which the image's pole is z, the frame at (α, β) is the rotation R_z(β) R_y(α) but
//! for the sign of y'. From D^l_mq = e^{−imβ} d^l_mq(α) (Ramamoorthi & Hanrahan 2002, 5.8) and the real basis
//! without Condon–Shortley signs, for m ≥ 0, q ≥ 0:
//!
//! ```text
//! y_lq(R⁻¹w)  = Σ_m u⁺_lmq(α) (Y_lm(u) cos mβ + Y_l,−m(u) sin mβ)
//! y_l,−q(R⁻¹w) = Σ_m u⁻_lmq(α) (Y_lm(u) sin mβ − Y_l,−m(u) cos mβ)
//! u± = g_m (D⁺ ± D⁻),   D⁺ = (−1)^{m+q} d^l_mq,   D⁻ = (−1)^m d^l_m,−q,   g_0 = 1/√2, g_m = 1
//! q = 0:  u⁺ = √2 g_m (−1)^m d^l_m0,  u⁻ = 0
//! u±(π − α) = ±(−1)^{l+m+q} u±(α)
//! ```
//!
//! Over l from l₀ = max(m, q) both follow (Varshalovich, Moskalev & Khersonskii 1988, 4.8.2)
//!
//! ```text
//! D_{l+1} = (A_l cos α ∓ B_l) D_l − C_l D_{l−1},
//! A_l = (l+1)(2l+1)/s_{l+1},  B_l = A_l mq/(l(l+1)),  C_l = (l+1) s_l/(l s_{l+1}),  s_l = √((l² − m²)(l² − q²))
//! ```
//!
//! upwards, which is stable (D grows into its oscillating region), with exponents of their own so that seeds
//! of any order survive (the idea of libsharp, Reinecke & Seljebotn 2013).

use steradian_simd::{Arch, Kernel};

/// Rings that lie side by side.
pub(super) const RINGS: usize = 16;

/// Unit of the exponents that scaled values carry: 2^223 below the largest double.
const BIG: f64 = f64::from_bits((1023 + 800) << 52);
/// Its inverse.
const SMALL: f64 = f64::from_bits((1023 - 800) << 52);
/// Scaled values above are moved to the next exponent.
const LIMIT: f64 = f64::from_bits((1023 - 60) << 52);
/// Seeds are kept above 2^−400 of their exponent.
const LOW: f64 = f64::from_bits((1023 - 400) << 52);
/// Smaller values are negligible in a sum.
const NEGLIGIBLE: f64 = 1e-30;

/// cos α, cos α/2 and sin α/2 of a block of rings.
#[derive(Debug, Clone)]
pub(super) struct Rings {
    pub(super) cos: [f64; RINGS],
    half: [[f64; 2]; RINGS],
}

impl Rings {
    /// A block of rings at angles α; the last one is repeated where there are fewer than a block holds.
    pub(super) fn new(alpha: &[f64]) -> Self {
        let at = |k: usize| alpha.get(k).or(alpha.last()).copied().unwrap_or(0.0);
        Self {
            cos: std::array::from_fn(|k| at(k).cos()),
            half: std::array::from_fn(|k| {
                let (s, c) = (0.5 * at(k)).sin_cos();
                [c, s]
            }),
        }
    }
}

/// u⁺ (and u⁻ where q > 0) of one (m, q) over a block of rings.
#[derive(Debug, Clone, Default)]
pub(super) struct Column {
    /// The band of the first row: below it all rings are negligible.
    pub(super) first: usize,
    /// Rows by l from `first`: u⁺ of all rings, then, where q > 0, u⁻.
    pub(super) rows: Vec<f64>,
}

/// A_l, B_l, C_l for l = l₀ … order − 1.
pub(super) fn steps(m: usize, q: usize, order: usize) -> Vec<[f64; 3]> {
    let (m2, q2) = ((m * m) as f64, (q * q) as f64);
    let s = |l: usize| {
        let l2 = (l * l) as f64;
        ((l2 - m2) * (l2 - q2)).sqrt()
    };
    (m.max(q)..order)
        .map(|l| {
            let (x, next) = (l as f64, s(l + 1));
            let a = (x + 1.0) * (2.0 * x + 1.0) / next;
            if l == 0 {
                return [a, 0.0, 0.0];
            }
            [a, a * (m * q) as f64 / (x * (x + 1.0)), (x + 1.0) * s(l) / (x * next)]
        })
        .collect()
}

/// A number v·2^(800·scale), scale ≤ 0.
#[derive(Debug, Clone, Copy)]
struct Scaled {
    v: f64,
    scale: f64,
}

impl Scaled {
    fn times(self, factor: f64) -> Self {
        let v = self.v * factor;
        if v.abs() < LOW && v != 0.0 {
            Self { v: v * BIG, scale: self.scale - 1.0 }
        } else {
            Self { v, ..self }
        }
    }

    /// Times x^n, 0 ≤ x ≤ 1, in factors that do not underflow.
    fn times_power(mut self, x: f64, n: usize) -> Self {
        if n == 0 || x == 1.0 {
            return self;
        }
        if x == 0.0 {
            return Self { v: 0.0, scale: 0.0 };
        }
        let parts = (1 + (-x.log2() * n as f64 / 500.0) as usize).min(n);
        for k in 0..parts {
            let exponent = (k + 1) * n / parts - k * n / parts;
            self = self.times(x.powf(exponent as f64));
        }
        self
    }
}

/// |D⁺| and |D⁻| at l₀ = max(m, q): √C(2l₀, l₀+k) c^{l₀+k} s^{l₀−k} with k = ±min(m, q).
fn seeds(m: usize, q: usize, binomial: f64, [c, s]: [f64; 2]) -> [Scaled; 2] {
    let (l, k) = (m.max(q), m.min(q));
    let of = |more: f64, less: f64| {
        // (2cs)^{l−k} (√2·more)^{2k} and what is left of 2^l: no factor is large.
        Scaled { v: binomial, scale: 0.0 }
            .times_power((2.0 * more * less).min(1.0), l - k)
            .times_power(more, 2 * k)
    };
    [of(c, s), of(s, c)]
}

/// √C(2l, l+k) 2^{k−l}, l = max(m, q), k = min(m, q).
fn binomial(m: usize, q: usize) -> f64 {
    let (l, k) = (m.max(q), m.min(q));
    let mut square = 1.0;
    for j in 1..=l {
        square *= (2 * j - 1) as f64 / (2 * j) as f64;
        // Factors of C(2l, l+k)/C(2l, l) · 4^k, one by one so that nothing overflows.
        if j <= k {
            square *= 4.0 * (l - j + 1) as f64 / (l + j) as f64;
        }
    }
    square.sqrt()
}

/// Fills a column: u± for all l up to `order` with the [`steps`] of (m, q).
pub(super) struct Fill<'a> {
    pub(super) m: usize,
    pub(super) q: usize,
    pub(super) steps: &'a [[f64; 3]],
    pub(super) rings: &'a Rings,
    pub(super) column: &'a mut Column,
}

type Lanes = [f64; RINGS];

/// One of D⁺ and D⁻.
struct Sequence {
    now: Lanes,
    before: Lanes,
    scale: Lanes,
}

impl Sequence {
    /// D_{l+1} from D_l; `b` is ±B_l.
    #[inline(always)]
    fn step<A: Arch>(&mut self, x: &Lanes, [a, b, c]: [f64; 3]) {
        for k in 0..RINGS {
            let next = A::fma(A::fma(a, x[k], -b), self.now[k], -(c * self.before[k]));
            self.before[k] = self.now[k];
            self.now[k] = next;
        }
    }

    /// Brings lanes that have grown up to the next exponent; are all plain numbers now?
    #[inline(always)]
    fn rescale(&mut self) -> bool {
        let mut lowest = 0.0_f64;
        for k in 0..RINGS {
            let grown = self.scale[k] < 0.0 && self.now[k].abs() > LIMIT;
            let factor = if grown { SMALL } else { 1.0 };
            self.now[k] *= factor;
            self.before[k] *= factor;
            self.scale[k] += if grown { 1.0 } else { 0.0 };
            lowest = lowest.min(self.scale[k]);
        }
        lowest == 0.0
    }

    /// The values as plain numbers, 0 where they are too small for f64.
    #[inline(always)]
    fn values(&self) -> Lanes {
        let mut out = self.now;
        for k in 0..RINGS {
            out[k] = if self.scale[k] < 0.0 { 0.0 } else { out[k] };
        }
        out
    }
}

impl Fill<'_> {
    fn start(&self) -> [Sequence; 2] {
        let (m, q) = (self.m, self.q);
        let odd = |n: usize| if n.is_multiple_of(2) { 1.0 } else { -1.0 };
        let norm = if m == 0 { std::f64::consts::FRAC_1_SQRT_2 } else { 1.0 };
        let norm = norm * if q == 0 { std::f64::consts::SQRT_2 } else { 1.0 };
        let signs = [if q > m { odd(m + q) } else { 1.0 }, odd(q)];
        let binomial = binomial(m, q);
        let zero = || Sequence { now: [0.0; RINGS], before: [0.0; RINGS], scale: [0.0; RINGS] };
        let mut out = [zero(), zero()];
        for k in 0..RINGS {
            let seeds = seeds(m, q, binomial, self.rings.half[k]);
            for part in 0..2 {
                out[part].now[k] = signs[part] * norm * seeds[part].v;
                out[part].scale[k] = seeds[part].scale;
            }
        }
        out
    }
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let [mut plus, mut minus] = self.start();
        let (x, two) = (&self.rings.cos, self.q > 0);
        let order = self.m.max(self.q) + self.steps.len();
        let rows = &mut self.column.rows;
        rows.clear();
        self.column.first = order + 1;
        let mut plain = false;
        for k in 0..=self.steps.len() {
            if k > 0 {
                let [a, b, c] = self.steps[k - 1];
                plus.step::<A>(x, [a, b, c]);
                if two {
                    minus.step::<A>(x, [a, -b, c]);
                }
            }
            if !plain {
                plain = plus.rescale();
                plain &= !two || minus.rescale();
            }
            let (p, n) = (plus.values(), minus.values());
            if rows.is_empty() {
                let mut most = 0.0_f64;
                for i in 0..RINGS {
                    most = most.max(p[i].abs()).max(if two { n[i].abs() } else { 0.0 });
                }
                if most < NEGLIGIBLE {
                    continue;
                }
                self.column.first = self.m.max(self.q) + k;
                rows.reserve((order + 1 - self.column.first) * if two { 2 * RINGS } else { RINGS });
            }
            if two {
                let (mut sum, mut difference) = (p, p);
                for i in 0..RINGS {
                    sum[i] += n[i];
                    difference[i] -= n[i];
                }
                rows.extend_from_slice(&sum);
                rows.extend_from_slice(&difference);
            } else {
                rows.extend_from_slice(&p);
            }
        }
    }
}
