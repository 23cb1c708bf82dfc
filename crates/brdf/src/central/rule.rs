//! The 7- and 15-point rules of Gauss and Kronrod as one list of nodes.

use crate::adaptive::{GAUSS, KRONROD, NODES};

/// Nodes per panel.
pub(super) const POINTS: usize = 15;

/// A node of a panel: where it lies, the weight of the 15-point rule, and that weight less the 7-point
/// rule's.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub at: f64,
    pub weight: f64,
    pub difference: f64,
}

/// The rule on [a, b], nodes ascending.
pub(super) fn nodes(a: f64, b: f64) -> [Node; POINTS] {
    let (middle, radius) = (0.5 * (a + b), 0.5 * (b - a));
    std::array::from_fn(|i| {
        let k = if i < 8 { i } else { 14 - i };
        let x = if i < 8 { -NODES[k] } else { NODES[k] };
        let gauss = if k % 2 == 1 { GAUSS[k / 2] } else { 0.0 };
        let difference = radius * (KRONROD[k] - gauss);
        Node { at: middle + radius * x, weight: radius * KRONROD[k], difference }
    })
}

/// Weights of the 15 nodes of −1 … 1 by which a polynomial through values there is evaluated at `x` (Berrut &
/// Trefethen 2004, the second form of the barycentric formula).
pub(super) fn interpolation(x: f64) -> [f64; POINTS] {
    static BARYCENTRIC: std::sync::OnceLock<[Node; POINTS]> = std::sync::OnceLock::new();
    // `weight` is 1/Π (x_i − x_j).
    let all = BARYCENTRIC.get_or_init(|| {
        let nodes = nodes(-1.0, 1.0);
        nodes.map(|node| {
            let others = nodes.iter().map(|n| node.at - n.at).filter(|d| *d != 0.0);
            Node { weight: 1.0 / others.product::<f64>(), ..node }
        })
    });
    if let Some(k) = all.iter().position(|node| node.at == x) {
        return std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
    }
    let parts = all.each_ref().map(|node| node.weight / (x - node.at));
    let total: f64 = parts.iter().sum();
    parts.map(|p| p / total)
}

/// The error of the 15-point rule from its difference to the 7-point rule: QUADPACK's scale (200
/// d/scale)^{3/2} (Piessens et al. 1983).
pub(super) fn error(difference: f64, scale: f64) -> f64 {
    if scale > 0.0 { difference.min(scale * (200.0 * difference / scale).powf(1.5)) } else { difference }
}

/// `a` … `b` in equal parts of at most `longest`.
pub(super) fn split(breaks: &[f64], longest: f64) -> Vec<[f64; 2]> {
    let mut panels = Vec::new();
    for w in breaks.windows(2) {
        let n = ((w[1] - w[0]) / longest).ceil().max(1.0) as usize;
        let at = |i: usize| if i == n { w[1] } else { w[0] + (w[1] - w[0]) * i as f64 / n as f64 };
        panels.extend((0..n).map(|i| [at(i), at(i + 1)]));
    }
    panels
}
