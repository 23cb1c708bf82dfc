//! The places that get transfer.

use crate::TransferError;
use glam::{Vec2, Vec3};
use steradian_scene::Mesh;

/// A point of a surface with its unit normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Position, in the mesh's units.
    pub p: Vec3,
    /// Unit normal.
    pub n: Vec3,
}

/// What is wrong with the texture coordinates of a mesh as an atlas.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Atlas {
    /// Texels in the inside of more than one triangle.
    pub overlapping: usize,
    /// Triangles without a texel.
    pub missing: usize,
}

fn corners(uvs: &[Vec2], t: [usize; 3]) -> Option<[Vec2; 3]> {
    Some([*uvs.get(t[0])?, *uvs.get(t[1])?, *uvs.get(t[2])?])
}

impl Site {
    /// Every vertex of a mesh. Those that no triangle uses get no normal, and no transfer: theirs is zero.
    pub fn vertices(mesh: &Mesh) -> Vec<Self> {
        let used = mesh.used();
        let site = |i: usize| Self {
            p: mesh.positions[i],
            n: if used[i] { mesh.normals.get(i).copied().unwrap_or(Vec3::ZERO) } else { Vec3::ZERO },
        };
        (0..mesh.positions.len()).map(site).collect()
    }

    /// The same of the vertices of triangles in these slots of the mesh; the others get no normal.
    pub fn vertices_in(mesh: &Mesh, slots: &[u32]) -> Vec<Self> {
        let mut all = Self::vertices(mesh);
        let mut within = vec![false; all.len()];
        for (i, t) in mesh.triangles.iter().enumerate() {
            let inside = slots.contains(&mesh.material(i));
            t.iter().for_each(|&v| within[v as usize] |= inside);
        }
        all.iter_mut().zip(within).filter(|(_, w)| !w).for_each(|(s, _)| s.n = Vec3::ZERO);
        all
    }

    /// The texels of an atlas of `width` × `height` over the mesh's texture coordinates, rows from the top:
    /// where a texel's centre lies in a triangle, that point of it. Other texels are absent.
    pub fn texels(mesh: &Mesh, width: usize, height: usize) -> (Vec<Self>, Atlas) {
        let mut sites = vec![Self { p: Vec3::ZERO, n: Vec3::ZERO }; width * height];
        let mut atlas = Atlas::default();
        let size = Vec2::new(width as f32, height as f32);
        for t in mesh.triangles.iter().map(|t| t.map(|v| v as usize)) {
            let Some([a, b, c]) = corners(&mesh.uvs, t).map(|c| c.map(|uv| uv * size)) else { continue };
            let area = (b - a).perp_dot(c - a);
            let (lo, hi) = (a.min(b).min(c).max(Vec2::ZERO), a.max(b).max(c).min(size));
            let mut covered = false;
            for y in lo.y as usize..(hi.y.ceil() as usize).min(height) {
                for x in lo.x as usize..(hi.x.ceil() as usize).min(width) {
                    let q = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                    let w = [(c - b).perp_dot(q - b), (a - c).perp_dot(q - c), (b - a).perp_dot(q - a)]
                        .map(|w| w / area);
                    if !w.iter().all(|w| *w >= 0.0) {
                        continue;
                    }
                    covered = true;
                    let mix = |v: &[Vec3]| (0..3).map(|k| v[t[k]] * w[k]).sum::<Vec3>();
                    let site = &mut sites[y * width + x];
                    // A texel on an edge belongs to both of its triangles, and to the first.
                    if site.is_absent() {
                        *site = Self { p: mix(&mesh.positions), n: mix(&mesh.normals).normalize_or_zero() };
                    } else if w.iter().all(|w| *w > 1e-4) {
                        atlas.overlapping += 1;
                    }
                }
            }
            atlas.missing += usize::from(!covered);
        }
        (sites, atlas)
    }

    /// Is there no place here: a vertex without triangles, a texel without surface?
    pub fn is_absent(&self) -> bool {
        self.n == Vec3::ZERO
    }

    pub(crate) fn check(sites: &[Self]) -> Result<(), TransferError> {
        for (k, s) in sites.iter().enumerate() {
            let unit = s.is_absent() || (s.n.length_squared() - 1.0).abs() < 1e-3;
            if !s.p.is_finite() || !s.n.is_finite() || !unit {
                return Err(TransferError::Site { site: k, p: s.p, n: s.n });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_scene::shapes;

    #[test]
    fn texels_lie_on_the_surface_and_faults_are_counted() {
        let mut mesh = shapes::sphere(24);
        let (sites, atlas) = Site::texels(&mesh, 64, 32);
        assert_eq!(atlas.overlapping, 0);
        let there: Vec<&Site> = sites.iter().filter(|s| !s.is_absent()).collect();
        assert!(there.len() > 56 * 32, "{}", there.len());
        assert!(there.iter().all(|s| (s.p.length() - 1.0).abs() < 0.02 && s.p.normalize().dot(s.n) > 0.999));
        mesh.uvs.iter_mut().for_each(|uv| uv.x = (2.0 * uv.x).min(2.0 - 2.0 * uv.x));
        assert!(Site::texels(&mesh, 64, 32).1.overlapping > 500);
        assert!(Site::texels(&mesh, 4, 4).1.missing > 100);
    }
}
