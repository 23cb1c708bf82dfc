//! The two directions that a pair of light and view becomes.

use crate::shared::tables::hemisphere::{Azimuths, Map, Rows};
use glam::DVec3;
use steradian_brdf::Symmetry;

/// Choice of x and y.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// x = v, y = l.
    ViewLight,
    /// x = h, y = d: the light in a frame about h whose first axis is the tangent's part across h (Kautz &
    /// McCool 1999).
    HalfDifference,
    /// Half vector and difference for isotropic reflectance: x is the angle of h alone, and the first axis of
    /// d's frame lies in the plane of h and n, away from n (Rusinkiewicz 1998).
    IsotropicHalfDifference,
    /// x = h, y = v.
    HalfView,
}

/// The maps of x and y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinates {
    pub form: Form,
    pub x: Map,
    pub y: Map,
    /// Least n·l and n·v of a pair that enters the fit. A node closer to the horizon, where some models have
    /// no bound, has a cell that reaches below it, and would represent far more than the cell.
    pub lowest: f64,
}

/// Pairs whose light or view lies below the horizon have no reflectance. They get, with a negligible weight,
/// the reflectance of a pair whose cosines with the normal are both at least this.
const ABOVE: f64 = 0.05;
/// Least cosine of pairs that enter the fit, where cells reach below the horizon.
const LOWEST: f64 = 2e-3;

/// The pair of directions of a node of x and a node of y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    pub wi: DVec3,
    pub wo: DVec3,
    /// Weight of the squared error of f: (n·l)² dω_l dω_v; 0 where a direction lies below the horizon.
    pub weight: f64,
}

/// A node of a map.
#[derive(Debug, Clone, Copy)]
pub struct Node {
    pub direction: DVec3,
    pub solid_angle: f64,
}

impl Node {
    /// All nodes of a map.
    pub fn all(m: &Map) -> Vec<Self> {
        (0..m.len()).map(|k| Self { direction: m.direction(k), solid_angle: m.solid_angle(k) }).collect()
    }
}

impl Coordinates {
    /// Maps of about `side` × `side` nodes, as symmetry allows.
    pub fn new(form: Form, symmetry: Symmetry, side: usize) -> Self {
        use Azimuths::{Full, HalfTurn, Mirrored, One, Quarter};
        let Symmetry { isotropic: _, mirrored, reciprocal } = symmetry;
        let (x, y) = match form {
            Form::ViewLight => (Map::new(Full, Rows::Horizon, side), Map::new(Full, Rows::Horizon, side)),
            Form::HalfView => (Map::new(Full, Rows::Pole, side), Map::new(Full, Rows::Horizon, side)),
            Form::HalfDifference => {
                // A quarter of h has as many columns as half of d.
                let quarter = Map { width: side / 2 + 1, ..Map::new(Quarter, Rows::Pole, side) };
                let x = if mirrored { quarter } else { Map::new(Full, Rows::Pole, side) };
                (x, Map::new(if reciprocal { HalfTurn } else { Full }, Rows::Horizon, side))
            }
            Form::IsotropicHalfDifference => {
                let azimuths = match (mirrored, reciprocal) {
                    (true, true) => Quarter,
                    (true, false) => Mirrored,
                    (false, true) => HalfTurn,
                    (false, false) => Full,
                };
                (Map::new(One, Rows::Pole, 4 * side), Map::new(azimuths, Rows::Horizon, side))
            }
        };
        let lowest = if form == Form::ViewLight { 0.0 } else { LOWEST };
        Self { form, x, y, lowest }
    }

    /// Does exchanging light and view lead to the same node?
    fn exchanges(&self) -> bool {
        self.over_half() && matches!(self.y.azimuths, Azimuths::HalfTurn | Azimuths::Quarter)
    }

    /// Coordinates in the maps of x and y.
    #[inline(always)]
    pub fn places(&self, wi: [f32; 3], wo: [f32; 3]) -> [[f32; 2]; 2] {
        if self.form == Form::ViewLight {
            return [self.x.place(wo), self.y.place(wi)];
        }
        let sum: [f32; 3] = std::array::from_fn(|k| wi[k] + wo[k]);
        let across2 = sum[0] * sum[0] + sum[1] * sum[1];
        let (across, length) = (across2.sqrt(), (across2 + sum[2] * sum[2]).sqrt().max(1e-18));
        let scale = length.recip();
        let h = sum.map(|x| x * scale);
        let half = self.x.place_along(sum, across, length);
        // h·l, as |l + v| = 2 h·l.
        let up = (0.5 * length).min(1.0);
        match self.form {
            Form::HalfDifference => {
                let across = (1.0 - h[0] * h[0]).max(1e-12).sqrt().recip();
                let d = [(wi[0] - h[0] * up) * across, (h[2] * wi[1] - h[1] * wi[2]) * across];
                // Mirrors that bring h to the first quadrant.
                let side = |h: f32, d: f32| {
                    if self.x.azimuths == Azimuths::Quarter && h < 0.0 { -d } else { d }
                };
                [half, self.y.place([side(h[0], d[0]), side(h[1], d[1]), up])]
            }
            Form::IsotropicHalfDifference => {
                let sine = across * scale;
                let (c, s) = if sine > 1e-12 { (sum[0] / across, sum[1] / across) } else { (1.0, 0.0) };
                let (x, y) = (c * wi[0] + s * wi[1], c * wi[1] - s * wi[0]);
                [half, self.y.place([h[2] * x - sine * wi[2], y, up])]
            }
            Form::HalfView | Form::ViewLight => [half, self.y.place(wo)],
        }
    }

    /// Light and view of a node's x and y, either perhaps below the horizon.
    fn directions(&self, x: DVec3, y: DVec3) -> (DVec3, DVec3) {
        let about = |t: DVec3, b: DVec3| {
            let (up, side) = (y.z * x, y.x * t + y.y * b);
            (up + side, up - side)
        };
        match self.form {
            Form::ViewLight => (y, x),
            Form::HalfView => (2.0 * x.dot(y) * x - y, y),
            Form::HalfDifference => {
                let across = (1.0 - x.x * x.x).max(1e-24).sqrt();
                let t = DVec3::new(1.0 - x.x * x.x, -x.x * x.y, -x.x * x.z) / across;
                about(t, DVec3::new(0.0, x.z, -x.y) / across)
            }
            Form::IsotropicHalfDifference => about(DVec3::new(x.z, 0.0, -x.x.hypot(x.y)), DVec3::Y),
        }
    }

    /// Does the table hold f (h·l)² ([`Coordinates::over`])?
    pub fn over_half(&self) -> bool {
        matches!(self.form, Form::HalfDifference | Form::IsotropicHalfDifference)
    }

    /// Factor of f in the table at a node of y: (h·l)² over (h, d). Microfacets' f grows as its inverse where
    /// light and view are nearly opposite; with the factor the entries are smooth.
    pub fn over(&self, y: &Node) -> f64 {
        if self.over_half() { y.direction.z.powi(2) } else { 1.0 }
    }

    /// The pair of directions of a node of x and a node of y.
    pub fn pair(&self, of: &Node, with: &Node) -> Pair {
        let (x, y) = (of.direction, with.direction);
        let (wi, wo) = self.directions(x, y);
        // dω_l dω_v over dω_x dω_y.
        let jacobian = match self.form {
            Form::ViewLight => 1.0,
            Form::HalfView => 4.0 * x.dot(y),
            Form::HalfDifference | Form::IsotropicHalfDifference => 4.0 * y.z,
        };
        if wi.z > self.lowest && wo.z > self.lowest && jacobian > 0.0 {
            let cosine2 = if self.exchanges() { 0.5 * (wi.z * wi.z + wo.z * wo.z) } else { wi.z * wi.z };
            let weight = jacobian * cosine2 * of.solid_angle * with.solid_angle;
            return Pair { wi, wo, weight };
        }
        let (wi, wo) = self.above(x, y);
        Pair { wi, wo, weight: 0.0 }
    }

    /// A pair near that of x and y, with both directions above the horizon.
    fn above(&self, x: DVec3, y: DVec3) -> (DVec3, DVec3) {
        let least = ABOVE.min(0.5 * x.z);
        if self.over_half() {
            let mut d = y;
            for _ in 0..64 {
                // Towards h.
                d = DVec3::new(0.8 * d.x, 0.8 * d.y, d.z).normalize();
                let (wi, wo) = self.directions(x, d);
                if wi.z.min(wo.z) >= least {
                    return (wi, wo);
                }
            }
            return (x, x);
        }
        let (wi, wo) = self.directions(x, y);
        let lift = |w: DVec3| DVec3::new(w.x, w.y, w.z.max(ABOVE)).normalize();
        (lift(wi), lift(wo))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const FORMS: [Form; 4] =
        [Form::ViewLight, Form::HalfDifference, Form::IsotropicHalfDifference, Form::HalfView];

    fn symmetries() -> impl Iterator<Item = Symmetry> {
        [(true, true), (true, false), (false, true), (false, false)]
            .into_iter()
            .map(|(mirrored, reciprocal)| Symmetry { isotropic: true, mirrored, reciprocal })
    }

    /// A node's pair is looked up at the node.
    #[test]
    fn pairs_are_looked_up_where_they_stand() {
        for form in FORMS {
            for symmetry in symmetries() {
                let c = Coordinates::new(form, symmetry, 16);
                let (x, y) = (Node::all(&c.x), Node::all(&c.y));
                let mut seen = 0;
                for (i, j) in (0..c.x.len()).flat_map(|i| (0..c.y.len()).map(move |j| (i, j))) {
                    let p = c.pair(&x[i], &y[j]);
                    assert!(p.wi.z > 0.0 && p.wo.z > 0.0, "{form:?} {i} {j}: {p:?}");
                    // Where light and view are nearly opposite, single precision cannot determine h.
                    if p.weight == 0.0 || p.wi.dot(p.wo) < -0.99 {
                        continue;
                    }
                    seen += 1;
                    let single = |d: DVec3| d.as_vec3().to_array();
                    let at = c.places(single(p.wi), single(p.wo));
                    for (m, k, [u, v]) in [(c.x, i, at[0]), (c.y, j, at[1])] {
                        let (column, row) = (k % m.width, k / m.width);
                        let (x, y) = (u * (m.width - 1) as f32, v * (m.height - 1) as f32);
                        let end = row == 0 || row + 1 == m.height;
                        assert!((y - row as f32).abs() < if end { 0.3 } else { 2e-2 }, "{form:?} {row}: {y}");
                        // At poles any column is right, and circles are closed.
                        let closed = column % (m.width - 1).max(1) == 0;
                        assert!(end || closed || (x - column as f32).abs() < 2e-2, "{form:?} {column}: {x}");
                    }
                }
                assert!(seen > c.x.len() * c.y.len() / 20, "{form:?}: {seen}");
            }
        }
    }

    /// Σ (n·l)² dω_l dω_v is 2π/3 · 2π, whatever the coordinates, up to those that are folded.
    #[test]
    fn weights_are_the_measure_of_pairs() {
        for form in FORMS {
            for symmetry in symmetries() {
                let c = Coordinates::new(form, symmetry, 24);
                let (x, y) = (Node::all(&c.x), Node::all(&c.y));
                let all: f64 = x.iter().map(|x| y.iter().map(|y| c.pair(x, y).weight).sum::<f64>()).sum();
                let share = |m: Map| [1.0, 1.0, 0.5, 0.5, 0.25][m.azimuths as usize];
                let want = 4.0 * PI * PI / 3.0 * share(c.x) * share(c.y);
                assert!((all / want - 1.0).abs() < 0.03, "{form:?} {symmetry:?}: {all} {want}");
            }
        }
    }
}
