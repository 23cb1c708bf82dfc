//! Rings about an axis, and profiles over them.

use std::f64::consts::PI;
use steradian_sphere::quadrature::gauss_legendre;

/// Nodes of a panel: they integrate polynomials of degree 15 exactly.
pub(super) const NODES: usize = 8;
/// Factor by which panels grow from the axis on, up to [`MAX_WIDTH`]. 3 changes amplitudes by 4e-4 at most,
/// with 74 to 100 % of the rings.
const GROWTH: f64 = 1.5;
/// Widest panel, radians: where the horizon cuts a profile depends on the view. Half and twice change what is
/// left by 2e-4 of itself at most, with about twice and half as many rings.
const MAX_WIDTH: f64 = 0.1;

/// Angles ψ from an axis, 0 … π, in panels of Gauss–Legendre nodes, the narrower the nearer to the axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Rings {
    width: f64,
    edges: Vec<f64>,
    psi: Vec<f64>,
    /// 2π sin ψ dψ.
    weights: Vec<f64>,
}

impl Rings {
    /// Rings for profiles that vary over `width` radians near the axis.
    pub fn graded(width: f64) -> Self {
        let width = if width.is_finite() { width.clamp(1e-5, 1.0) } else { 1.0 };
        let (mut edges, mut step) = (vec![0.0], (0.5 * width).min(MAX_WIDTH));
        let mut at = step;
        while at < PI - 0.5 * step {
            edges.push(at);
            step = (GROWTH * step).min(MAX_WIDTH);
            at += step;
        }
        edges.push(PI);
        let (nodes, node_weights) = gauss_legendre(NODES);
        let (mut psi, mut weights) = (Vec::new(), Vec::new());
        for e in edges.windows(2) {
            let h = 0.5 * (e[1] - e[0]);
            for (z, w) in nodes.iter().zip(&node_weights) {
                psi.push(e[0] + h * (1.0 + z));
                weights.push(2.0 * PI * (e[0] + h * (1.0 + z)).sin() * h * w);
            }
        }
        Self { width, edges, psi, weights }
    }

    /// Width of the lobe that it was made for.
    pub fn width(&self) -> f64 {
        self.width
    }

    /// ψ of each ring, ascending.
    pub fn angles(&self) -> &[f64] {
        &self.psi
    }

    /// ∫ of a profile over the sphere.
    pub fn integral(&self, profile: &[f64]) -> f64 {
        self.weights.iter().zip(profile).map(|(w, p)| w * p).sum()
    }

    /// ∫ of the product of two profiles over the sphere.
    pub fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        self.weights.iter().zip(a).zip(b).map(|((w, a), b)| w * a * b).sum()
    }

    /// The angle within which `share` of a profile's magnitude lies.
    pub fn radius(&self, profile: &[f64], share: f64) -> f64 {
        let part = |(w, p): (&f64, &f64)| w * p.abs();
        let all: f64 = self.weights.iter().zip(profile).map(part).sum();
        let mut sum = 0.0;
        let beyond = self.weights.iter().zip(profile).map(part).position(|p| {
            sum += p;
            sum >= share * all
        });
        beyond.map_or(0.0, |i| self.psi[i])
    }

    /// The function through a profile's values.
    pub fn curve(&self, profile: &[f64]) -> Curve {
        let (nodes, weights) = gauss_legendre(NODES);
        let term = |v: &[f64]| {
            let mut c = [0.0; NODES];
            for ((z, w), v) in nodes.iter().zip(&weights).zip(v) {
                legendre(*z).iter().enumerate().for_each(|(l, p)| c[l] += (l as f64 + 0.5) * p * w * v);
            }
            c
        };
        let terms: Vec<_> = profile.chunks_exact(NODES).map(term).collect();
        let last = profile.iter().rposition(|v| *v != 0.0).map_or(0, |i| i / NODES + 1);
        Curve { support: self.edges[last], edges: self.edges.clone(), terms, width: self.width }
    }
}

/// A profile as a function: a polynomial of degree 7 in each panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    edges: Vec<f64>,
    terms: Vec<[f64; NODES]>,
    width: f64,
    support: f64,
}

impl Curve {
    /// The value at ψ, 0 … π.
    pub fn at(&self, psi: f64) -> f64 {
        self.place(psi).map_or(0.0, |place| self.there(&place))
    }

    /// The panel of ψ, and the polynomials there; `None` beyond the support.
    #[inline]
    pub(super) fn place(&self, psi: f64) -> Option<Place> {
        if !(0.0..=self.support).contains(&psi) || self.terms.is_empty() {
            return None;
        }
        let k = self.edges.partition_point(|e| *e <= psi).clamp(1, self.terms.len()) - 1;
        let (a, b) = (self.edges[k], self.edges[k + 1]);
        Some((k, legendre((2.0 * psi - a - b) / (b - a))))
    }

    /// The value at a place found by [`Curve::place`], which may be that of any curve over the same rings.
    #[inline]
    pub(super) fn there(&self, (k, p): &Place) -> f64 {
        self.terms[*k].iter().zip(p).map(|(c, p)| c * p).sum()
    }

    /// Ends of the panels.
    pub(super) fn edges(&self) -> &[f64] {
        &self.edges
    }

    /// Legendre coefficients of each panel.
    pub(super) fn terms(&self) -> &[[f64; NODES]] {
        &self.terms
    }

    /// The angle over which it varies near the axis.
    pub fn width(&self) -> f64 {
        self.width
    }

    /// Zero beyond this angle.
    pub fn support(&self) -> f64 {
        self.support
    }
}

/// A panel, and P_0 … P_7 at a place in it.
pub(super) type Place = (usize, [f64; NODES]);

/// P_0 … P_7 at z.
#[inline]
fn legendre(z: f64) -> [f64; NODES] {
    // (2l − 1)/l and (l − 1)/l.
    const A: [f64; NODES] = [0.0, 1.0, 1.5, 5.0 / 3.0, 1.75, 1.8, 11.0 / 6.0, 13.0 / 7.0];
    const B: [f64; NODES] = [0.0, 0.0, 0.5, 2.0 / 3.0, 0.75, 0.8, 5.0 / 6.0, 6.0 / 7.0];
    let mut p = [1.0; NODES];
    p[1] = z;
    for l in 2..NODES {
        p[l] = A[l] * z * p[l - 1] - B[l] * p[l - 2];
    }
    p
}
