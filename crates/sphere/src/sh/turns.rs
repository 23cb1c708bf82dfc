//! Many rotations of one set of coefficients: a light seen from each vertex's frame, or reflectance brought
//! to the world.
//!
//! M(R) = Z(α) X Z(−β) X Z(γ) with X the exchange of y and z, as in [`super::Rotation`], here on registers
//! whose lanes are different rotations. Up to six bands the exchange's constants are written out ([`turn`]);
//! beyond, rows of them are read ([`Exchange`]).

use super::ShRgb;
use super::rotation::exchange_yz;
use glam::Mat3;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Vector};

/// Rotations whose results lie side by side.
pub const TURNS: usize = 16;

/// Coefficients of [`TURNS`] rotated functions: by channel, then l² + l + m, then rotation. N is bands², 36
/// at most.
pub type TurnedBlock<const N: usize = 25> = [[[f32; TURNS]; N]; 3];

/// Blocks that a thread takes at a time.
const SHARE: usize = 64;

/// Bands whose constants are written out.
const WRITTEN: usize = 6;

/// Rotations, prepared: cosines and sines of their ZYZ angles.
#[derive(Debug, Clone, Default)]
pub struct Turns {
    /// cos α, sin α, cos β, −sin β, cos γ, sin γ of [`TURNS`] rotations at a time.
    blocks: Vec<[[f32; TURNS]; 6]>,
    count: usize,
}

impl Turns {
    /// Prepares proper rotations (orthogonal, determinant 1).
    pub fn new(rotations: &[Mat3]) -> Self {
        let angles = |block: &[Mat3]| {
            let mut out = [[0.0; TURNS]; 6];
            for lane in 0..TURNS {
                let r = block.get(lane).copied().unwrap_or(Mat3::IDENTITY);
                let z = r.z_axis;
                let h = z.x.hypot(z.y);
                let (cos, sin) = if h > 0.0 { (z.x / h, z.y / h) } else { (1.0, 0.0) };
                // What remains after R_z(α) is taken off, so that α + γ stays accurate where β is near 0 or
                // π.
                let y = |v: glam::Vec3| cos * v.y - sin * v.x;
                let turn = [cos, sin, z.z, -(cos * z.x + sin * z.y), y(r.y_axis), y(r.x_axis)];
                for (o, t) in out.iter_mut().zip(turn) {
                    o[lane] = t;
                }
            }
            out
        };
        Self { blocks: rotations.par_chunks(TURNS).map(angles).collect(), count: rotations.len() }
    }

    /// Number of rotations.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Are there none?
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Number of blocks of [`TURNS`] rotations; the last is filled up with the identity.
    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// The function of `sh` (its first √N bands; those that it has not are 0, higher ones left out) turned by
    /// each rotation, f'(d) = f(R⁻¹ d), on all threads.
    ///
    /// # Panics
    /// If `out` has not [`Turns::blocks`] blocks, or N is not the square of 1 … 6.
    pub fn apply<const N: usize>(&self, sh: &ShRgb, out: &mut [TurnedBlock<N>]) {
        assert_eq!(out.len(), self.blocks.len(), "a block of results for each block of rotations");
        assert!(
            N.isqrt().pow(2) == N && N > 0 && N <= WRITTEN * WRITTEN,
            "one to six bands, not {N} coefficients"
        );
        let mut c = [[0.0; N]; 3];
        for (c, s) in c.iter_mut().zip(&sh.c) {
            c.iter_mut().zip(s).for_each(|(c, s)| *c = *s as f32);
        }
        let shares = out.par_chunks_mut(SHARE).zip(self.blocks.par_chunks(SHARE));
        shares.for_each(|(out, turns)| steradian_simd::run(Apply { c: &c, turns, out }));
    }
}

struct Apply<'a, const N: usize> {
    c: &'a [[f32; N]; 3],
    turns: &'a [[[f32; TURNS]; 6]],
    out: &'a mut [TurnedBlock<N>],
}

impl<const N: usize> Kernel for Apply<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let lanes = A::F32::LANES;
        for k in 0..self.out.len() {
            let mut lane = 0;
            while lane < TURNS {
                let t = &self.turns[k];
                let angles = [
                    Angle::new(A::F32::load(&t[4][lane..]), A::F32::load(&t[5][lane..])),
                    Angle::new(A::F32::load(&t[2][lane..]), A::F32::load(&t[3][lane..])),
                    Angle::new(A::F32::load(&t[0][lane..]), A::F32::load(&t[1][lane..])),
                ];
                for channel in 0..3 {
                    let mut f = [A::F32::splat(0.0); N];
                    for i in 0..N {
                        f[i] = A::F32::splat(self.c[channel][i]);
                    }
                    turn(&angles, &mut f);
                    for i in 0..N {
                        f[i].store(&mut self.out[k][channel][i][lane..]);
                    }
                }
                lane += lanes;
            }
        }
    }
}

/// An angle in each lane: cos, sin and −sin of m times it, m = 1 … 5.
#[derive(Debug, Clone, Copy)]
pub struct Angle<V>([[V; 3]; WRITTEN - 1]);

impl<V: Vector<T = f32>> Angle<V> {
    /// The angle of this cosine and sine.
    #[inline(always)]
    pub fn new(cos: V, sin: V) -> Self {
        let minus = V::splat(-1.0);
        let minus_sin = sin.mul(minus);
        let mut out = [[cos, sin, minus_sin]; WRITTEN - 1];
        for m in 1..WRITTEN - 1 {
            let [c, s, _] = out[m - 1];
            let (c, s) = (c.fma(cos, s.mul(minus_sin)), s.fma(cos, c.mul(sin)));
            out[m] = [c, s, s.mul(minus)];
        }
        Self(out)
    }
}

/// Turns the functions in the lanes of `f`, up to six bands, by R_z(α) R_y(β) R_z(γ) = R. `angles` are γ, −β,
/// α: with the columns x', y' and z' of R, cos α and sin α are those of (z'.x, z'.y), cos β = z'.z, sin β =
/// |(z'.x, z'.y)|, and γ is of what remains, cos γ = cos α y'.y − sin α y'.x, sin γ = cos α x'.y − sin α
/// x'.x.
#[inline(always)]
pub fn turn<V: Vector<T = f32>, const N: usize>(angles: &[Angle<V>; 3], f: &mut [V; N]) {
    turn_z(&angles[0], f);
    exchange(f);
    turn_z(&angles[1], f);
    exchange(f);
    turn_z(&angles[2], f);
}

/// (c, s) ← (c cos mα − s sin mα, c sin mα + s cos mα) in each band.
#[inline(always)]
fn turn_z<V: Vector<T = f32>, const N: usize>(angle: &Angle<V>, f: &mut [V; N]) {
    // A constant, so that the loops unroll and the coefficients stay in registers.
    for l in 1..const { N.isqrt() } {
        for m in 1..=l {
            turn_pair(angle.0[m - 1], l, m, f);
        }
    }
}

#[inline(always)]
fn turn_pair<V: Vector<T = f32>>([cos, sin, minus_sin]: [V; 3], l: usize, m: usize, f: &mut [V]) {
    let (p, n) = (l * l + l + m, l * l + l - m);
    let (c, s) = (f[p], f[n]);
    f[p] = c.fma(cos, s.mul(minus_sin));
    f[n] = c.fma(sin, s.mul(cos));
}

/// The exchange of y and z as sparse rows, for any number of bands.
#[derive(Debug, Clone, PartialEq)]
pub struct Exchange {
    /// Per coefficient those that it is the sum of, with their factors.
    rows: Vec<Vec<(usize, f32)>>,
}

impl Exchange {
    /// The rows of the first `bands` bands.
    pub fn new(bands: usize) -> Self {
        let count = bands * bands;
        let mut rows = vec![Vec::new(); count];
        for from in 0..count {
            let mut one = vec![0.0; count];
            one[from] = 1.0;
            exchange_yz(bands.max(1) - 1, [one.as_mut_slice()]);
            // Entries are square roots of rationals, or zero.
            let entries = one.into_iter().enumerate().filter(|e| e.1.abs() > 1e-9);
            entries.for_each(|(to, x): (usize, f64)| rows[to].push((from, x as f32)));
        }
        Self { rows }
    }

    /// Per coefficient those that it is the sum of, with their factors.
    pub fn rows(&self) -> &[Vec<(usize, f32)>] {
        &self.rows
    }

    /// [`turn`] for any number of bands: `angles` are cos and sin of γ, −β and α; `scratch` is as long as
    /// `f`.
    #[inline(always)]
    pub fn turn<V: Vector<T = f32>>(&self, angles: &[[V; 2]; 3], f: &mut [V], scratch: &mut [V]) {
        self.turn_z(angles[0], f);
        self.apply(f, scratch);
        self.turn_z(angles[1], scratch);
        self.apply(scratch, f);
        self.turn_z(angles[2], f);
    }

    #[inline(always)]
    fn turn_z<V: Vector<T = f32>>(&self, [cos, sin]: [V; 2], f: &mut [V]) {
        let bands = self.rows.len().isqrt();
        let minus_sin = sin.mul(V::splat(-1.0));
        let (mut c, mut s) = (cos, sin);
        for m in 1..bands {
            let by = [c, s, s.mul(V::splat(-1.0))];
            for l in m..bands {
                turn_pair(by, l, m, f);
            }
            (c, s) = (c.fma(cos, s.mul(minus_sin)), s.fma(cos, c.mul(sin)));
        }
    }

    #[inline(always)]
    fn apply<V: Vector<T = f32>>(&self, from: &[V], to: &mut [V]) {
        for (to, row) in to.iter_mut().zip(&self.rows) {
            let mut sum = V::splat(0.0);
            for (k, x) in row {
                sum = from[*k].fma(V::splat(*x), sum);
            }
            *to = sum;
        }
    }
}

/// a·x + b·y.
#[inline(always)]
fn mix<V: Vector<T = f32>>(a: f32, x: V, b: f32, y: V) -> V {
    x.fma(V::splat(a), y.mul(V::splat(b)))
}

/// Y(x, z, y) in terms of Y(x, y, z), its own inverse: entries are square roots of rationals.
#[inline(always)]
fn exchange<V: Vector<T = f32>, const N: usize>(f: &mut [V; N]) {
    // √(3/4), √(5/8), √(3/8), √(15/16), √(7/8), √(1/8), √(7/16), √(5/16), √(35/64).
    const A: f32 = 0.866_025_4;
    const B: f32 = 0.790_569_4;
    const C: f32 = 0.612_372_4;
    const D: f32 = 0.968_245_8;
    const E: f32 = 0.935_414_35;
    const F: f32 = 0.353_553_4;
    const G: f32 = 0.661_437_8;
    const H: f32 = 0.559_017;
    const I: f32 = 0.739_51;
    let g = *f;
    if N < 4 {
        return;
    }
    (f[1], f[2]) = (g[2], g[1]);
    if N < 9 {
        return;
    }
    (f[4], f[7]) = (g[7], g[4]);
    f[6] = mix(-0.5, g[6], -A, g[8]);
    f[8] = mix(-A, g[6], 0.5, g[8]);
    if N < 16 {
        return;
    }
    f[9] = mix(-B, g[12], C, g[14]);
    f[11] = mix(-C, g[12], -B, g[14]);
    f[12] = mix(-B, g[9], -C, g[11]);
    f[14] = mix(C, g[9], -B, g[11]);
    f[13] = mix(-0.25, g[13], -D, g[15]);
    f[15] = mix(-D, g[13], 0.25, g[15]);
    if N < 25 {
        return;
    }
    f[16] = mix(-E, g[21], F, g[23]);
    f[18] = mix(-F, g[21], -E, g[23]);
    f[21] = mix(-E, g[16], -F, g[18]);
    f[23] = mix(F, g[16], -E, g[18]);
    f[17] = mix(0.75, g[17], -G, g[19]);
    f[19] = mix(-G, g[17], -0.75, g[19]);
    f[20] = g[24].fma(V::splat(I), mix(0.375, g[20], H, g[22]));
    f[22] = g[24].fma(V::splat(-G), mix(H, g[20], 0.5, g[22]));
    f[24] = g[24].fma(V::splat(0.125), mix(I, g[20], -G, g[22]));
    if N < 36 {
        return;
    }
    exchange_five(&g, f);
}

/// Σ x_k g_{i_k}.
#[inline(always)]
fn three<V: Vector<T = f32>, const N: usize>(g: &[V; N], i: [usize; 3], x: [f32; 3]) -> V {
    g[i[2]].fma(V::splat(x[2]), mix(x[0], g[i[0]], x[1], g[i[1]]))
}

/// Band 5 of [`exchange`]; the constants are square roots of 252, 240, 20, 140, 48, 324, 120, 224, 168, 84,
/// 420, 338 and 90 over 512.
#[inline(always)]
fn exchange_five<V: Vector<T = f32>, const N: usize>(g: &[V; N], f: &mut [V; N]) {
    const P: [[f32; 3]; 3] = [
        [0.701_560_76, -0.684_653_2, 0.197_642_35],
        [0.522_912_5, 0.306_186_22, -0.795_495_15],
        [0.484_122_92, 0.661_437_8, 0.572_822],
    ];
    const Q: [[f32; 3]; 3] = [
        [0.125, 0.405_046_3, 0.905_711_05],
        [0.405_046_3, 0.8125, -0.419_262_75],
        [0.905_711_05, -0.419_262_75, 0.0625],
    ];
    let (odd, even, last) = ([30, 32, 34], [25, 27, 29], [31, 33, 35]);
    for k in 0..3 {
        f[even[k]] = three(g, odd, P[k]);
        f[odd[k]] = three(g, even, [P[0][k], P[1][k], P[2][k]]);
        f[last[k]] = three(g, last, Q[k]);
    }
    f[26] = mix(0.5, g[26], -0.866_025_4, g[28]);
    f[28] = mix(-0.866_025_4, g[26], -0.5, g[28]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sh::{QuarterTurns, Rotation, turn_symbolic};
    use glam::{Quat, Vec3};

    /// Rotations all over, and at the angles' poles.
    fn rotations() -> Vec<Mat3> {
        let mut rotations: Vec<Mat3> = (0..40u8)
            .map(|i| {
                let t = f32::from(i);
                let axis = Vec3::new(t.sin(), (2.3 * t).cos(), (0.7 * t).sin()).normalize();
                Mat3::from_quat(Quat::from_axis_angle(axis, 1.7 * t))
            })
            .collect();
        rotations.extend([
            Mat3::IDENTITY,
            Mat3::from_rotation_z(2.0),
            Mat3::from_rotation_x(std::f32::consts::PI),
        ]);
        rotations.push(Mat3::from_rotation_y(1e-6) * Mat3::from_rotation_z(-1.0));
        rotations
    }

    fn agree<const N: usize>() {
        let c = std::array::from_fn(|k| (0..N + 7).map(|i| ((i * i + 7 * k) as f64).sin()).collect());
        let sh = ShRgb { order: N.isqrt(), c };
        let rotations = rotations();
        let turns = Turns::new(&rotations);
        assert_eq!((turns.len(), turns.blocks(), turns.is_empty()), (44, 3, false));
        let mut out = vec![[[[0.0; TURNS]; N]; 3]; turns.blocks()];
        turns.apply(&sh, &mut out);
        let norm = (0..3).map(|k| sh.c[k][..N].iter().map(|x| x * x).sum::<f64>().sqrt()).fold(0.0, f64::max);
        for (i, r) in rotations.iter().enumerate() {
            // KSS02's two ways, in double precision, and the general rotation.
            let r = r.as_dmat3();
            let one = Rotation::new(N.isqrt() - 1, r).apply_rgb(&sh);
            for k in 0..3 {
                let many: Vec<f64> = (0..N).map(|j| f64::from(out[i / TURNS][k][j][i % TURNS])).collect();
                let mut all = vec![one.c[k].clone(), sh.c[k][..N].to_vec()];
                QuarterTurns::new(N.isqrt()).apply(r, &mut all[1]);
                if N <= 9 {
                    all.push(sh.c[k][..N].to_vec());
                    turn_symbolic(r, &mut all[2]);
                }
                for way in &all {
                    let off = way.iter().zip(&many).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(off < 1e-6 * norm, "{N} {i} {k}: {off}");
                }
            }
        }
    }

    #[test]
    fn many_turns_agree_with_single_ones_and_with_the_papers_ways() {
        agree::<1>();
        agree::<4>();
        agree::<9>();
        agree::<16>();
        agree::<25>();
        agree::<36>();
    }

    struct Wide<'a>(&'a Exchange, &'a [f32], [[f32; 2]; 3]);

    impl Kernel for Wide<'_> {
        type Output = Vec<f32>;
        #[inline(always)]
        fn run<A: Arch>(self) -> Vec<f32> {
            let mut f: Vec<A::F32> = self.1.iter().map(|x| A::F32::splat(*x)).collect();
            let mut scratch = f.clone();
            let angles = self.2.map(|a| a.map(A::F32::splat));
            self.0.turn(&angles, &mut f, &mut scratch);
            let mut lanes = [0.0; TURNS];
            let first = |v: A::F32| {
                v.store(&mut lanes);
                lanes[0]
            };
            f.into_iter().map(first).collect()
        }
    }

    /// Fifteen bands by rows.
    #[test]
    fn rows_turn_any_number_of_bands() {
        let c: Vec<f32> = (0..225u16).map(|i| f32::from(i * i % 97).sin()).collect();
        let exchange = Exchange::new(15);
        let (a, b, g) = (0.7f32, 1.1f32, -2.3f32);
        let r = Mat3::from_rotation_z(a) * Mat3::from_rotation_y(b) * Mat3::from_rotation_z(g);
        let angles = [g, -b, a].map(|x| [x.cos(), x.sin()]);
        let got = steradian_simd::run(Wide(&exchange, &c, angles));
        let mut want = vec![0.0; 225];
        Rotation::new(14, r.as_dmat3())
            .apply(&c.iter().map(|x| f64::from(*x)).collect::<Vec<_>>(), &mut want);
        for (a, b) in got.iter().zip(&want) {
            assert!((f64::from(*a) - b).abs() < 2e-5, "{a} {b}");
        }
        // The table of five bands has 45 quarter-turn entries (Kautz et al. 2002 say sparse).
        assert_eq!(Exchange::new(5).rows().iter().map(Vec::len).sum::<usize>(), 45);
    }

    #[test]
    fn few_bands_and_no_rotations_are_harmless() {
        let sh = ShRgb { order: 0, c: [vec![2.0], vec![1.0], vec![0.5]] };
        let turns = Turns::new(&[Mat3::from_rotation_x(1.0)]);
        let mut out = vec![[[[9.0; TURNS]; 25]; 3]; 1];
        turns.apply(&sh, &mut out);
        assert_eq!((out[0][0][0][0], out[0][2][0][5], out[0][0][24][0]), (2.0, 0.5, 0.0));
        Turns::new(&[]).apply::<25>(&sh, &mut []);
    }
}
