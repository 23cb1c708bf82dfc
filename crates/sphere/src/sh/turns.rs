//! Many rotations of one set of five bands: a light seen from each vertex's frame.

use super::ShRgb;
use glam::Mat3;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Vector};

/// Bands that are turned: orders 0 … 4.
const COUNT: usize = 25;

/// Rotations whose results lie side by side.
pub const TURNS: usize = 16;

/// Coefficients of [`TURNS`] rotated functions: by channel, then l² + l + m, then rotation.
pub type TurnedBlock = [[[f32; TURNS]; COUNT]; 3];

/// Blocks that a thread takes at a time.
const SHARE: usize = 64;

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
                // What remains after R_z(α) is taken off, so that α + γ stays accurate where β is near 0 or π.
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

    /// The function of `sh` (bands 0 … 4; those that it has not are 0, higher ones left out) turned by each
    /// rotation, f'(d) = f(R⁻¹ d), on all threads.
    ///
    /// M(R) = Z(α) X Z(−β) X Z(γ) with X the exchange of y and z, as in [`super::Rotation`], here with the
    /// exchange's constants written out.
    ///
    /// # Panics
    /// If `out` has not [`Turns::blocks`] blocks.
    pub fn apply(&self, sh: &ShRgb, out: &mut [TurnedBlock]) {
        assert_eq!(out.len(), self.blocks.len(), "a block of results for each block of rotations");
        let mut c = [[0.0; COUNT]; 3];
        for (c, s) in c.iter_mut().zip(&sh.c) {
            c.iter_mut().zip(s).for_each(|(c, s)| *c = *s as f32);
        }
        let shares = out.par_chunks_mut(SHARE).zip(self.blocks.par_chunks(SHARE));
        shares.for_each(|(out, turns)| steradian_simd::run(Apply { c: &c, turns, out }));
    }
}

struct Apply<'a> {
    c: &'a [[f32; COUNT]; 3],
    turns: &'a [[[f32; TURNS]; 6]],
    out: &'a mut [TurnedBlock],
}

impl Kernel for Apply<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let lanes = A::F32::LANES;
        for k in 0..self.out.len() {
            let mut lane = 0;
            while lane < TURNS {
                let t = &self.turns[k];
                let [alpha, beta, gamma]: [Multiples<A::F32>; 3] = [
                    multiples(A::F32::load(&t[0][lane..]), A::F32::load(&t[1][lane..])),
                    multiples(A::F32::load(&t[2][lane..]), A::F32::load(&t[3][lane..])),
                    multiples(A::F32::load(&t[4][lane..]), A::F32::load(&t[5][lane..])),
                ];
                for channel in 0..3 {
                    let mut f = [A::F32::splat(0.0); COUNT];
                    for i in 0..COUNT {
                        f[i] = A::F32::splat(self.c[channel][i]);
                    }
                    turn_z(&gamma, &mut f);
                    exchange(&mut f);
                    turn_z(&beta, &mut f);
                    exchange(&mut f);
                    turn_z(&alpha, &mut f);
                    for i in 0..COUNT {
                        f[i].store(&mut self.out[k][channel][i][lane..]);
                    }
                }
                lane += lanes;
            }
        }
    }
}

/// cos, sin and −sin of m times an angle, m = 1 … 4.
type Multiples<V> = [[V; 3]; 4];

#[inline(always)]
fn multiples<V: Vector<T = f32>>(cos: V, sin: V) -> Multiples<V> {
    let minus = V::splat(-1.0);
    let minus_sin = sin.mul(minus);
    let mut out = [[cos, sin, minus_sin]; 4];
    for m in 1..4 {
        let [c, s, _] = out[m - 1];
        let (c, s) = (c.fma(cos, s.mul(minus_sin)), s.fma(cos, c.mul(sin)));
        out[m] = [c, s, s.mul(minus)];
    }
    out
}

/// (c, s) ← (c cos mα − s sin mα, c sin mα + s cos mα) in each band.
#[inline(always)]
fn turn_z<V: Vector<T = f32>>(angle: &Multiples<V>, f: &mut [V; COUNT]) {
    for l in 1..5 {
        for m in 1..=l {
            let [cos, sin, minus_sin] = angle[m - 1];
            let (p, n) = (l * l + l + m, l * l + l - m);
            let (c, s) = (f[p], f[n]);
            f[p] = c.fma(cos, s.mul(minus_sin));
            f[n] = c.fma(sin, s.mul(cos));
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
fn exchange<V: Vector<T = f32>>(f: &mut [V; COUNT]) {
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
    (f[1], f[2]) = (g[2], g[1]);
    (f[4], f[7]) = (g[7], g[4]);
    f[6] = mix(-0.5, g[6], -A, g[8]);
    f[8] = mix(-A, g[6], 0.5, g[8]);
    f[9] = mix(-B, g[12], C, g[14]);
    f[11] = mix(-C, g[12], -B, g[14]);
    f[12] = mix(-B, g[9], -C, g[11]);
    f[14] = mix(C, g[9], -B, g[11]);
    f[13] = mix(-0.25, g[13], -D, g[15]);
    f[15] = mix(-D, g[13], 0.25, g[15]);
    f[16] = mix(-E, g[21], F, g[23]);
    f[18] = mix(-F, g[21], -E, g[23]);
    f[21] = mix(-E, g[16], -F, g[18]);
    f[23] = mix(F, g[16], -E, g[18]);
    f[17] = mix(0.75, g[17], -G, g[19]);
    f[19] = mix(-G, g[17], -0.75, g[19]);
    f[20] = g[24].fma(V::splat(I), mix(0.375, g[20], H, g[22]));
    f[22] = g[24].fma(V::splat(-G), mix(H, g[20], 0.5, g[22]));
    f[24] = g[24].fma(V::splat(0.125), mix(I, g[20], -G, g[22]));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sh::Rotation;
    use glam::{Quat, Vec3};

    #[test]
    fn many_turns_agree_with_single_ones() {
        let c = std::array::from_fn(|k| (0..36).map(|i| ((i * i + 7 * k) as f64).sin()).collect());
        let sh = ShRgb { order: 5, c };
        let mut rotations: Vec<Mat3> = (0..40u8)
            .map(|i| {
                let t = f32::from(i);
                let axis = Vec3::new(t.sin(), (2.3 * t).cos(), (0.7 * t).sin()).normalize();
                Mat3::from_quat(Quat::from_axis_angle(axis, 1.7 * t))
            })
            .collect();
        // The angles' poles.
        rotations.extend([
            Mat3::IDENTITY,
            Mat3::from_rotation_z(2.0),
            Mat3::from_rotation_x(std::f32::consts::PI),
        ]);
        rotations.push(Mat3::from_rotation_y(1e-6) * Mat3::from_rotation_z(-1.0));
        let turns = Turns::new(&rotations);
        assert_eq!((turns.len(), turns.blocks(), turns.is_empty()), (44, 3, false));
        let mut out = vec![[[[0.0; TURNS]; COUNT]; 3]; turns.blocks()];
        turns.apply(&sh, &mut out);
        for (i, r) in rotations.iter().enumerate() {
            let one = Rotation::new(4, r.as_dmat3()).apply_rgb(&sh);
            for k in 0..3 {
                for (j, c) in one.c[k].iter().enumerate() {
                    let many = f64::from(out[i / TURNS][k][j][i % TURNS]);
                    assert!((many - c).abs() < 3e-6, "{i} {k} {j}: {many} {c}");
                }
            }
        }
    }

    #[test]
    fn few_bands_and_no_rotations_are_harmless() {
        let sh = ShRgb { order: 0, c: [vec![2.0], vec![1.0], vec![0.5]] };
        let turns = Turns::new(&[Mat3::from_rotation_x(1.0)]);
        let mut out = vec![[[[9.0; TURNS]; COUNT]; 3]; 1];
        turns.apply(&sh, &mut out);
        assert_eq!((out[0][0][0][0], out[0][2][0][5], out[0][0][24][0]), (2.0, 0.5, 0.0));
        Turns::new(&[]).apply(&sh, &mut []);
    }
}
