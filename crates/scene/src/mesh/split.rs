//! Triangles divided along halved edges.

use super::normals::same_position;
use super::{Mesh, tangents};
use glam::Vec3;
use std::collections::HashMap;

/// The two ends of an edge, the smaller vertex index first.
pub type Edge = [u32; 2];

/// The edge between two vertices.
pub fn edge(a: u32, b: u32) -> Edge {
    [a.min(b), a.max(b)]
}

impl Mesh {
    /// Halves `edges`, and of every triangle that has a halved edge its longest one too, so that triangles do
    /// not become ever thinner (Rivara 1984). Both sides of a seam are divided alike. Vertex attributes are
    /// interpolated, and normals normalised; the surface keeps its shape. Returns, for each new vertex, the
    /// edge whose middle it is; new vertices come after the existing ones.
    pub fn halve_edges(&mut self, edges: &[Edge]) -> Vec<Edge> {
        let place = same_position(&self.positions);
        let key = |a: u32, b: u32| edge(place[a as usize], place[b as usize]);
        let mut marked: HashMap<Edge, ()> = edges.iter().map(|[a, b]| (key(*a, *b), ())).collect();
        let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        let length = |[a, b]: [u32; 2]| {
            let (a, b) = (self.positions[a as usize], self.positions[b as usize]);
            // The result does not depend on which end comes first.
            a.distance_squared(b)
        };
        // The longest side, by the ends' numbers among equals so that neighbours agree.
        let longest = |t: &[u32; 3]| {
            let s = sides(t);
            let rank = |k: usize| (length(s[k]), key(s[k][0], s[k][1]));
            (1..3).fold(0, |best, k| if rank(k) > rank(best) { k } else { best })
        };
        loop {
            let before = marked.len();
            for t in &self.triangles {
                if sides(t).iter().any(|[a, b]| marked.contains_key(&key(*a, *b))) {
                    let [a, b] = sides(t)[longest(t)];
                    marked.insert(key(a, b), ());
                }
            }
            if marked.len() == before {
                break;
            }
        }
        let first = self.positions.len() as u32;
        let (mut middles, mut parents) = (HashMap::<Edge, u32>::new(), Vec::new());
        let mut middle = |[a, b]: [u32; 2]| -> Option<u32> {
            marked.contains_key(&key(a, b)).then(|| {
                *middles.entry(edge(a, b)).or_insert_with(|| {
                    parents.push(edge(a, b));
                    first + parents.len() as u32 - 1
                })
            })
        };
        let (mut triangles, mut slots) = (Vec::new(), Vec::new());
        for (k, t) in self.triangles.iter().enumerate() {
            let start = longest(t);
            // a to b is the longest side.
            let [a, b, c] = [0, 1, 2].map(|i| t[(start + i) % 3]);
            let (ab, bc, ca) = (middle([a, b]), middle([b, c]), middle([c, a]));
            match (ab, bc, ca) {
                (Some(m), Some(q), Some(r)) => {
                    triangles.extend([[a, m, r], [m, b, q], [r, q, c], [m, q, r]]);
                }
                (Some(m), Some(q), None) => triangles.extend([[a, m, c], [m, b, q], [m, q, c]]),
                (Some(m), None, Some(r)) => triangles.extend([[a, m, r], [m, c, r], [m, b, c]]),
                (Some(m), None, None) => triangles.extend([[a, m, c], [m, b, c]]),
                _ => triangles.push(*t),
            }
            if !self.materials.is_empty() {
                slots.resize(triangles.len(), self.material(k));
            }
        }
        (self.triangles, self.materials) = (triangles, slots);
        for &[a, b] in &parents {
            self.add_middle(a as usize, b as usize);
        }
        parents
    }

    /// A vertex between two others.
    fn add_middle(&mut self, a: usize, b: usize) {
        fn between(v: &mut Vec<Vec3>, a: usize, b: usize, unit: bool) -> Option<Vec3> {
            let (x, y) = (*v.get(a)?, *v.get(b)?);
            let middle = 0.5 * (x + y);
            let middle = if unit { middle.normalize_or(x) } else { middle };
            v.push(middle);
            Some(middle)
        }
        between(&mut self.positions, a, b, false);
        let normal = between(&mut self.normals, a, b, true);
        between(&mut self.colors, a, b, false);
        if let (Some(x), Some(y)) = (self.uvs.get(a).copied(), self.uvs.get(b).copied()) {
            self.uvs.push(0.5 * (x + y));
        }
        if let (Some(x), Some(y), Some(n)) = (self.tangents.get(a), self.tangents.get(b), normal) {
            let (along, sign) = (0.5 * (x.truncate() + y.truncate()), x.w);
            self.tangents.push(tangents::orthogonal(n, along).extend(sign));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    /// Some edges halved: no area is lost, no triangle turns over, every edge inside has two triangles, and
    /// the parts of a side are those of its neighbour.
    #[test]
    fn halves_leave_the_surface_whole() {
        let mut mesh = shapes::torus(0.7, 0.3, 12);
        let (area, volume) = (mesh.area(), volume(&mesh));
        for round in 0..4 {
            let edges: Vec<Edge> = mesh
                .triangles
                .iter()
                .enumerate()
                .filter(|(k, _)| k % 7 == round)
                .map(|(_, t)| edge(t[0], t[1]))
                .collect();
            let before = mesh.positions.len();
            let parents = mesh.halve_edges(&edges);
            assert_eq!(mesh.positions.len(), before + parents.len());
            for (k, [a, b]) in parents.iter().enumerate() {
                let p = 0.5 * (mesh.positions[*a as usize] + mesh.positions[*b as usize]);
                assert!(p.distance(mesh.positions[before + k]) < 1e-6);
            }
            assert_eq!(mesh.normals.len(), mesh.positions.len());
            assert_eq!(mesh.uvs.len(), mesh.positions.len());
            assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
        }
        assert!((mesh.area() - area).abs() < 1e-5 * area);
        assert!((self::volume(&mesh) - volume).abs() < 1e-5 * volume);
        let place = same_position(&mesh.positions);
        let mut count = HashMap::<Edge, u32>::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                let [a, b] = [t[k], t[(k + 1) % 3]].map(|v| place[v as usize]);
                *count.entry(edge(a, b)).or_default() += 1;
            }
        }
        assert!(count.values().all(|n| *n == 2));
    }

    fn volume(mesh: &Mesh) -> f64 {
        let part = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
            a.dot(b.cross(c)) / 6.0
        };
        mesh.triangles.iter().map(part).sum()
    }

    #[test]
    fn triangles_do_not_become_thin() {
        let mut mesh = shapes::plane(1.0, 0.0, 1);
        for _ in 0..10 {
            let t = mesh.triangles[0];
            mesh.halve_edges(&[edge(t[0], t[1])]);
        }
        for k in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(k);
            let angle = |p: Vec3, q: Vec3, r: Vec3| (q - p).angle_between(r - p).to_degrees();
            let least = angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b));
            assert!(least > 20.0, "{least}");
        }
    }
}
