//! Which elevations become nodes, and each node's orders and resolution.

use super::material::{CANDIDATES, Params};
use crate::shared::meter::{self, Meter};
use std::f64::consts::PI;
use steradian_base::{Certificate, Known};
use steradian_brdf::central::{Centre, Slices};

/// A slice that gets maps.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Its place among the candidates.
    pub candidate: usize,
    /// F.
    pub f: usize,
    /// Q.
    pub q: usize,
    /// Intervals from pole to pole.
    pub size: usize,
}

impl Node {
    /// Bytes of its maps.
    pub fn bytes(&self) -> usize {
        (self.size + 1) * 2 * self.size * 3 * 4 * (2 * self.q + 1)
    }
}

/// Slices with albedo and kernels κ = k/albedo, and the light to measure them with.
pub struct Scaled<'a> {
    s: &'a Slices,
    meter: &'a Meter,
    /// The albedo, or 1.
    pub scale: Vec<[f64; 3]>,
    /// Mean square radiance.
    total: Vec<f64>,
}

/// Shares of the squared tolerance that interpolation, Q, F and lookups may use.
const SHARES: [f64; 4] = [0.45, 0.1, 0.1, 0.15];

impl<'a> Scaled<'a> {
    pub fn new(s: &'a Slices, meter: &'a Meter) -> Self {
        let albedo = |i: usize| s.row(i, 0).map(|r| r[0] * (4.0 * PI).sqrt());
        let most = (0..s.slices.len()).flat_map(albedo).fold(0.0, f64::max);
        let scale = (0..s.slices.len()).map(|i| albedo(i).map(|a| if a > 1e-6 * most { a } else { 1.0 }));
        let total = (0..s.slices.len()).map(|i| meter.slice(s, i)).collect();
        Self { s, meter, scale: scale.collect(), total }
    }

    /// κ_lq of a candidate.
    pub fn kappa(&self, i: usize, q: usize, c: usize) -> Vec<f64> {
        self.s.row(i, q)[c].iter().map(|k| k / self.scale[i][c]).collect()
    }

    /// Mean square of candidate i less its interpolation between `a` and `b`, each cut at its node's orders (none: as
    /// they are), with the mean square of the maps' lookup errors.
    fn error(&self, i: usize, ends: [(usize, Option<&Node>); 2]) -> f64 {
        let [a, b] = ends.map(|e| e.0);
        let t = if b > a { (i - a) as f64 / (b - a) as f64 } else { 0.0 };
        let mut sum = 0.0;
        for q in 0..=self.s.azimuth {
            let (x, y, z) = (self.s.row(i, q), self.s.row(a, q), self.s.row(b, q));
            for c in 0..3 {
                let own = self.scale[i][c];
                let factor = [(1.0 - t) * own / self.scale[a][c], t * own / self.scale[b][c]];
                let kept = |end: usize, l: usize| ends[end].1.is_none_or(|n| q <= n.q && l <= n.f);
                let made = |l: usize| {
                    let ends = [y[c][l], z[c][l]];
                    (0..2).filter(|e| kept(*e, l)).map(|e| factor[e] * ends[e]).sum::<f64>()
                };
                sum += self.meter.row(c, q, (0..=self.s.order).map(|l| x[c][l] - made(l)));
                for (end, row) in [y, z].iter().enumerate() {
                    let Some(n) = ends[end].1.filter(|n| q <= n.q) else { continue };
                    let h = PI / n.size as f64;
                    let blur = |l: usize| factor[end] * row[c][l] * meter::lookup(l, h).sqrt();
                    sum += self.meter.row(c, q, (0..=n.f).map(blur));
                }
            }
        }
        sum
    }

    /// Nodes so far apart that all candidates between them are interpolated within `most` of their mean square.
    fn nodes(&self, most: f64) -> Vec<usize> {
        let last = self.s.slices.len() - 1;
        let fits = |a: usize, b: usize| {
            (a + 1..b).all(|i| self.error(i, [(a, None), (b, None)]) <= most * self.total[i])
        };
        let mut nodes = vec![0];
        let mut a = 0;
        while a < last {
            // As far as it goes in steps that double, then back.
            let mut good = a + 1;
            let mut step = 1;
            while step > 0 {
                let b = (good + step).min(last);
                if b > good && fits(a, b) {
                    good = b;
                    step *= 2;
                } else {
                    step /= 2;
                }
            }
            nodes.push(good);
            a = good;
        }
        nodes
    }

    /// Orders and resolution of a node.
    fn node(&self, i: usize, tolerance: f64, p: &Params) -> Node {
        let power = |q: usize, from: usize, blur: &dyn Fn(usize) -> f64| {
            let row = self.s.row(i, q);
            let one = |c: usize| {
                let k = row[c].iter().enumerate();
                self.meter.row(c, q, k.map(|(l, k)| if l < from { 0.0 } else { k * blur(l) }))
            };
            (0..3).map(one).sum::<f64>()
        };
        let whole = |_: usize| 1.0;
        let budget = |share: f64| share * tolerance * tolerance * self.total[i];
        let rows: Vec<f64> = (0..=self.s.azimuth).map(|q| power(q, 0, &whole)).collect();
        let beyond = |q: usize| rows[q + 1..].iter().sum::<f64>();
        let q = (0..=self.s.azimuth).find(|q| beyond(*q) <= budget(SHARES[1])).unwrap_or(self.s.azimuth);
        let cut = |f: usize| (0..=q).map(|q| power(q, f + 1, &whole)).sum::<f64>();
        let f = (0..=self.s.order).find(|f| cut(*f) <= budget(SHARES[2])).unwrap_or(self.s.order);
        let f = p.order.map_or(f, |o| o.min(self.s.order));
        let enough = |size: usize| {
            let h = PI / size as f64;
            let blur = |l: usize| if l > f { 0.0 } else { meter::lookup(l, h).sqrt() };
            (0..=q).map(|q| power(q, 0, &blur)).sum::<f64>() <= budget(SHARES[3])
        };
        let size = if p.size > 0 { p.size.max(4) } else { meter::size(512, enough).max(8) };
        Node { candidate: i, f, q, size }
    }

    /// All nodes within `allowed` bytes.
    pub fn choose(&self, tolerance: f64, p: &Params, allowed: usize) -> Vec<Node> {
        let candidates = self.nodes(SHARES[0] * tolerance * tolerance);
        let mut nodes: Vec<Node> = candidates.iter().map(|&i| self.node(i, tolerance, p)).collect();
        while nodes.iter().map(Node::bytes).sum::<usize>() > allowed {
            let largest = nodes.iter().map(|n| n.size).max().unwrap_or(0);
            if largest <= 8 {
                break;
            }
            nodes.iter_mut().filter(|n| n.size == largest).for_each(|n| n.size = (n.size / 4 * 3).max(8));
        }
        nodes
    }

    /// The error of every elevation and of their mean.
    pub fn certify(&self, nodes: &[Node]) -> Certificate {
        let around = |i: usize| {
            let b = nodes.partition_point(|n| n.candidate < i).clamp(1, nodes.len().max(2) - 1);
            let (a, b) = (&nodes[b - 1], &nodes[b.min(nodes.len() - 1)]);
            [(a.candidate, Some(a)), (b.candidate, Some(b))]
        };
        let square = |i: usize| self.error(i, around(i)) + self.meter.tail(self.s, i);
        let squares: Vec<f64> = (0..CANDIDATES).map(square).collect();
        let tangent = self.s.centre == Centre::Tangent;
        let angle = |i: usize| if tangent { self.s.slices[i].theta_o() } else { self.s.slices[i].theta_v };
        let cosine = |i: usize| angle(i).cos();
        let (mut error, mut exact) = (0.0, 0.0);
        for i in 0..CANDIDATES {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(CANDIDATES - 1));
            let weight = 0.5 * (cosine(before) - cosine(after));
            (error, exact) = (error + weight * squares[i], exact + weight * self.total[i]);
        }
        let ratio = |e: f64, x: f64| if x > 0.0 { (e / x).sqrt() } else { 0.0 };
        let mut c =
            Certificate::new(ratio(error, exact), Known::Estimated).metric(crate::shared::shrm::METRIC);
        for degrees in [0, 10, 20, 30, 40, 50, 60, 65, 70, 75, 80, 85, 88] {
            let off = |i: &usize| (angle(*i) - f64::from(degrees).to_radians()).abs();
            if let Some(i) = (0..CANDIDATES).min_by(|a, b| off(a).total_cmp(&off(b))) {
                c = c.detail(format!("error at {degrees} degrees"), ratio(squares[i], self.total[i]));
            }
        }
        let most = |of: &dyn Fn(&Node) -> usize| nodes.iter().map(of).max().unwrap_or(0) as f64;
        c.detail("slices", nodes.len() as f64)
            .detail("maps", nodes.iter().map(|n| 2 * n.q + 1).sum::<usize>() as f64)
            .detail("highest F", most(&|n| n.f))
            .detail("highest Q", most(&|n| n.q))
            .detail("largest size", most(&|n| n.size))
            .detail("bytes", nodes.iter().map(Node::bytes).sum::<usize>() as f64)
    }
}
