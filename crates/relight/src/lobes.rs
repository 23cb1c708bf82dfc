//! Generalised cosine lobes fitted to what a texel shows from many views under many lights.
//!
//! McAllister, Lastra & Heidrich (2002), *Efficient Rendering of Spatial Bi-directional Reflectance
//! Distribution Functions*; Lafortune, Foo, Torrance & Greenberg (1997), *Non-Linear Approximation of
//! Reflectance Functions*:
//!
//! > f = ρ_d/π + Σ_k ρ_k ((C_k ∘ v)·l)₊^n_k
//!
//! by least squares of f · ⟨n·l⟩. C and n are the same in red, green and blue, ρ is not. The factors ρ ≥ 0
//! are linear and are found exactly for each C and n that is tried (Golub & Pereyra 1973); these follow by
//! damped Gauss–Newton steps (Levenberg 1944; Marquardt 1963) from the best of a few starts, lobe after lobe,
//! then together. Only ρ max|C|ⁿ is determined, so that max|C| = 1.

use crate::btf::Btf;
use glam::DVec3;
use steradian_numerics::dense::{Cholesky, nonnegative};
use steradian_parallel::prelude::*;

/// A lobe of a texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lobe {
    /// Factors of red, green and blue.
    pub rho: [f64; 3],
    /// C along tangent, bitangent and normal; its largest component is 1 or −1.
    pub c: DVec3,
    /// The exponent.
    pub n: f64,
}

/// Reflectance of a texel.
#[derive(Debug, Clone, PartialEq)]
pub struct Texel {
    /// The albedo of the diffuse part.
    pub rho_d: [f64; 3],
    /// The lobes.
    pub lobes: Vec<Lobe>,
    /// Σ |f̂ − f|² cos² and Σ |f|² cos² over the pairs.
    pub squares: [f64; 2],
}

/// Range of exponents.
const EXPONENT_RANGE: [f64; 2] = [0.5, 1e4];
/// Steps of a search at most.
const MAX_STEPS: usize = 60;
/// Relative decrease of the squared error at which a search ends: near a minimum steps of Gauss and Newton
/// square what is left, so that a small bound costs a step or two.
const MIN_GAIN: f64 = 1e-9;
/// Part of a lobe's peak that at least one pair must see. (Without this bound, factors beyond 1e38 were
/// fitted to a lobe that six lights and views hardly met.)
const SEEN: f64 = 1e-3;
/// Step, radians and in ln n, of the differences that approximate derivatives: central ones err by its
/// square, 1e-10, and by rounding over it, 1e-11.
const DIFFERENCE: f64 = 1e-5;
/// Exponents and directions of C that fits start from: about the mirror direction, nearer to the horizon and
/// to the normal, stretched either way, and back to the light.
const STARTS: [f64; 3] = [4.0, 20.0, 100.0];
const AXES: [[f64; 3]; 6] = [
    [-1.0, -1.0, 1.0],
    [-1.0, -1.0, 0.6],
    [-0.7, -0.7, 1.0],
    [-1.0, -0.6, 0.9],
    [-0.6, -1.0, 0.9],
    [1.0, 1.0, 1.0],
];

/// Pairs of a view and a light.
#[derive(Debug, Clone)]
pub struct Pairs {
    /// v ∘ l, and n·l.
    all: Vec<(DVec3, f64)>,
}

/// Direction of C as two angles, and ln n.
type Shape = [f64; 3];

fn axis([theta, phi, _]: Shape) -> DVec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// C with the largest component 1 or −1.
fn scaled(c: DVec3) -> DVec3 {
    c / c.abs().max_element()
}

fn exponent(s: Shape) -> f64 {
    s[2].exp().clamp(EXPONENT_RANGE[0], EXPONENT_RANGE[1])
}

/// Factors, and the residuals of the values with them.
struct Projected {
    factors: Vec<[f64; 3]>,
    rest: Vec<f64>,
    square: f64,
}

impl Pairs {
    /// Pairs of unit directions to viewers and lights above the surface.
    pub fn new(pairs: impl IntoIterator<Item = (DVec3, DVec3)>) -> Self {
        Self { all: pairs.into_iter().map(|(v, l)| (v * l, l.z)).collect() }
    }

    /// The lobe at all pairs; zeros where none sees more than [`SEEN`] of it, which says nothing of its
    /// factor.
    fn column(&self, s: Shape) -> Vec<f64> {
        let (c, n) = (scaled(axis(s)), exponent(s));
        let mut all: Vec<f64> = self.all.iter().map(|(p, z)| c.dot(*p).max(0.0).powf(n) * z).collect();
        if all.iter().all(|x| *x < SEEN) {
            all.fill(0.0);
        }
        all
    }

    /// The best factors of some lobes and the diffuse part.
    fn projected(&self, shapes: &[Shape], values: &[[f64; 3]]) -> Projected {
        let mut columns = vec![self.all.iter().map(|p| p.1).collect::<Vec<f64>>()];
        columns.extend(shapes.iter().map(|s| self.column(*s)));
        let n = columns.len();
        let norms: Vec<f64> =
            columns.iter().map(|c| c.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-150)).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let entry = |i: usize, j: usize| {
            let held = if i == j { 1e-12 } else { 0.0 };
            dot(&columns[i], &columns[j]) / (norms[i] * norms[j]) + held
        };
        let system: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect();
        let mut factors = vec![[0.0; 3]; n];
        for c in 0..3 {
            let side =
                |i: usize| columns[i].iter().zip(values).map(|(x, v)| x * v[c]).sum::<f64>() / norms[i];
            let found = nonnegative(&system, &(0..n).map(side).collect::<Vec<f64>>(), &vec![0.0; n]);
            factors.iter_mut().zip(found).zip(&norms).for_each(|((f, x), norm)| f[c] = x / norm);
        }
        let mut rest = Vec::with_capacity(3 * values.len());
        for (k, v) in values.iter().enumerate() {
            for c in 0..3 {
                rest.push(v[c] - columns.iter().zip(&factors).map(|(x, f)| x[k] * f[c]).sum::<f64>());
            }
        }
        let square = dot(&rest, &rest);
        Projected { factors, rest, square }
    }

    /// Damped steps from some shapes.
    fn refined(&self, mut shapes: Vec<Shape>, values: &[[f64; 3]]) -> Vec<Shape> {
        let n = 3 * shapes.len();
        let moved = |shapes: &[Shape], by: &[f64]| -> Vec<Shape> {
            let mut out = shapes.to_vec();
            out.iter_mut().flatten().zip(by).for_each(|(s, d)| *s += d);
            out
        };
        let mut now = self.projected(&shapes, values);
        let mut damping = 1e-3;
        for _ in 0..MAX_STEPS {
            let slope = |k: usize| -> Vec<f64> {
                let mut by = vec![0.0; n];
                by[k] = DIFFERENCE;
                let up = self.projected(&moved(&shapes, &by), values);
                by[k] = -DIFFERENCE;
                let down = self.projected(&moved(&shapes, &by), values);
                up.rest.iter().zip(&down.rest).map(|(a, b)| (a - b) / (2.0 * DIFFERENCE)).collect()
            };
            let slopes: Vec<Vec<f64>> = (0..n).map(slope).collect();
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
            let gram: Vec<Vec<f64>> =
                slopes.iter().map(|a| slopes.iter().map(|b| dot(a, b)).collect()).collect();
            let side: Vec<f64> = slopes.iter().map(|a| -dot(a, &now.rest)).collect();
            let before = now.square;
            while damping < 1e8 {
                let mut system = gram.clone();
                (0..n).for_each(|k| system[k][k] += damping * gram[k][k] + 1e-300);
                let step = Cholesky::new(&system).map(|c| c.solve(side.clone()));
                let Some(step) = step.filter(|s| s.iter().all(|x| x.is_finite())) else {
                    damping *= 10.0;
                    continue;
                };
                // Steps of more than a radian, or of a factor of e, are shortened to that.
                let most = step.iter().fold(1.0f64, |m, x| m.max(x.abs()));
                let step: Vec<f64> = step.iter().map(|x| x / most).collect();
                let mut next = moved(&shapes, &step);
                next.iter_mut()
                    .for_each(|s| s[2] = s[2].clamp(EXPONENT_RANGE[0].ln(), EXPONENT_RANGE[1].ln()));
                let then = self.projected(&next, values);
                if then.square < now.square {
                    (shapes, now) = (next, then);
                    damping = (0.2 * damping).max(1e-9);
                    break;
                }
                damping *= 5.0;
            }
            if before - now.square <= MIN_GAIN * before {
                break;
            }
        }
        shapes
    }

    /// The lobes of a texel from its f · ⟨n·l⟩ under every pair.
    pub fn fit(&self, values: &[[f64; 3]], lobes: usize) -> Texel {
        let mut shapes: Vec<Shape> = Vec::new();
        for _ in 0..lobes {
            let starts = AXES.iter().flat_map(|a| STARTS.iter().map(move |n| start(*a, *n)));
            let mut tried: Vec<(f64, Vec<Shape>)> = starts
                .map(|s| {
                    let all = [&shapes[..], &[s]].concat();
                    (self.projected(&all, values).square, all)
                })
                .collect();
            tried.sort_by(|a, b| a.0.total_cmp(&b.0));
            let best = tried.into_iter().take(3).map(|(_, all)| {
                let all = self.refined(all, values);
                (self.projected(&all, values).square, all)
            });
            shapes = best.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(shapes, |b| b.1);
        }
        let found = self.projected(&shapes, values);
        let lobe = |(s, rho): (&Shape, &[f64; 3])| Lobe { rho: *rho, c: scaled(axis(*s)), n: exponent(*s) };
        let lobes = shapes.iter().zip(&found.factors[1..]).map(lobe).collect();
        let rho_d = found.factors[0].map(|f| f * std::f64::consts::PI);
        let mut texel = Texel { rho_d, lobes, squares: [0.0; 2] };
        texel.squares = self.squares(&texel, values);
        texel
    }

    fn squares(&self, t: &Texel, values: &[[f64; 3]]) -> [f64; 2] {
        let (mut off, mut all) = (0.0, 0.0);
        for ((p, z), v) in self.all.iter().zip(values) {
            for c in 0..3 {
                let lobe = |l: &Lobe| l.rho[c] * l.c.dot(*p).max(0.0).powf(l.n);
                let f = t.rho_d[c] / std::f64::consts::PI + t.lobes.iter().map(lobe).sum::<f64>();
                off += (z * f - v[c]).powi(2);
                all += v[c] * v[c];
            }
        }
        [off, all]
    }
}

fn start([x, y, z]: [f64; 3], n: f64) -> Shape {
    let c = DVec3::new(x, y, z).normalize();
    [c.z.acos(), c.y.atan2(c.x), n.ln()]
}

/// The lobes of every texel of a bidirectional texture function. `go_on` is called before each; `None` once
/// it returns false. The bits do not depend on the number of threads.
pub fn of_btf(of: &Btf, lobes: usize, go_on: &(dyn Fn() -> bool + Sync)) -> Option<Vec<Texel>> {
    let (views, lights) = (of.views(), of.lights());
    let pairs = Pairs::new(views.iter().flat_map(|v| lights.iter().map(|l| (*v, *l))));
    let one = |x: usize| {
        if !go_on() {
            return None;
        }
        let value = |p: usize| {
            of.value(x, p / lights.len(), p % lights.len()).map(|b| f64::from(b) / std::f64::consts::PI)
        };
        let values: Vec<[f64; 3]> = (0..of.pairs()).map(value).collect();
        Some(pairs.fit(&values, lobes))
    };
    let all: Vec<Option<Texel>> = (0..of.texels()).into_par_iter().with_max_len(1).map(one).collect();
    all.into_iter().collect()
}

/// Relative RMS error over all texels and pairs.
pub fn error(texels: &[Texel]) -> f64 {
    let [off, all] = [0, 1].map(|k| texels.iter().map(|t| t.squares[k]).sum::<f64>());
    if all > 0.0 { (off / all).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::btf::spread;
    use std::f64::consts::PI;

    fn f_cos(t: &Texel, v: DVec3, l: DVec3) -> [f64; 3] {
        [0, 1, 2].map(|c| {
            let lobe = |k: &Lobe| k.rho[c] * (k.c * v).dot(l).max(0.0).powf(k.n);
            l.z * (t.rho_d[c] / PI + t.lobes.iter().map(lobe).sum::<f64>())
        })
    }

    fn same(a: &Lobe, b: &Lobe, within: f64) -> bool {
        let rho = a.rho.iter().zip(b.rho).all(|(a, b)| (a - b).abs() < within * b);
        rho && (a.c - b.c).length() < within && (a.n - b.n).abs() < within * b.n
    }

    fn texel(rho_d: [f64; 3], lobes: &[([f64; 3], [f64; 3], f64)]) -> Texel {
        let lobe = |(rho, c, n): &([f64; 3], [f64; 3], f64)| Lobe { rho: *rho, c: DVec3::from(*c), n: *n };
        Texel { rho_d, lobes: lobes.iter().map(lobe).collect(), squares: [0.0; 2] }
    }

    /// Planted lobes come back to 1e-4 of each number: Phong's, off-specular, anisotropic and backward ones,
    /// and two at once.
    #[test]
    fn planted_lobes_are_recovered() {
        let all = spread(41);
        let pairs: Vec<(DVec3, DVec3)> = all.iter().flat_map(|v| all.iter().map(|l| (*v, *l))).collect();
        let fit = Pairs::new(pairs.iter().copied());
        for planted in [
            texel([0.3, 0.2, 0.1], &[([0.5, 0.4, 0.2], [-1.0, -1.0, 1.0], 20.0)]),
            texel([0.1; 3], &[([0.5, 0.1, 0.2], [-0.9, -0.9, 1.0], 8.0)]),
            texel([0.4; 3], &[([1.0; 3], [-1.0, -0.7, 0.9], 35.0)]),
            texel([0.2; 3], &[([0.3; 3], [0.8, 0.8, 1.0], 5.0)]),
            texel(
                [0.2, 0.3, 0.4],
                &[([0.6; 3], [-1.0, -1.0, 0.95], 60.0), ([0.2, 0.1, 0.1], [-0.8, -0.8, 1.0], 6.0)],
            ),
        ] {
            let values: Vec<[f64; 3]> = pairs.iter().map(|(v, l)| f_cos(&planted, *v, *l)).collect();
            let found = fit.fit(&values, planted.lobes.len());
            assert!(error(std::slice::from_ref(&found)) < 1e-5, "{found:?}");
            for lobe in &planted.lobes {
                assert!(found.lobes.iter().any(|l| same(l, lobe, 1e-4)), "{lobe:?}: {found:?}");
            }
            assert!(
                found.rho_d.iter().zip(planted.rho_d).all(|(a, b)| (a - b).abs() < 1e-4 * b),
                "{found:?}"
            );
        }
    }

    /// Few pairs, most of which see nothing of a narrow lobe, and values that no lobe has.
    #[test]
    fn factors_of_lobes_that_hardly_any_pair_sees_stay_small() {
        let all = spread(6);
        let fit = Pairs::new(all.iter().flat_map(|v| all.iter().map(|l| (*v, *l))));
        for seed in 0..40 {
            let value = |k: usize| {
                [0, 1, 2].map(|c| (0.5 + 0.5 * ((seed * 97 + 7 * k + c) as f64 * 12.9898).sin()).powi(4))
            };
            let values: Vec<[f64; 3]> = (0..36).map(value).collect();
            for lobes in [1, 2] {
                let t = fit.fit(&values, lobes);
                let most = t.lobes.iter().flat_map(|l| l.rho).fold(0.0, f64::max);
                assert!(most < 2.0 / SEEN && t.squares[0] < t.squares[1], "{t:?}");
            }
        }
    }

    /// The same bits by one thread and by three.
    #[test]
    fn threads_change_nothing() {
        let all = spread(9);
        let value = |x: usize, v: usize, l: usize| {
            let h = (all[v] + all[l]).normalize();
            [0.2, 0.3, 0.4].map(|a| ((a + h.z.powi(8 + 5 * x as i32)) * all[l].z) as f32)
        };
        let btf = Btf::of((7, 5), &all, &all, value).expect("a function");
        let made = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| of_btf(&btf, 2, &|| true).expect("nobody stops it"))
        };
        let bits = |all: Vec<Texel>| -> Vec<u64> {
            let lobe = |l: &Lobe| [l.rho[0], l.rho[1], l.rho[2], l.c.x, l.c.y, l.c.z, l.n].map(f64::to_bits);
            let of = |t: &Texel| -> Vec<u64> {
                let own = t.rho_d.iter().chain(&t.squares).map(|x| x.to_bits());
                own.chain(t.lobes.iter().flat_map(lobe)).collect()
            };
            all.iter().flat_map(of).collect()
        };
        assert_eq!(bits(made(1)), bits(made(3)));
    }

    /// Texel by texel from pictures; a surface without a lobe has none; whatever is shown, more lobes do not
    /// err more.
    #[test]
    fn pictures_become_lobes_texel_by_texel() {
        let all = spread(21);
        let planted = |x: usize| {
            let n = 5.0 + 3.0 * x as f64;
            texel([0.1 * x as f64; 3], &[([0.5, 0.3, 0.1], [-1.0, -1.0 + 0.02 * x as f64, 0.9], n)])
        };
        let of = |x: usize, v: usize, l: usize| f_cos(&planted(x), all[v], all[l]).map(|f| (PI * f) as f32);
        let btf = Btf::of((2, 2), &all, &all, of).expect("a function");
        let found = of_btf(&btf, 1, &|| true).expect("nobody stops it");
        for (x, t) in found.iter().enumerate() {
            assert!(same(&t.lobes[0], &planted(x).lobes[0], 1e-4), "{x}: {t:?}");
            let off = t.rho_d.iter().zip(planted(x).rho_d).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-4, "{x}: {t:?}");
        }
        assert!(error(&found) < 1e-5);
        assert!(of_btf(&btf, 1, &|| false).is_none());
        let matte = Btf::of((1, 1), &all, &all, |_, _, l| [0.5 * all[l].z as f32; 3]).expect("a function");
        let t = &of_btf(&matte, 1, &|| true).expect("nobody stops it")[0];
        assert!((t.rho_d[0] - 0.5).abs() < 1e-4 && t.squares[0] < 1e-8 * t.squares[1], "{t:?}");
        let black = Btf::of((1, 1), &all, &all, |_, _, _| [0.0; 3]).expect("a function");
        let t = &of_btf(&black, 2, &|| true).expect("nobody stops it")[0];
        assert!(t.lobes.iter().all(|l| l.rho == [0.0; 3] && l.c.is_finite() && l.n.is_finite()));
        let bump = |_: usize, v: usize, l: usize| {
            let h = (all[v] + all[l]).normalize();
            [((0.3 + h.z.powi(30)) * all[l].z) as f32; 3]
        };
        let of = Btf::of((1, 1), &all, &all, bump).expect("a function");
        let errors = [0, 1, 2].map(|k| error(&of_btf(&of, k, &|| true).expect("nobody stops it")));
        assert!(errors[1] < 0.5 * errors[0] && errors[2] < errors[1], "{errors:?}");
    }
}
