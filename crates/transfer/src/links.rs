//! Links: which point of a mesh each site sees along fixed directions, and the diffuse light that goes along them (Daubert,
//! Heidrich, Kautz, Dischler & Seidel 2003, *Efficient Light Transport Using Precomputed Visibility*; Carr, Hall & Hart 2003, *GPU
//! Algorithms for Radiosity and Subsurface Scattering*; Kautz 2004 (STAR), 6.4.3).
//!
//! Light may change from frame to frame, as it is no part of the links. Irradiance of the vertices, from whatever light, becomes that of
//! the sites after a reflection,
//!
//! > E⁽ᵏ⁺¹⁾(x) = (1/N) Σ_i ρ(x_i) E⁽ᵏ⁾(x_i), x_i what x sees along d_i,
//!
//! with N directions d_i about the site's normal that are cosine-distributed, so that all weigh the same. E at x_i is interpolated
//! between the corners of its triangle; surfaces seen from behind are black.

use crate::{Scene, Site, TransferError, memory};
use glam::Vec3;
use std::f64::consts::TAU;
use steradian_base::Task;
use steradian_parallel::prelude::*;
use steradian_scene::{Hit, Mesh, Ray};
use steradian_sphere::Frame;

/// A point of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The triangle; [`Link::NONE`] where nothing is seen.
    pub triangle: u32,
    /// Weights of its second and third corner.
    pub weight: [f32; 2],
}

impl Link {
    /// The triangle of a direction in which nothing is seen.
    pub const NONE: u32 = u32::MAX;
}

/// What sites see of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Links {
    directions: usize,
    links: Vec<Link>,
}

/// Directions about the axis z, cosine-distributed: Vogel's spiral on the disk below them.
fn directions(count: usize) -> Vec<Vec3> {
    let one = |k: usize| {
        let r2 = (k as f64 + 0.5) / count as f64;
        let (sin, cos) = (k as f64 * TAU * 0.381_966_011_250_105).sin_cos();
        Vec3::new((r2.sqrt() * cos) as f32, (r2.sqrt() * sin) as f32, (1.0 - r2).sqrt() as f32)
    };
    (0..count).map(one).collect()
}

impl Links {
    /// The links of `sites` along `count` directions each; rays start `offset` off the surface.
    ///
    /// # Errors
    /// If a site has no unit normal, if they do not fit the memory, or if the task is cancelled.
    pub fn new(
        scene: &Scene<'_>,
        sites: &[Site],
        count: usize,
        offset: f32,
        task: &Task,
    ) -> Result<Self, TransferError> {
        Site::check(sites)?;
        let bytes = size_of::<Link>() as u64 * count as u64 * sites.len() as u64;
        memory("links", bytes, task, "take fewer directions")?;
        let local = directions(count);
        let nothing = Link { triangle: Link::NONE, weight: [0.0; 2] };
        let mut links = vec![nothing; count * sites.len()];
        task.begin("links", sites.len() as u64);
        let done = links.par_chunks_mut(count.max(1)).zip(sites.par_iter()).with_max_len(64).try_for_each(
            |(links, site)| {
                if site.is_absent() {
                    return Ok(());
                }
                task.check()?;
                let frame = Frame::from_normal(site.n.as_dvec3().normalize()).matrix().as_mat3();
                let origin = site.p + site.n * offset;
                let rays: Vec<Ray> = local.iter().map(|d| Ray { origin, direction: frame * *d }).collect();
                let mut hits = vec![None; rays.len()];
                scene.bvh.closest_each(&rays, f32::INFINITY, &mut hits);
                for ((hit, ray), link) in hits.iter().zip(&rays).zip(links) {
                    if let Some(h) = hit.filter(|h| faces(scene.mesh, h, ray.direction)) {
                        *link = Link { triangle: h.triangle, weight: [h.u, h.v] };
                    }
                }
                task.advance(1);
                Ok(())
            },
        );
        task.end();
        done.map(|()| Self { directions: count, links })
    }

    /// Directions of a site.
    pub fn directions(&self) -> usize {
        self.directions
    }

    /// All links, site by site.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Irradiance of the sites by light that arrives at the mesh's vertices with the irradiance `from` and is reflected once, by
    /// the albedo of each triangle's material slot (the last goes on for slots beyond it).
    pub fn reflected(&self, mesh: &Mesh, albedo: &[[f64; 3]], from: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let site = |links: &[Link]| {
            let mut sum = [0.0f64; 3];
            for l in links.iter().filter(|l| l.triangle != Link::NONE) {
                let slot = mesh.material(l.triangle as usize) as usize;
                let Some(albedo) = albedo.get(slot).or(albedo.last()) else { continue };
                let [v, w] = l.weight;
                let corners = mesh.triangles[l.triangle as usize].map(|k| from[k as usize]);
                for c in 0..3 {
                    let [x, y, z] = corners.map(|e| e[c]);
                    sum[c] += albedo[c] * f64::from((1.0 - v - w) * x + v * y + w * z);
                }
            }
            sum.map(|s| (s / self.directions as f64) as f32)
        };
        self.links.par_chunks(self.directions.max(1)).map(site).collect()
    }

    /// The sum of what arrives after 1, 2, … `bounces` reflections, of links whose sites are the mesh's vertices.
    pub fn radiosity(
        &self,
        mesh: &Mesh,
        albedo: &[[f64; 3]],
        direct: &[[f32; 3]],
        bounces: usize,
    ) -> Vec<[f32; 3]> {
        let mut sum = vec![[0.0f32; 3]; direct.len()];
        let mut last = direct.to_vec();
        for _ in 0..bounces {
            last = self.reflected(mesh, albedo, &last);
            for (to, more) in sum.iter_mut().zip(&last) {
                (0..3).for_each(|c| to[c] += more[c]);
            }
        }
        sum
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

    /// Opposite walls of a cube have the form factor 0.199825, neighbours 0.200044 (Howell, C-11 and C-14); all of what a wall
    /// sees is walls.
    #[test]
    fn a_boxs_walls_have_their_form_factors() {
        let mesh = inside();
        let scene = Scene::new(&mesh).expect("triangles");
        let sites: Vec<Site> = (0..mesh.triangles.len()).map(|t| site(&mesh, t)).collect();
        let links = Links::new(&scene, &sites, 256, 1e-5, &Task::quiet()).expect("links");
        let every = vec![[1.0; 3]; mesh.positions.len()];
        for e in links.reflected(&mesh, &[[0.7, 0.5, 0.0]], &every) {
            assert!((e[0] - 0.7).abs() < 1e-3 && (e[1] - 0.5).abs() < 1e-3 && e[2] == 0.0, "{e:?}");
        }
        let floor: Vec<[f32; 3]> = (0..every.len()).map(|k| [f32::from(u8::from(k < 81)); 3]).collect();
        let e = links.reflected(&mesh, &[[1.0; 3]], &floor);
        for (k, want) in [0.0, 0.199_825, 0.200_044, 0.200_044, 0.200_044, 0.200_044].into_iter().enumerate()
        {
            let mean = e[128 * k..128 * (k + 1)].iter().map(|e| f64::from(e[0])).sum::<f64>() / 128.0;
            assert!((mean - want).abs() <= 0.01 * want, "wall {k}: {mean} {want}");
        }
    }

    /// Walls of a long groove of opening 90°, evenly lit: the first bounce is ρEF in the mean, F = 1 − sin 45°, and the second
    /// ρ²E ∫ f² with f(x) = ½ (1 − x/√(1 + x²)) at the distance x from the bottom: ¼ (2 − 2(√2 − 1) − π/4).
    #[test]
    fn a_grooves_bounces_have_their_closed_forms() {
        const N: usize = 48;
        let long = Vec3::Z * 400.0;
        let (up, side) = (Vec3::Y, Vec3::X);
        let mesh =
            Mesh::merged(&[wall(-0.5 * long, up, long, [N, 1]), wall(-0.5 * long, long, side, [1, N])]);
        let scene = Scene::new(&mesh).expect("triangles");
        let links = |sites: &[Site]| Links::new(&scene, sites, 1024, 1e-5, &Task::quiet()).expect("links");
        let direct = vec![[1.0; 3]; mesh.positions.len()];
        // At the ends of the groove vertices see half of it: so that E depends on the height alone, the middle's goes everywhere.
        let middle: Vec<Site> = (0..=N)
            .map(|k| Site { p: up * ((k as f32).clamp(0.01, N as f32) / N as f32), n: Vec3::X })
            .collect();
        let middle = links(&middle);
        let along = |e: &[[f32; 3]]| -> Vec<[f32; 3]> {
            mesh.positions.iter().map(|p| e[(p.x.max(p.y) * N as f32).round() as usize]).collect()
        };
        let mean = |e: &[[f32; 3]]| {
            let ends = 0.5 * f64::from(e[0][0] + e[N][0]);
            (ends + e[1..N].iter().map(|e| f64::from(e[0])).sum::<f64>()) / N as f64
        };
        let albedo = 0.8;
        let once = middle.reflected(&mesh, &[[albedo; 3]], &direct);
        let twice = middle.reflected(&mesh, &[[albedo; 3]], &along(&once));
        let root = 2.0f64.sqrt();
        let form = 1.0 - 1.0 / root;
        let second = 0.25 * (1.0 - 2.0 * (root - 1.0) + 1.0 - std::f64::consts::FRAC_PI_4);
        assert!((mean(&once) - albedo * form).abs() < 0.01 * form, "{}", mean(&once));
        assert!((mean(&twice) - albedo * albedo * second).abs() < 0.02 * second, "{}", mean(&twice));
    }

    /// Bounces add up; nothing is seen from behind; threads change no bit.
    #[test]
    fn reflections_add_up() {
        let mesh = inside();
        let scene = Scene::new(&mesh).expect("triangles");
        let vertices = Site::vertices(&mesh);
        let made = || Links::new(&scene, &vertices, 64, 1e-4, &Task::quiet()).expect("links");
        let links = made();
        let direct: Vec<[f32; 3]> = (0..vertices.len()).map(|k| [(k % 7) as f32, 1.0, 0.0]).collect();
        let albedo = [[0.5, 0.8, 0.9]];
        let once = links.reflected(&mesh, &albedo, &direct);
        let twice = links.reflected(&mesh, &albedo, &once);
        let sum = links.radiosity(&mesh, &albedo, &direct, 2);
        for ((a, b), s) in once.iter().zip(&twice).zip(&sum) {
            assert!((0..3).all(|c| (a[c] + b[c] - s[c]).abs() < 1e-6), "{a:?} {b:?} {s:?}");
        }
        assert_eq!(links.radiosity(&mesh, &albedo, &direct, 0), vec![[0.0; 3]; vertices.len()]);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        assert!(one.install(made) == links);
        // From outside the walls show their backs.
        let outside = [Site { p: Vec3::new(0.5, 2.0, 0.5), n: Vec3::NEG_Y }];
        let none = Links::new(&scene, &outside, 64, 0.0, &Task::quiet()).expect("links");
        assert!(none.links().iter().all(|l| l.triangle == Link::NONE));
    }
}
