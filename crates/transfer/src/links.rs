//! Links: which point of a mesh each site sees along fixed directions (Daubert, Heidrich, Kautz, Dischler &
//! Seidel 2003, *Efficient Light Transport Using Precomputed Visibility*; Carr, Hall & Hart 2003, *GPU
//! Algorithms for Radiosity and Subsurface Scattering*; Kautz 2004 (STAR), 6.4.3).
//!
//! All sites have the same directions, in the mesh's own axes, so that light that arrives along one of them
//! may be interpolated between sites. Links do not depend on light and reflectance. Surfaces seen from behind
//! count as not seen.

use crate::{Scene, Site, TransferError, memory};
use glam::Vec3;
use steradian_base::Task;
use steradian_parallel::prelude::*;
use steradian_scene::{Hit, Mesh, Ray};

/// A point of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The triangle; [`Link::NONE`] where nothing is seen.
    pub triangle: u32,
    /// Weights of its second and third corner.
    pub weight: [f32; 2],
}

impl Link {
    /// Index of a direction in which nothing is seen.
    pub const NONE: u32 = u32::MAX;
}

/// The surface points that sites see along fixed directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Links {
    /// All links, site by site, of a site direction by direction.
    pub links: Vec<Link>,
    /// Links of each site.
    pub directions: usize,
}

impl Links {
    /// The links of `sites` along unit `directions`; a site has none along directions below its horizon. Rays
    /// start `offset` off the surface.
    ///
    /// # Errors
    /// If a site has no unit normal, if the links do not fit the memory, or if the task is
    /// cancelled.
    pub fn new(
        scene: &Scene<'_>,
        sites: &[Site],
        directions: &[Vec3],
        offset: f32,
        task: &Task,
    ) -> Result<Self, TransferError> {
        Site::check(sites)?;
        let count = directions.len();
        let bytes = size_of::<Link>() as u64 * count as u64 * sites.len() as u64;
        memory("links", bytes, task, "take fewer directions")?;
        let nothing = Link { triangle: Link::NONE, weight: [0.0; 2] };
        let mut links = vec![nothing; count * sites.len()];
        task.begin("links", sites.len() as u64);
        let done = links.par_chunks_mut(count.max(1)).zip(sites.par_iter()).with_max_len(64).try_for_each(
            |(links, site)| {
                if site.is_absent() {
                    return Ok(());
                }
                task.check()?;
                let origin = site.p + site.n * offset;
                let above: Vec<usize> = (0..count).filter(|k| directions[*k].dot(site.n) > 0.0).collect();
                let rays: Vec<Ray> =
                    above.iter().map(|k| Ray { origin, direction: directions[*k] }).collect();
                let mut hits = vec![None; rays.len()];
                scene.bvh.closest_each(&rays, f32::INFINITY, &mut hits);
                for ((hit, ray), k) in hits.iter().zip(&rays).zip(above) {
                    if let Some(h) = hit.filter(|h| faces(scene.mesh, h, ray.direction)) {
                        links[k] = Link { triangle: h.triangle, weight: [h.u, h.v] };
                    }
                }
                task.advance(1);
                Ok(())
            },
        );
        task.end();
        done.map(|()| Self { directions: count, links })
    }
}

/// Does the hit point turn its front to where the ray comes from?
pub(crate) fn faces(mesh: &Mesh, hit: &Hit, direction: Vec3) -> bool {
    let [a, b, c] = mesh.triangles[hit.triangle as usize].map(|v| mesh.normals[v as usize]);
    let n = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
    n.dot(direction) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::quadrature::fibonacci;

    /// A rectangle of `n` × `m` squares from `o` along `u` and `v`, whose front is on the side of u × v.
    fn wall(o: Vec3, u: Vec3, v: Vec3, [n, m]: [usize; 2]) -> Mesh {
        let mut mesh = Mesh::default();
        for k in 0..(n + 1) * (m + 1) {
            let (i, j) = (k % (n + 1), k / (n + 1));
            mesh.positions.push(o + u * (i as f32 / n as f32) + v * (j as f32 / m as f32));
            mesh.normals.push(u.cross(v).normalize());
        }
        for k in 0..n * m {
            let a = (k / n * (n + 1) + k % n) as u32;
            let (b, c) = (a + 1, a + n as u32 + 1);
            mesh.triangles.extend([[a, b, c], [b, c + 1, c]]);
        }
        mesh
    }

    /// A unit box seen from inside: floor first, then ceiling and four walls.
    fn inside() -> Mesh {
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z];
        let all =
            [(Vec3::ZERO, z, x), (y, x, z), (Vec3::ZERO, x, y), (z, y, x), (Vec3::ZERO, y, z), (x, z, y)];
        Mesh::merged(&all.map(|(o, u, v)| wall(o, u, v, [8, 8])))
    }

    fn site(mesh: &Mesh, triangle: usize) -> Site {
        let t = mesh.triangles[triangle].map(|k| k as usize);
        Site { p: t.iter().map(|k| mesh.positions[*k]).sum::<Vec3>() / 3.0, n: mesh.normals[t[0]] }
    }

    /// Opposite walls of a cube have the form factor 0.199825, neighbours 0.200044 (Howell, C-11 and C-14); a
    /// wall sees nothing but walls.
    #[test]
    fn a_boxs_walls_have_their_form_factors() {
        let mesh = inside();
        let scene = Scene::new(&mesh).expect("triangles");
        let sites: Vec<Site> = (0..mesh.triangles.len()).map(|t| site(&mesh, t)).collect();
        let directions: Vec<Vec3> = fibonacci(512).directions.iter().map(|d| d.as_vec3()).collect();
        let links = Links::new(&scene, &sites, &directions, 1e-5, &Task::quiet()).expect("links");
        for (k, want) in [0.0, 0.199_825, 0.200_044, 0.200_044, 0.200_044, 0.200_044].into_iter().enumerate()
        {
            let (mut seen, mut all) = (0.0, 0.0);
            for (site, links) in sites.iter().zip(links.links.chunks(512)).skip(128 * k).take(128) {
                for (d, l) in directions.iter().zip(links).filter(|(d, _)| d.dot(site.n) > 0.0) {
                    assert_ne!(l.triangle, Link::NONE);
                    all += d.dot(site.n);
                    seen += if l.triangle < 128 { d.dot(site.n) } else { 0.0 };
                }
            }
            let mean = f64::from(seen / all);
            assert!((mean - want).abs() <= 0.01 * want, "wall {k}: {mean} {want}");
        }
    }

    /// Nothing is seen from behind; threads change no bit.
    #[test]
    fn backs_are_not_seen_and_links_repeat() {
        let mesh = inside();
        let scene = Scene::new(&mesh).expect("triangles");
        let vertices = Site::vertices(&mesh);
        let directions: Vec<Vec3> = fibonacci(64).directions.iter().map(|d| d.as_vec3()).collect();
        let made =
            |sites: &[Site]| Links::new(&scene, sites, &directions, 1e-4, &Task::quiet()).expect("links");
        let links = made(&vertices);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        assert!(one.install(|| made(&vertices)) == links);
        // From outside the walls show their backs.
        let outside = [Site { p: Vec3::new(0.5, 2.0, 0.5), n: Vec3::NEG_Y }];
        assert!(made(&outside).links.iter().all(|l| l.triangle == Link::NONE));
    }
}
