//! The places that get transfer.

use crate::TransferError;
use glam::{DVec2, DVec3, Vec2, Vec3};
use steradian_scene::Mesh;

/// A point of a surface with its unit normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Position, in the mesh's units.
    pub p: Vec3,
    /// Unit normal.
    pub n: Vec3,
}

/// How the texture coordinates of a mesh serve as an atlas.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Atlas {
    /// Texels in the inside of more than one triangle.
    pub overlapping: usize,
    /// Triangles that hold no texel's centre. Each has the texel about its middle, alone where that is free,
    /// else with a neighbour.
    pub missing: usize,
    /// The part of the mesh's area that these are.
    pub missing_area: f64,
}

impl Atlas {
    /// The largest part of the area that triangles without a texel of their own may be. They are smaller than
    /// a texel, and the one about their middle is as near to them as interpolation is elsewhere.
    const MOST_MISSING: f64 = 0.01;
    /// Texels nearer than this to an edge, in texels, belong to both its sides: more than 32-bit coordinates
    /// round by in an atlas of 16384 texels a side.
    const ON_EDGE: f64 = 1e-2;

    /// Does each point of the surface have a texel, and each texel one point?
    pub fn is_whole(&self) -> bool {
        self.overlapping == 0 && self.missing_area <= Self::MOST_MISSING
    }
}

/// The corners of a triangle in texels, in the tile of the repeated image in which its middle lies.
fn corners(uvs: &[Vec2], t: [usize; 3], size: DVec2) -> Option<[DVec2; 3]> {
    let uv = [uvs.get(t[0])?, uvs.get(t[1])?, uvs.get(t[2])?].map(|uv| uv.as_dvec2());
    let tile = ((uv[0] + uv[1] + uv[2]) / 3.0).floor();
    uv.iter().all(|uv| uv.is_finite()).then(|| uv.map(|uv| (uv - tile) * size))
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

    /// [`Site::vertices`] for triangles in these slots of the mesh; all other vertices get no normal.
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

    /// The texels of an atlas of `width` × `height` over the mesh's texture coordinates, rows from the top,
    /// repeated beyond it: where a texel's centre lies in a triangle, that point of it. Other texels are
    /// absent.
    pub fn texels(mesh: &Mesh, width: usize, height: usize) -> (Vec<Self>, Atlas) {
        let mut sites = vec![Self { p: Vec3::ZERO, n: Vec3::ZERO }; width * height];
        let mut atlas = Atlas::default();
        let size = DVec2::new(width as f64, height as f64);
        let at = |x: f64, y: f64| {
            let [x, y] = [x.rem_euclid(size.x), y.rem_euclid(size.y)].map(|v| v as usize);
            y.min(height - 1) * width + x.min(width - 1)
        };
        let (mut area, mut without) = (0.0, Vec::new());
        for t in mesh.triangles.iter().map(|t| t.map(|v| v as usize)) {
            let place = |w: [f64; 3]| {
                let mix = |v: &[Vec3]| (0..3).map(|k| v[t[k]].as_dvec3() * w[k]).sum::<DVec3>().as_vec3();
                Self { p: mix(&mesh.positions), n: mix(&mesh.normals).normalize_or_zero() }
            };
            let [a, b, c] = t.map(|v| mesh.positions[v].as_dvec3());
            let own = 0.5 * (b - a).cross(c - a).length();
            area += own;
            let Some([a, b, c]) = corners(&mesh.uvs, t, size) else {
                without.push((None, place([1.0 / 3.0; 3]), own));
                continue;
            };
            let twice = (b - a).perp_dot(c - a);
            let lengths = [c - b, a - c, b - a].map(DVec2::length);
            let (lo, hi) = (a.min(b).min(c).floor(), a.max(b).max(c).ceil());
            let mut covered = false;
            // An image is repeated at most once: coordinates that span more are no atlas.
            let (columns, rows) = ((hi.x - lo.x).min(size.x) as usize, (hi.y - lo.y).min(size.y) as usize);
            for (x, y) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
                let q = DVec2::new(lo.x + x as f64 + 0.5, lo.y + y as f64 + 0.5);
                let w = [(c - b).perp_dot(q - b), (a - c).perp_dot(q - c), (b - a).perp_dot(q - a)];
                if !w.iter().all(|w| w / twice >= 0.0) {
                    continue;
                }
                covered = true;
                let site = &mut sites[at(q.x, q.y)];
                // A texel on an edge belongs to both of its triangles, and to the first.
                if site.is_absent() {
                    *site = place(w.map(|w| w / twice));
                } else if (0..3).all(|k| w[k].abs() > Atlas::ON_EDGE * lengths[k]) {
                    atlas.overlapping += 1;
                }
            }
            if !covered {
                without.push((Some((a + b + c) / 3.0), place([1.0 / 3.0; 3]), own));
            }
        }
        atlas.missing = without.len();
        atlas.missing_area = without.iter().map(|w| w.2).sum::<f64>() / area.max(f64::MIN_POSITIVE);
        for (middle, place, _) in without {
            if let Some(site) = middle.map(|m| &mut sites[at(m.x, m.y)]).filter(|s| s.is_absent()) {
                *site = place;
            }
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
        let coarse = Site::texels(&mesh, 4, 4).1;
        assert!(coarse.missing > 100 && !coarse.is_whole());
    }

    /// Coordinates beyond the image are those of the repeated one, and a triangle smaller than a texel has
    /// the one about its middle.
    #[test]
    fn atlases_repeat_and_small_triangles_have_a_texel() {
        let square = shapes::by_name("plane:size=2").expect("a shape");
        let (plain, whole) = Site::texels(&square, 8, 8);
        assert!(whole.is_whole() && plain.iter().all(|s| !s.is_absent()));
        let mut beyond = square.clone();
        beyond.uvs.iter_mut().for_each(|uv| *uv += Vec2::new(-2.0, 1.0));
        assert_eq!(Site::texels(&beyond, 8, 8), (plain, whole));
        let mut small = shapes::by_name("plane:size=0.001").expect("a shape");
        small.uvs.iter_mut().for_each(|uv| *uv = Vec2::new(0.3, 0.3) + *uv * 0.001);
        beyond.uvs.iter_mut().for_each(|uv| *uv = (*uv - Vec2::new(-2.0, 1.0)) * Vec2::new(0.2, 1.0));
        let both = Mesh::merged(&[beyond, small]);
        let (sites, atlas) = Site::texels(&both, 8, 8);
        assert!(atlas.is_whole() && atlas.missing == 2, "{atlas:?}");
        assert!(sites[2 * 8 + 2].p.length() < 0.001 && !sites[2 * 8 + 2].is_absent());
        // Without an area in the atlas a surface has no place in it.
        let mut flat = square;
        flat.uvs.iter_mut().for_each(|uv| uv.x = 0.5);
        assert!(!Site::texels(&flat, 8, 8).1.is_whole());
    }
}
