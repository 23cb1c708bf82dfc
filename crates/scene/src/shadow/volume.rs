//! Shadow volumes (Crow 1977, *Shadow Algorithms for Computer Graphics*), counted behind the point (Bilodeau
//! & Songy; Carmack 2000, z-fail): the count is that of a ray from the point outwards, so that it holds
//! wherever camera and light are.
//!
//! Every triangle, turned to face the light, spawns a prism away from it, and sides between neighbours cancel
//! (Kim, Kim & Oh 2008, *Shadow Volumes for General Polyhedra*), so that open meshes and edges of three
//! triangles need no exception.

use super::{Blocker, Boundary, Flat, LightAt, Volumes, meant};
use crate::{Bvh, Mesh, Ray};
use glam::Vec3;
use std::collections::HashMap;
use std::sync::Arc;

/// Length of the volumes' sides away from the light, in diagonals of the mesh: with longer ones single
/// precision would blur the edges of shadows.
const REACH: f32 = 10.0;
/// Number of candidates, for a near light, for the direction of the rays that count the prisms around a
/// point. The one with the fewest edges around it and the fewest triangles behind it is taken, so that rays
/// leave the prisms soonest.
const TRIED: usize = 64;
/// Angle, radians, as the light sees it, within which a candidate should have no edges: a ray then leaves a
/// prism within 1/tan of this angle times its distance from the light.
const CLEAR: f32 = 0.12;

/// The shadow volumes of some lights. Both sides of a triangle block.
#[derive(Debug, Clone)]
pub struct ShadowVolumes {
    volumes: Vec<(LightAt, Volume)>,
    /// Positions of the mesh, the first ones of each volume.
    places: usize,
}

/// The boundary of the region that one light does not reach.
#[derive(Debug, Clone)]
struct Volume {
    bvh: Bvh,
    mesh: Mesh,
    /// For each triangle of the boundary how many prisms it bounds, positive where its normal leads out of
    /// them.
    count: Vec<i32>,
    /// Number of caps among the triangles; after these come two for each side.
    caps: usize,
    /// Direction of the counting rays, and the number of prisms of a near light that contain the point at
    /// infinity there.
    outwards: (Vec3, i32),
    /// Length of the counting rays, metres.
    far: f32,
}

impl ShadowVolumes {
    /// The volumes of `lights` behind `mesh`.
    pub fn new(mesh: &Mesh, lights: &[LightAt]) -> Self {
        let welded = Welded::new(mesh);
        let volumes = lights.iter().map(|l| (*l, welded.volume(*l))).collect();
        Self { volumes, places: welded.positions.len() }
    }

    /// Triangles of all boundaries.
    pub fn triangles(&self) -> usize {
        self.volumes.iter().map(|v| v.1.count.len()).sum()
    }
}

/// Triangles over positions, each once.
struct Welded {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    diagonal: f32,
}

impl Welded {
    fn new(mesh: &Mesh) -> Self {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        let (mut index, mut seen) = (HashMap::new(), HashMap::new());
        for i in 0..mesh.triangles.len() {
            let corners = mesh.corners(i);
            if !corners.iter().all(|p| p.is_finite()) {
                continue;
            }
            let t = corners.map(|p| {
                // Both zeros are one place.
                *index.entry((p + 0.0).to_array().map(f32::to_bits)).or_insert_with(|| {
                    positions.push(p);
                    (positions.len() - 1) as u32
                })
            });
            let mut sorted = t;
            sorted.sort_unstable();
            if sorted[0] != sorted[1] && sorted[1] != sorted[2] && seen.insert(sorted, ()).is_none() {
                triangles.push(t);
            }
        }
        Self { positions, triangles, diagonal: mesh.diagonal() }
    }

    fn volume(&self, light: LightAt) -> Volume {
        let to_light = |p: Vec3| match light {
            LightAt::Far(d) => d,
            LightAt::Near(l) => l - p,
        };
        let at = |i: u32| self.positions[i as usize];
        let (mut caps, mut count) = (Vec::new(), Vec::new());
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        for &[a, b, c] in &self.triangles {
            let normal = (at(b) - at(a)).as_dvec3().cross((at(c) - at(a)).as_dvec3());
            let facing = normal.dot(to_light(at(a)).as_dvec3());
            if facing == 0.0 {
                continue;
            }
            let t = if facing > 0.0 { [a, b, c] } else { [a, c, b] };
            caps.push([a, b, c]);
            count.push(if facing > 0.0 { 1 } else { -1 });
            for k in 0..3 {
                let (p, q) = (t[k], t[(k + 1) % 3]);
                *edges.entry([p.min(q), p.max(q)]).or_default() += if p < q { 1 } else { -1 };
            }
        }
        // A fixed order, so that nothing depends on that of the map.
        let mut edges: Vec<([u32; 2], i32)> = edges.into_iter().filter(|e| e.1 != 0).collect();
        edges.sort_unstable();
        let mut mesh = Mesh { positions: self.positions.clone(), triangles: caps, ..Mesh::default() };
        let caps = count.len();
        let away = |p: Vec3| p - REACH * self.diagonal.max(1e-3) * to_light(p).normalize_or_zero();
        for ([p, q], n) in edges {
            let base = mesh.positions.len() as u32;
            mesh.positions.extend([away(at(p)), away(at(q))]);
            // Seen from outside, the cap has p → q counterclockwise where n > 0; its side runs the other way.
            mesh.triangles.extend([[q, p, base], [q, base, base + 1]]);
            count.extend([n, n]);
        }
        let blocking = Mesh {
            positions: self.positions.clone(),
            triangles: mesh.triangles[..caps].to_vec(),
            ..Mesh::default()
        };
        let far = 2.0 * REACH * self.diagonal.max(1e-3);
        Volume { bvh: Bvh::build(&mesh), mesh, count, caps, outwards: outwards(light, &blocking), far }
    }
}

/// The direction of rays: across a distant light, whose prisms they leave; of those about a near light one
/// that is far from edges, with the number of triangles beyond which the light does not reach there.
fn outwards(light: LightAt, caps: &Mesh) -> (Vec3, i32) {
    let origin = match light {
        LightAt::Far(d) => {
            let (x, y) = d.any_orthonormal_pair();
            // An azimuth that no edge of a usual mesh has, so that rays do not run along edges.
            return ((0.809_34 * x + 0.587_34 * y).normalize(), 0);
        }
        LightAt::Near(p) => p,
    };
    let bvh = Bvh::build(caps);
    let behind = |direction: Vec3| {
        let mut hits = Vec::new();
        bvh.every(&Ray { origin, direction }, f32::INFINITY, &mut hits);
        hits.len() as i32
    };
    let tried = (0..TRIED).map(|k| {
        // A spiral (Vogel 1979) about a tilted axis.
        let z = 1.0 - (2 * k + 1) as f32 / TRIED as f32;
        let (s, c) = (2.399_963_2 * k as f32 + 0.1).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let d = glam::Quat::from_rotation_x(0.3) * Vec3::new(r * c, r * s, z);
        let (x, y) = d.any_orthonormal_pair();
        let here = behind(d);
        let around = (0..8).map(|i| {
            let (s, c) = (std::f32::consts::FRAC_PI_4 * i as f32).sin_cos();
            behind((d + CLEAR * (c * x + s * y)).normalize())
        });
        (around.filter(|n| *n != here).count(), here, d)
    });
    let best = tried.min_by_key(|(edges, here, _)| (*edges, *here));
    best.map_or((Vec3::Y, 0), |(_, here, d)| (d, here))
}

impl Volume {
    /// Number of prisms that contain `p`.
    fn prisms(&self, p: Vec3) -> i32 {
        let (direction, beyond) = self.outwards;
        let mut hits = Vec::new();
        self.bvh.every(&Ray { origin: p, direction }, self.far, &mut hits);
        let leaves = |t: u32| {
            let [a, b, c] = self.mesh.corners(t as usize);
            let out = (b - a).cross(c - a).dot(direction) > 0.0;
            if out { self.count[t as usize] } else { -self.count[t as usize] }
        };
        beyond + hits.into_iter().map(leaves).sum::<i32>()
    }

    fn boundary(&self, light: LightAt) -> Boundary {
        let (caps, sides) = self.mesh.triangles.split_at(self.caps);
        let (cap_count, side_count) = self.count.split_at(self.caps);
        let sides = sides.iter().zip(side_count).step_by(2).map(|([q, p, _], n)| ([*p, *q], *n));
        Boundary {
            light,
            caps: caps.iter().copied().zip(cap_count.iter().copied()).collect(),
            sides: sides.collect(),
        }
    }
}

impl Blocker for ShadowVolumes {
    fn arriving(&self, ray: &Ray, _: Vec3, distance: f32) -> f32 {
        let blocked = meant(&self.volumes, ray, distance).is_some_and(|(_, v)| v.prisms(ray.origin) > 0);
        f32::from(u8::from(!blocked))
    }

    fn is_portable(&self) -> bool {
        self.volumes.len() <= Volumes::MOST
    }

    fn flat(&self) -> Option<Flat> {
        let (_, first) = self.volumes.first()?;
        let positions = first.mesh.positions[..self.places].iter().map(|p| p.to_array()).collect();
        let lights = self.volumes.iter().map(|(light, v)| v.boundary(*light)).collect();
        self.is_portable().then_some(Flat::Volumes(Arc::new(Volumes { positions, lights })))
    }
}
