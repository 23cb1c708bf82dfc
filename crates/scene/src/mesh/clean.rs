//! From a file's data to a mesh that every algorithm can take.

use super::{Mesh, normals};
use glam::{Vec2, Vec3, Vec4};
use steradian_formats::mesh::Part;

/// Optional work of [`Mesh::from_part`] in addition to the necessary repairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Repairs {
    /// Make one vertex of those that agree in position, normal and texture coordinates.
    pub weld: bool,
    /// Drop vertices that no triangle uses.
    pub compact: bool,
}

/// Faults found in a part, and their repairs.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MeshReport {
    /// Triangles without area, dropped.
    pub degenerate: usize,
    /// Vertices that no triangle uses. They are kept (so that data per vertex match the file) unless
    /// [`Repairs::compact`] is set.
    pub unreferenced: usize,
    /// The file had no normals: they were made.
    pub made_normals: bool,
    /// Normals of used vertices that were zero or not finite and were recomputed.
    pub repaired_normals: usize,
    /// For each vertex of the file its vertex in the mesh, [`MeshReport::DROPPED`] where there is none; empty
    /// where the vertices are those of the file.
    pub map: Vec<u32>,
}

impl MeshReport {
    /// In [`MeshReport::map`]: the vertex is gone.
    pub const DROPPED: u32 = u32::MAX;

    /// One line for every thing found.
    pub fn notes(&self) -> Vec<String> {
        let mut out = Vec::new();
        let mut note = |n: usize, what: &str| {
            if n > 0 {
                out.push(format!("{n} {what}"));
            }
        };
        note(self.degenerate, "triangles without area were dropped");
        note(self.unreferenced, "vertices belong to no triangle");
        note(self.repaired_normals, "normals were zero or not finite and were made again");
        out
    }
}

impl Mesh {
    /// A part of a mesh file with unit normals everywhere: computed with angle weights where the file has
    /// none (flat where its format prescribes that), recomputed where they are zero. Triangles without area
    /// are dropped. Tangents are kept where the file has valid ones for all used vertices, otherwise left
    /// empty.
    pub fn from_part(part: &Part, repairs: Repairs) -> (Self, MeshReport) {
        let mut mesh = Self {
            positions: part.positions.iter().map(|p| Vec3::from(*p)).collect(),
            normals: part.normals.iter().map(|n| Vec3::from(*n)).collect(),
            tangents: part.tangents.iter().map(|t| Vec4::from(*t)).collect(),
            uvs: part.uvs.iter().map(|t| Vec2::from(*t)).collect(),
            colors: part.colors.iter().map(|c| Vec3::from(*c)).collect(),
            triangles: part.triangles.clone(),
            materials: part.materials.clone(),
        };
        let mut report = MeshReport { degenerate: mesh.drop_degenerate(), ..MeshReport::default() };
        report.unreferenced = mesh.used().iter().filter(|u| !**u).count();
        report.made_normals = mesh.normals.is_empty();
        if report.made_normals && part.flat {
            report.map = vec![MeshReport::DROPPED; mesh.positions.len()];
            (0u32..).zip(mesh.triangles.iter().flatten()).for_each(|(i, &v)| report.map[v as usize] = i);
            normals::split_flat(&mut mesh);
        }
        if repairs.weld {
            report.follow(mesh.weld());
        }
        if repairs.compact {
            report.follow(mesh.compact());
        }
        report.repaired_normals = mesh.repair_normals();
        if report.made_normals {
            report.repaired_normals = 0;
        }
        mesh.check_tangents();
        (mesh, report)
    }

    /// Removes triangles that have no area; returns how many.
    pub fn drop_degenerate(&mut self) -> usize {
        let keep: Vec<bool> = (0..self.triangles.len()).map(|i| !self.is_degenerate(i)).collect();
        let before = self.triangles.len();
        let mut flags = keep.iter();
        self.triangles.retain(|_| *flags.next().unwrap_or(&true));
        let mut flags = keep.iter();
        self.materials.retain(|_| *flags.next().unwrap_or(&true));
        before - self.triangles.len()
    }

    /// Is twice the area below the rounding of its own computation?
    fn is_degenerate(&self, i: usize) -> bool {
        let [a, b, c] = self.corners(i).map(|p| p.as_dvec3());
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        self.cross(i).length() <= 1e-14 * longest
    }

    /// Flags of the vertices that triangles use.
    pub fn used(&self) -> Vec<bool> {
        let mut used = vec![false; self.positions.len()];
        self.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        used
    }

    /// Drops vertices that no triangle uses; returns the new index of each ([`MeshReport::DROPPED`]: none).
    pub fn compact(&mut self) -> Vec<u32> {
        let mut map = vec![MeshReport::DROPPED; self.positions.len()];
        let mut kept = 0;
        for (m, used) in map.iter_mut().zip(self.used()) {
            if used {
                *m = kept;
                kept += 1;
            }
        }
        self.rename(&map, kept as usize);
        map
    }

    /// Makes one vertex of those that agree bit for bit in position, normal, tangent, texture coordinates and
    /// colour; returns the new index of each.
    pub fn weld(&mut self) -> Vec<u32> {
        let mut first = std::collections::HashMap::with_capacity(self.positions.len());
        let mut map = Vec::with_capacity(self.positions.len());
        let bits = |v: &[f32]| v.iter().map(|x| (x + 0.0).to_bits()).collect::<Vec<u32>>();
        for i in 0..self.positions.len() {
            let mut key = bits(&self.positions[i].to_array());
            key.extend(self.normals.get(i).map(|n| bits(&n.to_array())).unwrap_or_default());
            key.extend(self.tangents.get(i).map(|t| bits(&t.to_array())).unwrap_or_default());
            key.extend(self.uvs.get(i).map(|t| bits(&t.to_array())).unwrap_or_default());
            key.extend(self.colors.get(i).map(|c| bits(&c.to_array())).unwrap_or_default());
            let next = first.len() as u32;
            map.push(*first.entry(key).or_insert(next));
        }
        self.rename(&map, first.len());
        map
    }

    /// Moves vertex i to `map[i]`; of several that move to one place the first stays.
    fn rename(&mut self, map: &[u32], count: usize) {
        fn moved<T: Copy>(values: &mut Vec<T>, map: &[u32], count: usize) {
            if values.is_empty() {
                return;
            }
            let mut sources = vec![None; count];
            for (i, &to) in map.iter().enumerate().rev() {
                if to != MeshReport::DROPPED {
                    sources[to as usize] = Some(values[i]);
                }
            }
            *values = sources.into_iter().flatten().collect();
        }
        moved(&mut self.positions, map, count);
        moved(&mut self.normals, map, count);
        moved(&mut self.tangents, map, count);
        moved(&mut self.uvs, map, count);
        moved(&mut self.colors, map, count);
        self.triangles.iter_mut().for_each(|t| *t = t.map(|v| map[v as usize]));
    }

    /// Makes every normal a unit vector: missing, zero and non-finite ones by angle weights, +Y at vertices
    /// without triangles. Returns how many used vertices it mended.
    pub fn repair_normals(&mut self) -> usize {
        self.normals.resize(self.positions.len(), Vec3::ZERO);
        let unit = |n: Vec3| n.as_dvec3().try_normalize().map(|n| n.as_vec3());
        let bad = self.normals.iter().any(|n| unit(*n).is_none());
        let made = if bad { normals::angle_weighted(self) } else { Vec::new() };
        let mut mended = 0;
        for (i, n) in self.normals.iter_mut().enumerate() {
            *n = unit(*n).unwrap_or_else(|| {
                let fresh = made[i];
                mended += usize::from(fresh != Vec3::ZERO);
                fresh.try_normalize().unwrap_or(Vec3::Y)
            });
        }
        mended
    }

    /// Keeps tangents only where all used ones are valid; they become unit and perpendicular to the normal.
    fn check_tangents(&mut self) {
        let used = self.used();
        let valid = |t: &Vec4| t.truncate().try_normalize().is_some() && t.w != 0.0;
        if self.tangents.len() != self.positions.len()
            || !self.tangents.iter().zip(&used).all(|(t, used)| !used || valid(t))
        {
            self.tangents.clear();
            return;
        }
        for (t, n) in self.tangents.iter_mut().zip(&self.normals) {
            *t = super::tangents::orthogonal(*n, t.truncate()).extend(if t.w < 0.0 { -1.0 } else { 1.0 });
        }
    }
}

impl MeshReport {
    /// The vertices moved again.
    fn follow(&mut self, step: Vec<u32>) {
        if self.map.is_empty() {
            self.map = step;
        } else {
            let to = |m: u32| step.get(m as usize).copied().unwrap_or(Self::DROPPED);
            self.map.iter_mut().for_each(|m| *m = to(*m));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Part {
        Part {
            positions: vec![
                [0., 0., 0.],
                [1., 0., 0.],
                [1., 1., 0.],
                [0., 1., 0.],
                [9., 9., 9.],
                [0., 0., 0.],
            ],
            triangles: vec![[0, 1, 2], [5, 2, 3], [1, 1, 2], [0, 1, 0]],
            materials: vec![7, 8, 9, 9],
            ..Part::default()
        }
    }

    #[test]
    fn degenerate_triangles_go_and_unreferenced_vertices_stay() {
        let (m, report) = Mesh::from_part(&square(), Repairs::default());
        assert_eq!((m.triangles.len(), m.positions.len()), (2, 6));
        assert_eq!(m.materials, [7, 8]);
        assert_eq!((report.degenerate, report.unreferenced, report.made_normals), (2, 1, true));
        assert!(report.map.is_empty());
        assert_eq!((m.normals[0], m.normals[4]), (Vec3::Z, Vec3::Y));
    }

    #[test]
    fn welding_and_compacting_say_where_vertices_went() {
        let (m, report) = Mesh::from_part(&square(), Repairs { weld: true, compact: true });
        assert_eq!(report.map, [0, 1, 2, 3, MeshReport::DROPPED, 0]);
        assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(m.positions.len(), 4);
    }

    #[test]
    fn zero_normals_are_made_again_and_long_ones_shortened() {
        let normals =
            vec![[0., 0., 5.], [0.; 3], [f32::NAN, 0., 0.], [0., 0., 1e-30], [0.; 3], [0., 0., 1e30]];
        let (m, report) = Mesh::from_part(&Part { normals, ..square() }, Repairs::default());
        assert_eq!(report.repaired_normals, 2);
        assert!((0..6).filter(|i| *i != 4).all(|i| m.normals[i] == Vec3::Z));
    }

    #[test]
    fn flat_parts_are_split_into_facets() {
        let (m, report) = Mesh::from_part(&Part { flat: true, ..square() }, Repairs::default());
        assert_eq!((m.positions.len(), m.triangles.len()), (6, 2));
        assert_eq!(report.map[4], MeshReport::DROPPED);
    }

    #[test]
    fn tangents_of_the_file_are_kept_only_if_all_are_valid() {
        let good = vec![[2., 0., 0.1, -1.]; 6];
        let (m, _) = Mesh::from_part(&Part { tangents: good.clone(), ..square() }, Repairs::default());
        assert_eq!(m.tangents[0], Vec4::new(1.0, 0.0, 0.0, -1.0));
        let mut bad = good;
        bad[1] = [0.0; 4];
        let (m, _) = Mesh::from_part(&Part { tangents: bad, ..square() }, Repairs::default());
        assert!(m.tangents.is_empty());
    }
}
