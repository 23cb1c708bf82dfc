//! A chain of sums of products.
//!
//! Suykens, vom Berge, Lagae & Dutré (2003), *Interactive Rendering with Bidirectional Texture Functions*:
//! the function is a sum of products of a table over texel and half vector and one over the difference vector
//! (Rusinkiewicz 1998: the light's direction in the frame of the half vector), and the remaining error is
//! modelled as a further factor chained to it, here one over the light:
//!
//! > B(x, v, l) ≈ R(l) Σ_j P_j(x, h) Q_j(d)
//!
//! P and Q are tables over directions, interpolated with barycentric weights ([`super::Net`]). P, Q and R are
//! fitted in turns, each by least squares with the other two fixed (Gabriel & Zamir 1979) and weakly held to
//! its previous values (Rockafellar 1976), so that no step raises the error. The view is in h and d alone:
//! where a bump hides a texel from one view and not from another of nearly the same h and d, the product has
//! the mean of both.

use super::directions::around;
use super::levels::Levels;
use super::local::mixed;
use super::net::Net;
use super::view::coarser;
use super::{Btf, GoOn};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use steradian_numerics::dense::Cholesky;
use steradian_parallel::prelude::*;

/// Three directions of a table around one, and their weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corners {
    /// The directions.
    pub of: [u32; 3],
    /// Weights of these, which sum to 1.
    pub weights: [f32; 3],
}

impl Corners {
    fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.of.iter().zip(self.weights).map(|(k, w)| (*k as usize, f64::from(w)))
    }
}

/// Factors of a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Chained {
    /// Products that are added.
    pub terms: usize,
    /// Directions of half vectors.
    pub halves: usize,
    /// Directions of difference vectors.
    pub differences: usize,
    /// Table entries around the half vector of each pair, and weights, view after view.
    pub places: Vec<Corners>,
    /// R, of each light.
    pub light: Vec<f32>,
    /// Q at the difference vector of each pair, `[pair][term]`.
    pub factors: Vec<f32>,
    /// P, `[texel of all levels][half][term][colour]`.
    pub texels: Vec<f32>,
}

/// State of the fit other than P.
struct Fit<'a> {
    of: &'a Btf,
    terms: usize,
    halves: usize,
    /// Half and difference vectors of pairs.
    places: Vec<[Corners; 2]>,
    light: Vec<f64>,
    /// Q, `[difference][term]`.
    differences: Vec<f64>,
    /// P, `[texel][half][term][colour]`.
    texels: Vec<f32>,
}

/// Most rounds.
const MAX_ROUNDS: usize = 24;
/// Relative decrease of the squared error at which rounds end.
const GAIN: f64 = 1e-3;
/// Weight that holds a table to its previous values, relative to the mean of its system's diagonal.
const HELD: f64 = 1e-7;

/// A spiral of golden angles (Vogel 1979) over the hemisphere, at these angles from the normal.
fn spiral(count: usize, theta: impl Fn(f64) -> f64) -> Vec<DVec3> {
    let one = |k: usize| around(theta((k as f64 + 0.5) / count as f64), 2.399_963_229_728_653 * k as f64);
    (0..count).map(one).collect()
}

/// Half vectors of a table, in equal steps of the angle from the normal: most pairs' lie near it, where
/// highlights are. With 21 of them in equal solid angles the error for GGX of width 0.4 on a plane is 22 %,
/// with these 8 %.
fn half_vectors(count: usize) -> Vec<DVec3> {
    spiral(count, |u| FRAC_PI_2 * u)
}

/// Difference vectors of a table, in equal solid angles.
fn difference_vectors(count: usize) -> Vec<DVec3> {
    spiral(count, |u| (1.0 - u).acos())
}

/// Half vector, and the light's direction in its frame: turned by its azimuth and then down to the pole.
fn half_and_difference(v: DVec3, l: DVec3) -> (DVec3, DVec3) {
    let h = (v + l).normalize();
    let s = (h.x * h.x + h.y * h.y).sqrt();
    let t = if s > 1e-9 { DVec3::new(h.x * h.z / s, h.y * h.z / s, -s) } else { DVec3::X };
    let b = h.cross(t);
    (h, DVec3::new(l.dot(t), l.dot(b), l.dot(h)))
}

/// Factorises a symmetric system with the weight of the previous values; returns that weight too.
fn held(mut system: Vec<Vec<f64>>) -> Option<(Cholesky, f64)> {
    let n = system.len();
    let trace: f64 = (0..n).map(|k| system[k][k]).sum();
    let by = HELD * trace / n as f64;
    (0..n).for_each(|k| system[k][k] += by);
    Some((Cholesky::new(&system)?, by))
}

impl Chained {
    /// The factors of a function, and the squared errors after each step.
    pub(super) fn new(
        of: &Btf,
        levels: &Levels,
        [terms, halves, differences]: [usize; 3],
        go_on: GoOn<'_>,
    ) -> Option<(Self, Vec<f64>)> {
        let mut fit = Fit::new(of, [terms.max(1), halves.max(1), differences.max(1)]);
        let energy = of.energy();
        let mut errors: Vec<f64> = Vec::new();
        let mut kept = None;
        for _ in 0..MAX_ROUNDS {
            fit.fit_texels(go_on);
            let moments = fit.moments(go_on);
            if !go_on() {
                return None;
            }
            let first = fit.error(&moments, energy);
            // Rounding alone may raise it, once nothing is left to gain.
            if errors.last().is_some_and(|e| first > *e) {
                break;
            }
            kept = Some((fit.light.clone(), fit.factors(), fit.texels.clone()));
            let before = errors.last().copied();
            errors.push(first);
            if before.is_some_and(|b| b - first < GAIN * first) {
                break;
            }
            fit.fit_differences(&moments);
            fit.fit_lights(&moments);
            errors.push(fit.error(&moments, energy));
        }
        let (light, factors, texels) = kept?;
        errors.truncate(errors.len() - usize::from(errors.len().is_multiple_of(2)));
        let out = Self {
            terms: fit.terms,
            halves: fit.halves,
            differences: fit.differences.len() / fit.terms,
            places: fit.places.iter().map(|p| p[0]).collect(),
            light: light.into_iter().map(|x| x as f32).collect(),
            factors,
            texels: coarser(levels, texels),
        };
        Some((out, errors))
    }

    /// Numbers that are kept of so many texels.
    pub(super) fn numbers(&self, texels: usize) -> f64 {
        (self.light.len() + self.terms * (self.differences + 3 * texels * self.halves)) as f64
    }

    pub(super) fn decode(&self, texel: usize, pair: usize, light: usize) -> [f32; 3] {
        let place = &self.places[pair];
        let q = &self.factors[pair * self.terms..][..self.terms];
        let mut out = [0.0; 3];
        for (h, w) in place.of.iter().zip(place.weights) {
            let first = (texel * self.halves + *h as usize) * 3 * self.terms;
            for (p, q) in self.texels[first..].chunks_exact(3).zip(q) {
                (0..3).for_each(|c| out[c] += w * q * p[c]);
            }
        }
        out.map(|x| self.light[light] * x)
    }
}

impl<'a> Fit<'a> {
    fn new(of: &'a Btf, [terms, halves, differences]: [usize; 3]) -> Self {
        let lights = of.lights.len();
        let nets = [half_vectors(halves), difference_vectors(differences)].map(|all| Net::new(&all));
        let place = |p: usize| {
            let (h, d) = half_and_difference(of.views[p / lights], of.lights[p % lights]);
            let corners = |net: &Net, d: DVec3| {
                let (of, weights) = net.around(d.as_vec3().to_array());
                Corners { of, weights }
            };
            [corners(&nets[0], h), corners(&nets[1], d)]
        };
        let start = |k: usize| match k % terms {
            0 => 1.0,
            _ => (mixed(k as u64) >> 11) as f64 / (1u64 << 52) as f64 - 1.0,
        };
        Self {
            of,
            terms,
            halves,
            places: (0..of.pairs()).map(place).collect(),
            light: brightness(of),
            differences: (0..terms * differences).map(start).collect(),
            texels: vec![0.0; of.texels() * halves * terms * 3],
        }
    }

    /// Q at a pair.
    fn factors_at(&self, pair: usize) -> Vec<f64> {
        let j = self.terms;
        let mut out = vec![0.0; j];
        for (d, u) in self.places[pair][1].iter() {
            out.iter_mut().zip(&self.differences[d * j..]).for_each(|(o, q)| *o += u * q);
        }
        out
    }

    /// Q at all pairs.
    fn factors(&self) -> Vec<f32> {
        (0..self.places.len()).flat_map(|p| self.factors_at(p)).map(|q| q as f32).collect()
    }

    /// Fits P with Q and R fixed: one system for every texel and colour.
    fn fit_texels(&mut self, go_on: GoOn<'_>) {
        let (j, lights, n) = (self.terms, self.light.len(), self.halves * self.terms);
        // R(l) Q(d) of each pair.
        let scaled: Vec<f64> = (0..self.places.len())
            .flat_map(|p| {
                let r = self.light[p % lights];
                self.factors_at(p).into_iter().map(move |q| r * q)
            })
            .collect();
        let mut system = vec![vec![0.0f64; n]; n];
        for (place, f) in self.places.iter().zip(scaled.chunks_exact(j)) {
            for (a, w) in place[0].iter() {
                for (b, u) in place[0].iter() {
                    for (i, x) in f.iter().enumerate() {
                        let row = &mut system[a * j + i][b * j..][..j];
                        row.iter_mut().zip(f).for_each(|(to, y)| *to += w * u * x * y);
                    }
                }
            }
        }
        let Some((cholesky, by)) = held(system) else { return };
        // Columns of the inverse, which is symmetric.
        let unit = |k: usize| (0..n).map(|i| f64::from(u8::from(i == k))).collect();
        let inverse: Vec<Vec<f64>> = (0..n).into_par_iter().map(|k| cholesky.solve(unit(k))).collect();
        let mut texels = std::mem::take(&mut self.texels);
        let this = &*self;
        let texel = |(x, own): (usize, &mut [f32])| {
            if !go_on() {
                return;
            }
            let mut row = vec![0.0; this.of.dimension()];
            this.of.part(x, 0, &mut row);
            let mut sides: Vec<[f64; 3]> =
                own.chunks_exact(3).map(|p| [0, 1, 2].map(|c| by * f64::from(p[c]))).collect();
            for (p, value) in row.chunks_exact(3).enumerate() {
                for (h, w) in this.places[p][0].iter() {
                    let value = [0, 1, 2].map(|c| w * f64::from(value[c]));
                    for (to, f) in sides[h * j..].iter_mut().zip(&scaled[p * j..][..j]) {
                        (0..3).for_each(|c| to[c] += f * value[c]);
                    }
                }
            }
            for (to, row) in own.chunks_exact_mut(3).zip(&inverse) {
                let mut sum = [0.0; 3];
                for (a, s) in row.iter().zip(&sides) {
                    (0..3).for_each(|c| sum[c] += a * s[c]);
                }
                (0..3).for_each(|c| to[c] = sum[c] as f32);
            }
        };
        texels.par_chunks_exact_mut(3 * n).enumerate().for_each(texel);
        self.texels = texels;
    }

    /// Sums over texels and colours with P fixed.
    fn moments(&self, go_on: GoOn<'_>) -> Moments {
        // A block has sums of its own, terms for each pair, which are added in order whatever the threads:
        // with so many texels that costs a 64th of what they do.
        const BLOCK_TEXELS: usize = 64;
        let (j, n, texels) = (self.terms, self.halves * self.terms, self.of.texels());
        let some = |b: usize| {
            let mut sides = vec![0.0f64; self.places.len() * j];
            let mut gram = vec![0.0f64; n * n];
            let mut row = vec![0.0; self.of.dimension()];
            for x in b * BLOCK_TEXELS..((b + 1) * BLOCK_TEXELS).min(texels) {
                self.of.part(x, 0, &mut row);
                let own = &self.texels[x * 3 * n..][..3 * n];
                for (p, value) in row.chunks_exact(3).enumerate() {
                    let to = &mut sides[p * j..][..j];
                    for (h, w) in self.places[p][0].iter() {
                        for (to, f) in to.iter_mut().zip(own[3 * h * j..].chunks_exact(3)) {
                            *to += w * (0..3).map(|c| f64::from(value[c]) * f64::from(f[c])).sum::<f64>();
                        }
                    }
                }
                for c in 0..3 {
                    let one: Vec<f64> = own.iter().skip(c).step_by(3).map(|p| f64::from(*p)).collect();
                    for (to, a) in gram.chunks_exact_mut(n).zip(&one) {
                        to.iter_mut().zip(&one).for_each(|(to, b)| *to += a * b);
                    }
                }
            }
            (sides, gram)
        };
        let (mut sides, mut gram) = (vec![0.0; self.places.len() * j], vec![0.0; n * n]);
        // A few blocks at a time: each has sums for all pairs.
        let blocks: Vec<usize> = (0..texels.div_ceil(BLOCK_TEXELS)).collect();
        for group in blocks.chunks(32).take_while(|_| go_on()) {
            let sums: Vec<(Vec<f64>, Vec<f64>)> =
                group.par_iter().with_max_len(1).map(|b| some(*b)).collect();
            for (s, g) in sums {
                sides.iter_mut().zip(s).for_each(|(a, s)| *a += s);
                gram.iter_mut().zip(g).for_each(|(a, g)| *a += g);
            }
        }
        let mut squares = vec![0.0; self.places.len() * j * j];
        for (place, to) in self.places.iter().zip(squares.chunks_exact_mut(j * j)) {
            for (a, w) in place[0].iter() {
                for (b, u) in place[0].iter() {
                    for (k, to) in to.iter_mut().enumerate() {
                        *to += w * u * gram[(a * j + k / j) * n + b * j + k % j];
                    }
                }
            }
        }
        Moments { sides, squares }
    }

    /// Quadratic and linear form of a pair's Q: with the squares and with the right-hand sides.
    fn quadratic(&self, m: &Moments, pair: usize) -> [f64; 2] {
        let (j, q) = (self.terms, self.factors_at(pair));
        let square = &m.squares[pair * j * j..][..j * j];
        let two = (0..j).map(|a| (0..j).map(|b| q[a] * q[b] * square[a * j + b]).sum::<f64>()).sum();
        [two, m.sides[pair * j..][..j].iter().zip(&q).map(|(s, q)| s * q).sum()]
    }

    /// The squared error.
    fn error(&self, m: &Moments, energy: f64) -> f64 {
        let lights = self.light.len();
        let of = |p: usize| {
            let (r, [two, one]) = (self.light[p % lights], self.quadratic(m, p));
            r * r * two - 2.0 * r * one
        };
        (energy + (0..self.places.len()).map(of).sum::<f64>()).max(0.0)
    }

    /// Q, with P and R fixed.
    fn fit_differences(&mut self, m: &Moments) {
        let (j, lights, n) = (self.terms, self.light.len(), self.differences.len());
        let (mut system, mut side) = (vec![vec![0.0; n]; n], vec![0.0; n]);
        for (p, [_, place]) in self.places.iter().enumerate() {
            let r = self.light[p % lights];
            for (a, w) in place.iter() {
                for i in 0..j {
                    side[a * j + i] += r * w * m.sides[p * j + i];
                    for (b, u) in place.iter() {
                        let squares = &m.squares[(p * j + i) * j..][..j];
                        let row = &mut system[a * j + i][b * j..][..j];
                        row.iter_mut().zip(squares).for_each(|(to, s)| *to += r * r * w * u * s);
                    }
                }
            }
        }
        let Some((cholesky, by)) = held(system) else { return };
        side.iter_mut().zip(&self.differences).for_each(|(s, q)| *s += by * q);
        self.differences = cholesky.solve(side);
    }

    /// R, with P and Q fixed: a number for each light.
    fn fit_lights(&mut self, m: &Moments) {
        let lights = self.light.len();
        for l in 0..lights {
            let (mut two, mut one) = (0.0, 0.0);
            for p in (l..self.places.len()).step_by(lights) {
                let [a, b] = self.quadratic(m, p);
                two += a;
                one += b;
            }
            if two > 0.0 {
                self.light[l] = one / two;
            }
        }
    }
}

/// Sum over texels, views and colours under each light, over the largest; 1 where there is none.
fn brightness(of: &Btf) -> Vec<f64> {
    let lights = of.lights.len();
    let one = |x: usize| {
        let (mut row, mut sums) = (vec![0.0; of.dimension()], vec![0.0f64; lights]);
        of.part(x, 0, &mut row);
        for (p, value) in row.chunks_exact(3).enumerate() {
            sums[p % lights] += value.iter().map(|v| f64::from(*v)).sum::<f64>();
        }
        sums
    };
    let all: Vec<Vec<f64>> = (0..of.texels()).into_par_iter().map(one).collect();
    let mut sums = vec![0.0; lights];
    all.iter().for_each(|s| sums.iter_mut().zip(s).for_each(|(a, s)| *a += s));
    let largest = sums.iter().fold(0.0f64, |m, s| m.max(*s));
    sums.into_iter().map(|s| if s > 0.0 { s / largest } else { 1.0 }).collect()
}

/// Sums over texels x and colours of each pair p, P taken at its half vector: Σ B(x, p) P_j(x), and Σ P_j(x)
/// P_k(x).
struct Moments {
    sides: Vec<f64>,
    squares: Vec<f64>,
}
