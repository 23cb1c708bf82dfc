//! Directions of light and view.

use super::BtfError;
use glam::DVec3;
use std::f64::consts::TAU;

/// The direction at an angle from the normal and an azimuth from x to y, radians.
pub fn around(theta: f64, phi: f64) -> DVec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// Rings of the directions of the Bonn measurements (Sattler, Sarlette & Klein 2003): degrees from the
/// normal, and how many.
const BONN: [(u32, u32); 6] = [(0, 1), (15, 6), (30, 12), (45, 18), (60, 20), (75, 24)];

/// The 81 directions of the Bonn measurements, up to 75° from the normal.
pub fn bonn() -> Vec<DVec3> {
    let ring = |(theta, n): (u32, u32)| {
        (0..n).map(move |k| around(f64::from(theta).to_radians(), TAU * f64::from(k) / f64::from(n)))
    };
    BONN.into_iter().flat_map(ring).collect()
}

/// `count` directions up to 75° from the normal, the normal first: the [`bonn`] directions for 81, else equal
/// steps of the cosine along a spiral of golden angles (Vogel 1979).
pub fn spread(count: usize) -> Vec<DVec3> {
    if count == 81 {
        return bonn();
    }
    let low = 75f64.to_radians().cos();
    let one = |k: usize| {
        let z = 1.0 - (1.0 - low) * k as f64 / (count - 1).max(1) as f64;
        around(z.acos(), 2.399_963_229_728_653 * k as f64)
    };
    (0..count).map(one).collect()
}

/// Directions of pictures, sorted into views and lights.
#[derive(Debug, Clone, PartialEq)]
pub struct Pairing {
    /// Views in the order of their first picture.
    pub views: Vec<DVec3>,
    /// Lights, in the order of the pictures.
    pub lights: Vec<DVec3>,
    /// The picture of each view under each light, view after view.
    pub pictures: Vec<usize>,
}

/// Directions that differ by less are one.
const SAME: f64 = 1e-6;

impl Pairing {
    /// The directions to light and viewer of each picture.
    pub fn new(pictures: &[(DVec3, DVec3)]) -> Result<Self, BtfError> {
        let (mut views, mut lights) = (Directions::default(), Directions::default());
        let mut places = Vec::with_capacity(pictures.len());
        for (l, v) in pictures {
            for (what, d) in [("a light", l), ("a view", v)] {
                if !(d.z > 0.0 && d.is_finite()) {
                    return Err(BtfError::Below(what, d.x, d.y, d.z));
                }
            }
            places.push((views.number(v.normalize()), lights.number(l.normalize())));
        }
        let (views, lights) = (views.all, lights.all);
        let count = views.len().saturating_mul(lights.len());
        let missing = count.saturating_sub(pictures.len());
        let lacks = |v: usize, l: usize| {
            let angles =
                |d: DVec3| (d.z.min(1.0).acos().to_degrees(), d.y.atan2(d.x).to_degrees().rem_euclid(360.0));
            let ((view_theta, view_phi), (theta, phi)) = (angles(views[v]), angles(lights[l]));
            BtfError::Missing { view_theta, view_phi, theta, phi, missing, all: count }
        };
        // The table needs no more than one entry beyond the number of pictures: if there are more pairs, one
        // of those entries stays empty, and that pair is reported as missing.
        let mut table = vec![usize::MAX; count.min(pictures.len() + 1)];
        for (k, (v, l)) in places.iter().enumerate() {
            if let Some(to) = table.get_mut(v * lights.len() + l) {
                if *to != usize::MAX {
                    return Err(BtfError::Twice(*to, k));
                }
                *to = k;
            }
        }
        match table.iter().position(|k| *k == usize::MAX) {
            Some(p) => Err(lacks(p / lights.len(), p % lights.len())),
            None if views.is_empty() => Err(BtfError::Size(0, 0, 0, 0)),
            None => Ok(Self { views, lights, pictures: table }),
        }
    }

    /// Directions of the light that are no views, where every view is one of the light's directions and most
    /// of the light's are views: in sets such as Bonn's both are the same, so that these views may be missing
    /// altogether, which leaves the pictures complete.
    pub fn unseen(&self) -> Vec<DVec3> {
        let mut views = Directions::default();
        self.views.iter().for_each(|v| _ = views.number(*v));
        let unseen: Vec<DVec3> =
            self.lights.iter().copied().filter(|l| views.number(*l) >= self.views.len()).collect();
        let shared = self.lights.len() - unseen.len();
        if shared == self.views.len() && unseen.len() < shared { unseen } else { Vec::new() }
    }
}

/// Directions, each once.
#[derive(Default)]
struct Directions {
    all: Vec<DVec3>,
    cells: std::collections::HashMap<[i32; 2], Vec<usize>>,
}

impl Directions {
    /// The index of a direction, a new one where no equal one exists.
    fn number(&mut self, d: DVec3) -> usize {
        let cell = [d.x, d.y].map(|x| (x * 1e4).round() as i32);
        for i in -1..=1 {
            for j in -1..=1 {
                let near = self.cells.get(&[cell[0] + i, cell[1] + j]);
                if let Some(k) = near.into_iter().flatten().find(|k| (self.all[**k] - d).length() < SAME) {
                    return *k;
                }
            }
        }
        self.all.push(d);
        self.cells.entry(cell).or_default().push(self.all.len() - 1);
        self.all.len() - 1
    }
}
