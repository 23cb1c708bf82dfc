//! Subdivision of a mesh where transfer varies between its vertices, so that interpolation over triangles is
//! accurate (Křivánek, Pattanaik & Žára 2004, *Adaptive Mesh Subdivision for Precomputed Radiance Transfer*).
//!
//! An edge is halved where the transfer vector of its midpoint is far from the mean of its ends' vectors. The
//! shadow of an object that stands inside a large triangle may miss the midpoints of all edges; so near the
//! object every edge is halved until it is shorter than [`Refinement::coarsest`], whatever its midpoint says.

use crate::{Scene, Settings, Site, TransferError, direct};
use glam::Vec3;
use std::collections::HashSet;
use steradian_base::Task;
use steradian_scene::{Edge, Mesh, edge};

/// Limits of the subdivision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Largest remaining |t(middle) − ½(t(a) + t(b))|, relative to |t| of an open hemisphere: the error of
    /// radiance at the middle of an edge under the worst light.
    pub tolerance: f64,
    /// Length, relative to the object's diagonal, above which edges near the object are halved without a
    /// test.
    pub coarsest: f32,
    /// Length, relative to the diagonal, above which edges of the given mesh are tested; shorter ones are
    /// trusted as modelled.
    pub given: f32,
    /// Length, relative to the diagonal, below which edges are not halved.
    pub finest: f32,
    /// Most vertices that are added.
    pub most: usize,
}

impl Default for Refinement {
    /// 3 %, edges between 1/256 and 1/12 of the diagonal.
    fn default() -> Self {
        Self { tolerance: 0.03, coarsest: 1.0 / 12.0, given: 1.0 / 64.0, finest: 1.0 / 256.0, most: 100_000 }
    }
}

/// Bands of the vectors that are compared: these hold 99 % of a clamped cosine (Ramamoorthi & Hanrahan 2001).
const BANDS: usize = 3;
/// |t| of an open hemisphere in these bands: √Σ A_l² (2l + 1)/4π with A = π, 2π/3, π/4.
const OPEN: f64 = 1.441;
/// Rays of each vector that is compared: with so many the noise at a shadow's edge stays well below the
/// tolerance, while with 256 the noise alone would mark edges.
const RAYS: u32 = 1024;

/// `mesh` with edges halved where transfer varies between their ends. `object` has the corners of the
/// bounding box of the object of interest, where a ground extends far beyond it; by default the mesh's own.
/// With `slots` only triangles in these slots are divided, and their neighbours.
///
/// # Errors
/// A mesh without triangles, too little memory, or the task was cancelled.
pub fn refine(
    mesh: &Mesh,
    object: Option<(Vec3, Vec3)>,
    slots: Option<&[u32]>,
    refinement: &Refinement,
    task: &Task,
) -> Result<Mesh, TransferError> {
    let scene = Scene::new(mesh)?;
    let (low, high) = object.or_else(|| mesh.bounds()).unwrap_or_default();
    let diagonal = (high - low).length();
    let margin = Vec3::splat(0.25 * diagonal);
    let mut work = Work {
        scene: &scene,
        settings: Settings { bands: BANDS, rays: Some(RAYS), ..Settings::default() },
        task,
        near: (low - margin, high + margin),
        slots,
        fine: mesh.clone(),
        vectors: vec![Vec::new(); mesh.positions.len()],
        settled: HashSet::new(),
    };
    let given = mesh.positions.len();
    let most = given + refinement.most;
    loop {
        task.check()?;
        let (mut marked, mut tested) = (Vec::new(), Vec::new());
        for e in work.open_edges() {
            let [a, b] = e.map(|v| work.fine.positions[v as usize]);
            let length = a.distance(b) / diagonal.max(f32::MIN_POSITIVE);
            let modelled = e.iter().all(|v| (*v as usize) < given);
            if length <= if modelled { refinement.given.max(refinement.finest) } else { refinement.finest } {
                work.settled.insert(e);
            } else if length > refinement.coarsest && work.is_near(a, b) {
                marked.push(e);
            } else {
                tested.push(e);
            }
        }
        for (e, off) in tested.iter().zip(work.deviations(&tested)?) {
            if off > refinement.tolerance {
                marked.push(*e);
            } else {
                work.settled.insert(*e);
            }
        }
        if marked.is_empty() || work.fine.positions.len() + marked.len() > most {
            return Ok(work.fine);
        }
        let parents = work.fine.halve_edges(&marked);
        work.vectors.resize(work.vectors.len() + parents.len(), Vec::new());
    }
}

struct Work<'a> {
    scene: &'a Scene<'a>,
    settings: Settings,
    task: &'a Task,
    near: (Vec3, Vec3),
    slots: Option<&'a [u32]>,
    fine: Mesh,
    /// Vectors of vertices, empty where not computed.
    vectors: Vec<Vec<f32>>,
    /// Edges that stay.
    settled: HashSet<Edge>,
}

impl Work<'_> {
    /// Edges that were not tested yet, in order.
    fn open_edges(&self) -> Vec<Edge> {
        let sides = |t: &[u32; 3]| [edge(t[0], t[1]), edge(t[1], t[2]), edge(t[2], t[0])];
        let triangles = self.fine.triangles.iter().enumerate();
        let within = |i: usize| self.slots.is_none_or(|slots| slots.contains(&self.fine.material(i)));
        let mut all: Vec<Edge> = triangles
            .filter(|(i, _)| within(*i))
            .flat_map(|(_, t)| sides(t))
            .filter(|e| !self.settled.contains(e))
            .collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn is_near(&self, a: Vec3, b: Vec3) -> bool {
        let (low, high) = self.near;
        a.max(b).cmpge(low).all() && a.min(b).cmple(high).all()
    }

    /// Deviation of the midpoint's vector from the mean of the ends', for each edge.
    fn deviations(&mut self, edges: &[Edge]) -> Result<Vec<f64>, TransferError> {
        let mut ends: Vec<u32> = edges.iter().flatten().copied().collect();
        ends.sort_unstable();
        ends.dedup();
        ends.retain(|v| self.vectors[*v as usize].is_empty());
        let vertex = |v: &u32| Site { p: self.fine.positions[*v as usize], n: self.normal(*v) };
        let middle = |[a, b]: &Edge| Site {
            p: 0.5 * (self.fine.positions[*a as usize] + self.fine.positions[*b as usize]),
            n: (self.normal(*a) + self.normal(*b)).normalize_or_zero(),
        };
        let sites: Vec<Site> = ends.iter().map(vertex).chain(edges.iter().map(middle)).collect();
        let found = direct::direct(self.scene, &sites, &self.settings, None, self.task)?;
        let mut vectors = found.t.chunks(BANDS * BANDS).map(<[f32]>::to_vec);
        for (v, t) in ends.iter().zip(vectors.by_ref()) {
            self.vectors[*v as usize] = t;
        }
        let off = |([a, b], t): (&Edge, Vec<f32>)| {
            let (x, y) = (&self.vectors[*a as usize], &self.vectors[*b as usize]);
            let squares =
                t.iter().zip(x.iter().zip(y)).map(|(t, (x, y))| f64::from(t - 0.5 * (x + y)).powi(2));
            squares.sum::<f64>().sqrt() / OPEN
        };
        Ok(edges.iter().zip(vectors).map(off).collect())
    }

    fn normal(&self, v: u32) -> Vec3 {
        self.fine.normals.get(v as usize).copied().unwrap_or(Vec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Affine3A, Vec3Swizzles};
    use steradian_scene::shapes;

    /// A ball on a plate of two triangles: the plate is divided near the ball and little elsewhere, and
    /// interpolated transfer is then close to that of rays; a lone plate stays coarse.
    #[test]
    fn a_plate_is_divided_where_something_stands_on_it() {
        let ball = shapes::icosphere(4).transformed(&Affine3A::from_translation(Vec3::Y));
        let mut plate = shapes::plane(6.0, 0.0, 1);
        plate.materials.clear();
        let mesh = Mesh::merged(&[ball, plate.clone()]);
        let fine = refine(&mesh, None, None, &Refinement::default(), &Task::quiet()).unwrap();
        assert!((fine.area() - mesh.area()).abs() < 1e-4);
        let at = |r: f32| move |p: &&Vec3| p.y == 0.0 && p.xz().length() < r;
        let density = |r: f32| fine.positions.iter().filter(at(r)).count() as f32 / (r * r);
        assert!(density(1.0) > 2.0 * density(3.0), "{} {}", density(1.0), density(3.0));
        assert!(fine.positions.len() < mesh.positions.len() + 20_000, "{}", fine.positions.len());

        let lone = refine(&plate, None, None, &Refinement::default(), &Task::quiet()).unwrap();
        assert!(lone.positions.len() < 800, "{}", lone.positions.len());
    }

    #[test]
    fn other_slots_stay_as_they_are() {
        let ball = shapes::icosphere(2).transformed(&Affine3A::from_translation(Vec3::Y)).with_material(0);
        let mesh = Mesh::merged(&[ball.clone(), shapes::plane(6.0, 0.0, 1).with_material(1)]);
        let divided = |slots: Option<&[u32]>| {
            let fine = refine(&mesh, None, slots, &Refinement::default(), &Task::quiet()).unwrap();
            [0, 1].map(|slot| (0..fine.triangles.len()).filter(|&i| fine.material(i) == slot).count())
        };
        let (all, plate) = (divided(None), divided(Some(&[1])));
        assert!(all[0] > ball.triangles.len(), "{all:?}");
        assert_eq!(plate, [ball.triangles.len(), all[1]]);
    }
}
