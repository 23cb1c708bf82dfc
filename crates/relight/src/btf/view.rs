//! Principal components of the pictures of each view.
//!
//! Sattler, Sarlette & Klein (2003), *Efficient and Realistic Visualization of Cloth*: the pictures of a
//! view, one for each light, are points; they are approximated by their mean and the first eigenvectors of
//! their covariance. With more texels than lights the eigenvectors follow from the pictures' scalar products.

use super::linear::{BLOCK, add, dot, products};
use super::{Btf, GoOn, Levels};
use steradian_numerics::eigen;
use steradian_parallel::prelude::*;

/// Pictures of each view.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Pictures of a view in addition to their mean.
    pub components: usize,
    /// Lights.
    pub lights: usize,
    /// Texels of all levels.
    pub texels: usize,
    /// `[view][mean, then components][texel][colour]`.
    pub pictures: Vec<f32>,
    /// Weights of the components, `[view][light][component]`.
    pub weights: Vec<f32>,
}

/// Compressed form of one view.
struct One {
    pictures: Vec<f32>,
    weights: Vec<f32>,
    error: f64,
}

impl View {
    /// The components of a function, and the squared error.
    pub(super) fn new(
        of: &Btf,
        levels: &Levels,
        components: usize,
        go_on: GoOn<'_>,
    ) -> Option<(Self, Vec<f64>)> {
        let (views, lights) = (of.views.len(), of.lights.len());
        let components = components.min(lights);
        let make = |v: usize| if go_on() { Some(one(of, levels, v, components)) } else { None };
        let all: Option<Vec<One>> =
            (0..views).into_par_iter().with_max_len(1).map(make).collect::<Vec<_>>().into_iter().collect();
        let all = all?;
        let error = all.iter().map(|o| o.error).sum();
        let (mut pictures, mut weights) = (Vec::new(), Vec::new());
        for o in all {
            pictures.extend(o.pictures);
            weights.extend(o.weights);
        }
        Some((Self { components, lights, texels: levels.all(), pictures, weights }, vec![error]))
    }

    /// Numbers that are kept of so many texels.
    pub(super) fn numbers(&self, texels: usize) -> f64 {
        let views = self.weights.len() / (self.lights * self.components).max(1);
        let views = if self.components == 0 { self.pictures.len() / (3 * self.texels) } else { views };
        (views * (self.components + 1) * 3 * texels + self.weights.len()) as f64
    }

    /// Where a view's picture begins.
    pub fn picture(&self, view: usize, k: usize) -> usize {
        (view * (self.components + 1) + k) * self.texels * 3
    }

    pub(super) fn decode(&self, texel: usize, view: usize, light: usize) -> [f32; 3] {
        let at = |k: usize, c: usize| self.pictures[self.picture(view, k) + 3 * texel + c];
        let w = &self.weights[(view * self.lights + light) * self.components..][..self.components];
        std::array::from_fn(|c| w.iter().zip(1..).map(|(w, k)| w * at(k, c)).sum::<f32>() + at(0, c))
    }
}

fn one(of: &Btf, levels: &Levels, view: usize, components: usize) -> One {
    let (texels, lights) = (of.texels(), of.lights.len());
    let n = 3 * texels;
    // Pictures, light after light, less their mean.
    let mut pictures = vec![0.0; lights * n];
    let mut row = vec![0.0; 3 * lights];
    let mut mean = vec![0.0f32; n];
    for x in 0..texels {
        of.part(x, 3 * view * lights, &mut row);
        for c in 0..3 {
            let sum: f64 = (0..lights).map(|l| f64::from(row[3 * l + c])).sum();
            let m = (sum / lights as f64) as f32;
            mean[3 * x + c] = m;
            (0..lights).for_each(|l| pictures[l * n + 3 * x + c] = row[3 * l + c] - m);
        }
    }
    let mut gram = vec![vec![0.0; lights]; lights];
    let mut block = Vec::new();
    for at in (0..n).step_by(BLOCK) {
        let to = (at + BLOCK).min(n);
        block.clear();
        (0..lights).for_each(|l| block.extend_from_slice(&pictures[l * n + at..l * n + to]));
        let p = products(&block, &block, to - at);
        gram.iter_mut()
            .zip(p.chunks_exact(lights))
            .for_each(|(g, p)| g.iter_mut().zip(p).for_each(|(g, p)| *g += p));
    }
    let pairs = eigen::symmetric(gram);
    let mut out =
        One { pictures: coarser(levels, mean), weights: vec![0.0; lights * components], error: 0.0 };
    for (k, (_, u)) in pairs.iter().take(components).enumerate() {
        let mut picture = vec![0.0; n];
        for (l, u) in u.iter().enumerate() {
            add(&mut picture, *u as f32, &pictures[l * n..][..n]);
            out.weights[l * components + k] = *u as f32;
        }
        // Subtracts the component. The eigenvectors are orthonormal, so scalar products of later ones with
        // the residual are those with the pictures.
        (0..lights)
            .for_each(|l| add(&mut pictures[l * n..][..n], -out.weights[l * components + k], &picture));
        out.pictures.extend(coarser(levels, picture));
    }
    out.error = dot(&pictures, &pictures);
    out
}

/// A picture, and its coarser levels behind it.
pub(super) fn coarser(levels: &Levels, mut picture: Vec<f32>) -> Vec<f32> {
    let per = picture.len() / levels.texels(0);
    for level in 1..levels.len() {
        for k in 0..levels.texels(level) {
            let at = picture.len();
            picture.resize(at + per, 0.0);
            for (from, w) in levels.covers(level, k) {
                (0..per).for_each(|c| picture[at + c] += w * picture[from * per + c]);
            }
        }
    }
    picture
}
