//! A chain of sums of products.
//!
//! Suykens, vom Berge, Lagae & Dutré (2003), *Interactive Rendering with Bidirectional Texture Functions*: the function is a sum of products of a
//! table over texel and half vector and one over the difference vector (Rusinkiewicz 1998: the light's direction in the frame of the half
//! vector), and what it leaves as a factor is chained to it, here one over the light:
//!
//! > B(x, v, l) ≈ R(l) Σ_j P_j(x, h) Q_j(d)
//!
//! Half and difference vectors are sorted into cells. P, Q and R are fitted in turns, each by least squares with the others fixed
//! (Gabriel & Zamir 1979), so that no step raises the error. The view is in h and d alone: where a bump hides a texel from one view and not
//! from another whose h and d lie in the same cells, the product has the mean of both.

use super::Btf;
use super::directions::around;
use super::levels::Levels;
use super::local::mixed;
use super::view::coarser;
use glam::DVec3;
use steradian_numerics::eigen;
use steradian_parallel::prelude::*;

/// Factors of a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Chained {
    /// Products that are added.
    pub terms: usize,
    /// Cells of half vectors.
    pub halves: usize,
    /// Cell of the half vector, and of the difference vector, of each pair, view after view.
    pub cells: Vec<[u32; 2]>,
    /// R, of each light.
    pub light: Vec<f32>,
    /// Q, `[difference][term]`.
    pub differences: Vec<f32>,
    /// P, `[texel of all levels][half][term][colour]`.
    pub texels: Vec<f32>,
}

/// Turns at most.
const ROUNDS: usize = 12;
/// Turns end where the squared error falls by less than this of it.
const GAIN: f64 = 1e-4;
/// Of the largest eigenvalue of a system, what a direction must have to be determined.
const RANK: f64 = 1e-12;

/// Σ over eigenvectors that are determined: the solution of least norm of a symmetric system.
fn solved(matrix: Vec<Vec<f64>>, sides: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let pairs = eigen::symmetric(matrix);
    let largest = pairs.first().map_or(0.0, |p| p.0);
    let one = |b: &Vec<f64>| {
        let mut out = vec![0.0; b.len()];
        for (value, u) in pairs.iter().filter(|p| p.0 > RANK * largest && p.0 > 0.0) {
            let along = u.iter().zip(b).map(|(u, b)| u * b).sum::<f64>() / value;
            out.iter_mut().zip(u).for_each(|(o, u)| *o += along * u);
        }
        out
    };
    sides.iter().map(one).collect()
}

/// About so many directions, evenly over the hemisphere.
fn cells(count: usize) -> Vec<DVec3> {
    (0..count)
        .map(|k| around((1.0 - (k as f64 + 0.5) / count as f64).acos(), 2.399_963_229_728_653 * k as f64))
        .collect()
}

/// Number of the cell whose direction is nearest.
fn nearest(cells: &[DVec3], d: DVec3) -> usize {
    let better = |a: usize, b: usize| if cells[b].dot(d) > cells[a].dot(d) { b } else { a };
    (1..cells.len()).fold(0, better)
}

/// Half vector, and the light's direction in its frame: turned by its azimuth and then down to the pole.
fn half_and_difference(v: DVec3, l: DVec3) -> (DVec3, DVec3) {
    let h = (v + l).normalize();
    let s = (h.x * h.x + h.y * h.y).sqrt();
    let t = if s > 1e-9 { DVec3::new(h.x * h.z / s, h.y * h.z / s, -s) } else { DVec3::X };
    let b = h.cross(t);
    (h, DVec3::new(l.dot(t), l.dot(b), l.dot(h)))
}

impl Chained {
    /// The factors of a function, and the squared errors after each step.
    pub(super) fn new(
        of: &Btf,
        levels: &Levels,
        [terms, halves, differences]: [usize; 3],
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<(Self, Vec<f64>)> {
        let (terms, lights) = (terms.max(1), of.lights.len());
        let (h_cells, d_cells) = (cells(halves.max(1)), cells(differences.max(1)));
        let of_pair = |p: usize| {
            let (h, d) = half_and_difference(of.views[p / lights], of.lights[p % lights]);
            [nearest(&h_cells, h) as u32, nearest(&d_cells, d) as u32]
        };
        let start = |k: usize| {
            if k.is_multiple_of(terms) {
                1.0
            } else {
                (mixed(k as u64) >> 40) as f32 / (1 << 23) as f32 - 1.0
            }
        };
        let mut out = Self {
            terms,
            halves: h_cells.len(),
            cells: (0..of.pairs()).map(of_pair).collect(),
            light: vec![1.0; lights],
            differences: (0..terms * d_cells.len()).map(start).collect(),
            texels: Vec::new(),
        };
        let energy = of.energy();
        let mut errors: Vec<f64> = Vec::new();
        let mut kept = None;
        for _ in 0..ROUNDS {
            if !go_on() {
                return None;
            }
            out.fit_texels(of);
            let moments = out.moments(of);
            let first = out.error(&moments, energy);
            // Rounding alone may raise it, once nothing is left to gain.
            if errors.last().is_some_and(|e| first > *e) {
                break;
            }
            kept = Some(out.clone());
            let before = errors.last().copied();
            errors.push(first);
            if before.is_some_and(|b| b - first < GAIN * first) {
                break;
            }
            out.fit_differences(&moments);
            out.fit_lights(&moments);
            errors.push(out.error(&moments, energy));
        }
        let mut out = kept?;
        errors.truncate(errors.len() - usize::from(errors.len().is_multiple_of(2)));
        out.texels = coarser(levels, out.texels);
        Some((out, errors))
    }

    /// Numbers that are kept of so many texels.
    pub(super) fn numbers(&self, texels: usize) -> f64 {
        (self.light.len() + self.differences.len() + 3 * texels * self.halves * self.terms) as f64
    }

    /// R(l) Q(d) of a pair.
    fn factors(&self, pair: usize, light: usize) -> impl Iterator<Item = f32> + '_ {
        let d = self.cells[pair][1] as usize;
        let r = self.light[light];
        self.differences[d * self.terms..][..self.terms].iter().map(move |q| r * q)
    }

    pub(super) fn decode(&self, texel: usize, pair: usize, light: usize) -> [f32; 3] {
        let h = self.cells[pair][0] as usize;
        let p = &self.texels[(texel * self.halves + h) * 3 * self.terms..][..3 * self.terms];
        let mut out = [0.0; 3];
        for (p, f) in p.chunks_exact(3).zip(self.factors(pair, light)) {
            (0..3).for_each(|c| out[c] += f * p[c]);
        }
        out
    }

    /// P, with Q and R fixed: the same small system for every texel and colour.
    fn fit_texels(&mut self, of: &Btf) {
        let (j, lights) = (self.terms, self.light.len());
        let mut members = vec![Vec::new(); self.halves];
        self.cells.iter().enumerate().for_each(|(p, c)| members[c[0] as usize].push(p));
        // What the value under each pair adds to the factors of its cell.
        let mut rules = vec![0.0f64; self.cells.len() * j];
        for pairs in &members {
            let rows: Vec<Vec<f64>> =
                pairs.iter().map(|p| self.factors(*p, p % lights).map(f64::from).collect()).collect();
            let system = (0..j).map(|a| (0..j).map(|b| rows.iter().map(|r| r[a] * r[b]).sum()).collect());
            let solutions = solved(system.collect(), &rows);
            pairs.iter().zip(solutions).for_each(|(p, s)| rules[p * j..][..j].copy_from_slice(&s));
        }
        let this = &*self;
        let texel = |x: usize| {
            let mut row = vec![0.0; of.dimension()];
            of.part(x, 0, &mut row);
            let mut sums = vec![0.0f64; this.halves * 3 * j];
            for (p, value) in row.chunks_exact(3).enumerate() {
                let to = &mut sums[this.cells[p][0] as usize * 3 * j..][..3 * j];
                for (to, rule) in to.chunks_exact_mut(3).zip(&rules[p * j..][..j]) {
                    (0..3).for_each(|c| to[c] += rule * f64::from(value[c]));
                }
            }
            sums.into_iter().map(|s| s as f32).collect::<Vec<f32>>()
        };
        let all: Vec<Vec<f32>> = (0..of.texels()).into_par_iter().map(texel).collect();
        self.texels = all.concat();
    }

    /// Sums over texels and colours with P fixed.
    fn moments(&self, of: &Btf) -> Moments {
        const TEXELS: usize = 64;
        let (j, texels) = (self.terms, of.texels());
        let own = self.halves * 3 * j;
        let some = |b: usize| {
            let mut sides = vec![0.0f64; self.cells.len() * j];
            let mut squares = vec![0.0f64; self.halves * j * j];
            let mut row = vec![0.0; of.dimension()];
            for x in b * TEXELS..((b + 1) * TEXELS).min(texels) {
                of.part(x, 0, &mut row);
                let factors = &self.texels[x * own..][..own];
                for (p, value) in row.chunks_exact(3).enumerate() {
                    let f = &factors[self.cells[p][0] as usize * 3 * j..][..3 * j];
                    for (to, f) in sides[p * j..][..j].iter_mut().zip(f.chunks_exact(3)) {
                        *to += (0..3).map(|c| f64::from(value[c]) * f64::from(f[c])).sum::<f64>();
                    }
                }
                for (h, f) in factors.chunks_exact(3 * j).enumerate() {
                    for a in 0..j {
                        for b in 0..j {
                            let of = |k: usize, c: usize| f64::from(f[3 * k + c]);
                            squares[(h * j + a) * j + b] += (0..3).map(|c| of(a, c) * of(b, c)).sum::<f64>();
                        }
                    }
                }
            }
            (sides, squares)
        };
        let mut all =
            Moments { sides: vec![0.0; self.cells.len() * j], squares: vec![0.0; self.halves * j * j] };
        // A few blocks at a time: each has sums for all pairs.
        let blocks: Vec<usize> = (0..texels.div_ceil(TEXELS)).collect();
        for group in blocks.chunks(32) {
            let sums: Vec<(Vec<f64>, Vec<f64>)> =
                group.par_iter().with_max_len(1).map(|b| some(*b)).collect();
            for (sides, squares) in sums {
                all.sides.iter_mut().zip(sides).for_each(|(a, s)| *a += s);
                all.squares.iter_mut().zip(squares).for_each(|(a, s)| *a += s);
            }
        }
        all
    }

    /// Q and R of a pair in double precision, and what they make of the squares of its cell and of its sides.
    fn quadratic(&self, m: &Moments, pair: usize) -> [f64; 2] {
        let j = self.terms;
        let [h, d] = self.cells[pair].map(|c| c as usize);
        let q: Vec<f64> = self.differences[d * j..][..j].iter().map(|q| f64::from(*q)).collect();
        let square = &m.squares[h * j * j..][..j * j];
        let two = (0..j).map(|a| (0..j).map(|b| q[a] * q[b] * square[a * j + b]).sum::<f64>()).sum();
        [two, m.sides[pair * j..][..j].iter().zip(&q).map(|(s, q)| s * q).sum()]
    }

    /// The squared error.
    fn error(&self, m: &Moments, energy: f64) -> f64 {
        let lights = self.light.len();
        let of = |p: usize| {
            let (r, [two, one]) = (f64::from(self.light[p % lights]), self.quadratic(m, p));
            r * r * two - 2.0 * r * one
        };
        (energy + (0..self.cells.len()).map(of).sum::<f64>()).max(0.0)
    }

    /// Q, with P and R fixed: a small system for each cell.
    fn fit_differences(&mut self, m: &Moments) {
        let (j, lights) = (self.terms, self.light.len());
        let mut members = vec![Vec::new(); self.differences.len() / j];
        self.cells.iter().enumerate().for_each(|(p, c)| members[c[1] as usize].push(p));
        for (d, pairs) in members.iter().enumerate().filter(|(_, pairs)| !pairs.is_empty()) {
            let (mut system, mut side) = (vec![vec![0.0; j]; j], vec![0.0; j]);
            for p in pairs {
                let (r, h) = (f64::from(self.light[p % lights]), self.cells[*p][0] as usize);
                for a in 0..j {
                    side[a] += r * m.sides[p * j + a];
                    (0..j).for_each(|b| system[a][b] += r * r * m.squares[(h * j + a) * j + b]);
                }
            }
            let found = solved(system, &[side]);
            self.differences[d * j..][..j].iter_mut().zip(&found[0]).for_each(|(q, x)| *q = *x as f32);
        }
    }

    /// R, with P and Q fixed: a number for each light.
    fn fit_lights(&mut self, m: &Moments) {
        let lights = self.light.len();
        for l in 0..lights {
            let (mut two, mut one) = (0.0, 0.0);
            for p in (l..self.cells.len()).step_by(lights) {
                let [a, b] = self.quadratic(m, p);
                two += a;
                one += b;
            }
            if two > 0.0 {
                self.light[l] = (one / two) as f32;
            }
        }
    }
}

/// Sums over texels x and colours: Σ B(x, p) P_j(x, h_p) of each pair, and Σ P_j(x, h) P_k(x, h) of each cell.
struct Moments {
    sides: Vec<f64>,
    squares: Vec<f64>,
}
