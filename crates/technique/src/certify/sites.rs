//! Certificates of techniques with sites: shading at points of the surface, or at a sample of other sites,
//! against paths through the mesh.
//!
//! At each site, distant light is drawn in proportion to its brightness by a lattice with random shifts
//! (Cranley & Patterson 1976), rays tell what the mesh blocks, and further scattering events follow the
//! cosine. The spread of the shifts' means is the noise of the value, which is stated; it is part of the
//! error as stated, so that this is hardly ever too small.

use super::errors::{Errors, ProbeSample};
use super::{Estimate, Report, Shade};
use crate::shared::geometry::transport;
use crate::{BakeError, Geometry, PointsBuf};
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::ops::Range;
use steradian_base::{Certificate, Task};
use steradian_brdf::Brdf;
use steradian_light::Lights;
use steradian_parallel::prelude::*;
use steradian_scene::{Bvh, Ray};
use steradian_sphere::Frame;
use steradian_sphere::sampling::{Pcg32, R2, SphereDistribution, cone, cosine_hemisphere};
use steradian_transfer::Site;

/// Default number of points at which radiance is compared.
pub const SITES: usize = 96;
/// Views of each point: one from anywhere above it, and one whose mirror direction points at the light.
const VIEWS: usize = 2;
/// Random shifts of the lattice: of a noise that eight means show, a quarter (1/√14) is chance.
const SHIFTS: usize = 8;
/// Points of the lattice for [`SITES`] points of the surface: 393,216 paths in all. Where there are more of
/// these, each gets fewer.
const LATTICE: usize = 256;
/// One in so many points of the lattice is traced first.
const FIRST_ONE_IN: u32 = 8;
/// Where the noise of those is at most this part of the error found, the others are not traced: it adds less
/// than a hundredth to that error.
const NEGLIGIBLE: f64 = 0.1;
/// Distance, scene units, that rays start off the surface, along the normal: the path tracer's default.
const OFFSET: f32 = 1e-4;
/// Definition of the stated error, as certificates print it.
const METRIC: &str = "relative RMS error of outgoing radiance over points of the mesh and views, half of them mirroring light, against paths through it";

/// The scene that paths are traced through.
pub struct Paths<'a> {
    /// The mesh and its sites.
    pub geometry: &'a Geometry,
    /// All light.
    pub lights: &'a Lights,
    /// The reflectance of the sites, and of mesh slots without a material.
    pub brdf: &'a dyn Brdf,
    /// Scattering events at most.
    pub events: u32,
    /// Number of points at which radiance is compared.
    pub points: usize,
    /// Are views weighted by projected area, n·v, as pixels of a picture are, or all equally? At grazing
    /// views interpolated normals can mirror light from behind their own triangle; such a view is off by a
    /// whole highlight, although a picture shows little of it.
    pub projected: bool,
}

/// A point that reflects.
#[derive(Clone, Copy)]
struct Vertex<'a> {
    p: DVec3,
    /// The side that rays start on.
    side: DVec3,
    frame: Frame,
    wo: DVec3,
    brdf: &'a dyn Brdf,
}

impl Paths<'_> {
    /// What `shade` errs by, in the words of a technique that says this of itself.
    pub fn certificate(
        &self,
        slug: &'static str,
        report: &Report,
        task: &Task,
        shade: Shade<'_>,
    ) -> Result<Certificate, BakeError> {
        let (errors, noise) = self.errors(slug, task, shade)?;
        // Errors that techniques compute by elevation are those of open sites. Shadows and interpolation
        // between sites, most of the error, are in the measured belts alone.
        let estimate = report.estimate.clone().map(|e| Estimate { elevations: Vec::new(), ..e });
        let report = Report { estimate, ..report.clone() };
        Ok(errors.certificate(&report).metric(METRIC).detail("noise of the paths", noise))
    }

    /// What `shade` errs by, and the noise of what it is held against, relative like the errors.
    pub fn errors(
        &self,
        slug: &'static str,
        task: &Task,
        shade: Shade<'_>,
    ) -> Result<(Errors, f64), BakeError> {
        let sample = self.spots(slug)?;
        let image = self.lights.environment.as_ref().and_then(|e| SphereDistribution::new(&e.image));
        let (mut q, mut views) = (PointsBuf::default(), Vec::new());
        for (k, &Spot { site, corners, weights }) in sample.iter().enumerate() {
            for view in 0..VIEWS {
                let frame = Frame::from_normal(site.n.as_dvec3().normalize());
                let u = R2::default().point((VIEWS * k + view) as u32);
                // In half of the views the mirror direction points at the light: only few views see what a
                // glossy surface reflects of a sun.
                let mirrored = (view % 2 == 1).then(|| self.mirrored(&frame, k, u, image.as_ref())).flatten();
                let wo = mirrored.unwrap_or_else(|| steradian_sphere::sampling::hemisphere::sample(u));
                q.push(site.n, frame.t.as_vec3(), frame.to_world(wo).as_vec3(), site.p);
                q.locate(Vec2::ZERO, corners, weights);
                views.push((site, frame, wo));
            }
        }
        let shaded = q.shaded(&|q, out| {
            task.check()?;
            shade(q, out);
            Ok::<_, BakeError>(())
        })?;
        // The noise of radiance is known by the spread of the shifts' means.
        let judged = |sums: &[Sums], points: u32| {
            let sample = |(k, &(_, _, wo)): (usize, &(Site, Frame, DVec3))| {
                let (exact, variance) = mean(&sums[k], points);
                let weight = if self.projected { wo.z.max(0.0) } else { 1.0 };
                let degrees = wo.z.clamp(-1.0, 1.0).acos().to_degrees();
                (ProbeSample { weight, degrees, shaded: shaded[k].map(f64::from), exact }, weight * variance)
            };
            let (samples, variances): (Vec<_>, Vec<f64>) = views.iter().enumerate().map(sample).unzip();
            let energy: f64 = samples.iter().map(|l| l.squares()[1]).sum();
            let noise: f64 = variances.iter().sum();
            (Errors::of(&samples), if energy > 0.0 { (noise / energy).sqrt() } else { 0.0 })
        };
        let bvh = Bvh::build(&self.geometry.mesh);
        let through = Through { paths: self, bvh: &bvh, image };
        let traced = |points: Range<u32>| -> Result<Vec<Sums>, BakeError> {
            task.begin("certificate", views.len() as u64);
            let of = |(k, &(site, frame, wo)): (usize, &(Site, Frame, DVec3))| {
                task.check()?;
                task.advance(1);
                Ok(through.radiance(site, frame, wo, k as u64, points.clone()))
            };
            let all = views.par_iter().enumerate().map(of).collect();
            task.end();
            all
        };
        let points = (LATTICE * SITES / self.points.max(1)).max(1) as u32;
        let first = points.div_ceil(FIRST_ONE_IN);
        let mut sums = traced(0..first)?;
        let (found, noise) = judged(&sums, first);
        if noise <= NEGLIGIBLE * found.mean {
            return Ok((found, noise));
        }
        let rest = traced(first..points)?;
        sums.iter_mut().flatten().flatten().zip(rest.iter().flatten().flatten()).for_each(|(a, b)| *a += b);
        Ok(judged(&sums, points))
    }
}

/// Sums of the radiance along the paths of each shift.
type Sums = [[f64; 3]; SHIFTS];

/// The mean over all shifts of `points` paths, and its variance, summed over the channels.
fn mean(sums: &Sums, points: u32) -> ([f64; 3], f64) {
    let n = SHIFTS as f64;
    let means = sums.map(|s| s.map(|x| x / f64::from(points)));
    let mean: [f64; 3] = std::array::from_fn(|c| means.iter().map(|m| m[c]).sum::<f64>() / n);
    let off = |m: &[f64; 3]| (0..3).map(|c| (m[c] - mean[c]).powi(2)).sum::<f64>();
    (mean, means.iter().map(off).sum::<f64>() / (n * (n - 1.0)))
}

impl Paths<'_> {
    /// The view that mirrors light, in the local frame: of the `k`-th point that of a sun or of a direction
    /// that is drawn from the image in proportion to its brightness; `None` where that light comes from
    /// below.
    fn mirrored(
        &self,
        frame: &Frame,
        k: usize,
        u: DVec2,
        image: Option<&SphereDistribution>,
    ) -> Option<DVec3> {
        let lights = self.lights;
        let disks = lights.disks.iter().map(|d| d.direction);
        let suns: Vec<DVec3> = disks.chain(lights.directionals.iter().map(|d| d.direction)).collect();
        let d = match (suns.is_empty(), image) {
            (false, image) if k.is_multiple_of(2) || image.is_none() => suns[k / 2 % suns.len()],
            (_, image) => image?.sample(u).0,
        };
        let wi = frame.to_local(d.normalize_or_zero());
        (wi.z > 0.02).then(|| DVec3::new(-wi.x, -wi.y, wi.z))
    }
}

/// A point at which radiance is compared, and its position among the sites.
#[derive(Clone, Copy)]
struct Spot {
    site: Site,
    corners: [u32; 3],
    weights: [f32; 2],
}

impl Paths<'_> {
    /// Points spread over the surface by its area where the sites are vertices, since triangles are
    /// interpolated between them; else some of the sites. Where some triangles are far larger than most, as
    /// those of a ground that reaches the horizon, every second point is spread over the triangles evenly:
    /// fine triangles are where the data change.
    fn spots(&self, slug: &'static str) -> Result<Vec<Spot>, BakeError> {
        let mesh = &self.geometry.mesh;
        if mesh.normals.len() == mesh.positions.len() {
            let triangles: Vec<[u32; 3]> = (0..mesh.triangles.len())
                .filter(|i| self.geometry.spans(*i))
                .map(|i| mesh.triangles[i])
                .collect();
            let area = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
                0.5 * (b - a).cross(c - a).length()
            };
            let areas: Vec<f64> = triangles.iter().map(area).collect();
            let [whole, evenly] = [areas.clone(), evened(&areas)].map(sums);
            let spot = |k: usize| {
                let ends = if k.is_multiple_of(2) { &whole } else { &evenly };
                let at = ends.last().unwrap_or(&0.0) * (k as f64 + 0.5) / self.points as f64;
                let corners = triangles[ends.partition_point(|e| *e < at).min(ends.len() - 1)];
                // Even over a triangle (Turk 1990).
                let u = R2::default().point(k as u32);
                let root = u.x.sqrt();
                let w = [1.0 - root, root * (1.0 - u.y), root * u.y].map(|w| w as f32);
                let mix = |v: &[Vec3]| (0..3).map(|i| v[corners[i] as usize] * w[i]).sum::<Vec3>();
                let n = mix(&mesh.normals).normalize_or(mesh.normals[corners[0] as usize]);
                Spot { site: Site { p: mix(&mesh.positions), n }, corners, weights: [w[1], w[2]] }
            };
            if whole.last().is_some_and(|sum| *sum > 0.0) {
                return Ok((0..self.points).map(spot).collect());
            }
        }
        let all = transport::sites(slug, self.geometry)?;
        let there: Vec<u32> = (0..all.len() as u32).filter(|&k| !all[k as usize].is_absent()).collect();
        let count = self.points.min(there.len());
        let sites = (0..count).map(|k| there[k * there.len() / count.max(1)]);
        Ok(sites.map(|s| Spot { site: all[s as usize], corners: [s; 3], weights: [0.0; 2] }).collect())
    }
}

/// Triangles of so many times the median's area are far larger than most.
const FAR_LARGER: f64 = 1e4;

/// The areas, cut to the median where some are far larger.
fn evened(areas: &[f64]) -> Vec<f64> {
    let mut sorted = areas.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let most = sorted.last().copied().unwrap_or(0.0);
    let most = if most > FAR_LARGER * median && median > 0.0 { median } else { most };
    areas.iter().map(|a| a.min(most)).collect()
}

/// The sums up to each.
fn sums(mut of: Vec<f64>) -> Vec<f64> {
    let mut sum = 0.0;
    for x in &mut of {
        sum += *x;
        *x = sum;
    }
    of
}

/// The paths' scene with its acceleration structure and a sampler of the image.
struct Through<'a> {
    paths: &'a Paths<'a>,
    bvh: &'a Bvh,
    image: Option<SphereDistribution>,
}

impl<'a> Through<'a> {
    /// Sums of the radiance that leaves a site, along the paths of these points of the lattice.
    fn radiance(&self, site: Site, frame: Frame, wo: DVec3, index: u64, points: Range<u32>) -> Sums {
        let v = Vertex { p: site.p.as_dvec3(), side: frame.n, frame, wo, brdf: self.paths.brdf };
        std::array::from_fn(|shift| {
            let mut random = Pcg32::new(index, shift as u64);
            let lattice = R2 { shift: DVec2::new(random.next_f64(), random.next_f64()) };
            if points.start > 0 {
                random = Pcg32::new(index, (SHIFTS + shift) as u64);
            }
            let mut sum = [0.0; 3];
            for k in points.clone() {
                let l = self.path(v, lattice.point(k), &mut random);
                (0..3).for_each(|c| sum[c] += l[c]);
            }
            sum
        })
    }

    /// Light along one path: direct light at each of its points.
    fn path(&self, first: Vertex<'a>, u: DVec2, random: &mut Pcg32) -> [f64; 3] {
        let (mut v, mut u) = (first, u);
        let (mut sum, mut throughput) = ([0.0; 3], [1.0; 3]);
        for event in 0..self.paths.events {
            if v.wo.z <= 0.0 {
                break;
            }
            let mut direct = self.direct(self.paths.lights, &v, u, random);
            // Direct light of suns shaded exactly is not in the baked data; what surfaces reflect of it is.
            if let (1.., Some(apart)) = (event, &self.paths.lights.apart) {
                let more = self.direct(apart, &v, u, random);
                (0..3).for_each(|c| direct[c] += more[c]);
            }
            (0..3).for_each(|c| sum[c] += throughput[c] * direct[c]);
            if event + 1 == self.paths.events {
                break;
            }
            let wi = cosine_hemisphere::sample(DVec2::new(random.next_f64(), random.next_f64()));
            let f = v.brdf.f_cos(wi, v.wo);
            (0..3).for_each(|c| throughput[c] *= f[c] / cosine_hemisphere::pdf(wi).max(f64::MIN_POSITIVE));
            let Some(next) = self.hit(&v, v.frame.to_world(wi)) else { break };
            v = next;
            u = DVec2::new(random.next_f64(), random.next_f64());
        }
        sum
    }

    /// Light of `lights` that reaches a point, and is reflected by it.
    fn direct(&self, lights: &Lights, v: &Vertex<'_>, u: DVec2, random: &mut Pcg32) -> [f64; 3] {
        let mut sum = [0.0; 3];
        if let (Some(image), Some(e)) = (&self.image, &lights.environment) {
            let (texel, d, pdf) = image.sample_texel(u);
            if pdf > 0.0 {
                let l = std::array::from_fn(|c| f64::from(e.image.planes[c][texel]) / pdf);
                self.lit(v, d, l, &mut sum);
            }
        }
        for disk in &lights.disks {
            let axis = Frame::from_normal(disk.direction.normalize_or(DVec3::Y));
            let u = DVec2::new(random.next_f64(), random.next_f64());
            let d = axis.to_world(cone::sample(cone::versine(disk.angular_radius), u));
            self.lit(v, d, disk.radiance.map(|x| x * disk.solid_angle()), &mut sum);
        }
        for light in &lights.directionals {
            self.lit(v, light.direction.normalize_or_zero(), light.irradiance, &mut sum);
        }
        sum
    }

    /// Adds f_cos · E of light from `d` that nothing blocks.
    fn lit(&self, v: &Vertex<'_>, d: DVec3, e: [f64; 3], sum: &mut [f64; 3]) {
        let f = v.brdf.f_cos(v.frame.to_local(d), v.wo);
        if f != [0.0; 3] && !self.bvh.occluded(&ray(v, d), f32::INFINITY) {
            (0..3).for_each(|c| sum[c] += f[c] * e[c]);
        }
    }

    fn hit(&self, v: &Vertex<'_>, d: DVec3) -> Option<Vertex<'a>> {
        let mesh = &self.paths.geometry.mesh;
        let s = mesh.surface(&self.bvh.closest(&ray(v, d), f32::INFINITY)?);
        let frame = Frame::from_normal(s.normal.as_dvec3().normalize());
        let own = self.paths.geometry.materials.get(s.material as usize);
        Some(Vertex {
            p: s.position.as_dvec3(),
            side: s.geometric_normal.as_dvec3(),
            frame,
            wo: frame.to_local(-d),
            brdf: own.map_or(self.paths.brdf, |m| &*m.brdf),
        })
    }
}

/// The ray that leaves a vertex, off the surface on the side that it leaves to.
fn ray(v: &Vertex<'_>, d: DVec3) -> Ray {
    let side = if d.dot(v.side) < 0.0 { -v.side } else { v.side };
    Ray { origin: v.p.as_vec3() + side.as_vec3() * OFFSET, direction: d.as_vec3().normalize() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sites;
    use std::sync::Arc;
    use steradian_base::Elevation;
    use steradian_brdf::parse;
    use steradian_scene::{Mesh, shapes};

    /// Direct light at the usual number of points.
    fn direct<'a>(geometry: &'a Geometry, lights: &'a Lights, brdf: &'a dyn Brdf) -> Paths<'a> {
        Paths { geometry, lights, brdf, events: 1, points: SITES, projected: false }
    }

    /// Over a plane of 20 kilometres around a small ball half of the points lie on the ball; on its own no
    /// triangle is favoured.
    #[test]
    fn fine_triangles_over_a_ground_get_half_of_the_points() {
        let ground = shapes::by_name("plane:size=20000,y=-2").expect("a shape");
        let both = Mesh::merged(&[shapes::icosphere(3), ground]);
        let lights = Lights::default();
        let brdf = parse("lambert").expect("a spec");
        let near = |mesh: Mesh| {
            let geometry = Geometry::new(Arc::new(mesh), Sites::Vertices);
            let paths = direct(&geometry, &lights, &*brdf);
            let spots = paths.spots("a").expect("spots");
            spots.iter().filter(|s| s.site.p.length() < 1.5).count()
        };
        assert!((SITES / 2 - 1..=SITES / 2 + 1).contains(&near(both)));
        assert_eq!(near(shapes::icosphere(3)), SITES);
        let areas = [1.0, 2.0, 1.0, 1e3];
        assert_eq!(evened(&areas), areas);
    }

    /// Shading that is right is compared with more paths than shading that is far off.
    #[test]
    fn paths_are_as_many_as_the_error_needs() {
        let geometry = Geometry::new(Arc::new(shapes::icosphere(3)), Sites::Vertices);
        let (lights, brdf) = (crate::shared::trials::lights::furnace(), parse("lambert:albedo=0.5").unwrap());
        let paths = direct(&geometry, &lights, &*brdf);
        let of = |radiance: f32| {
            let shade = |_: &crate::Points<'_>, out: &mut crate::Radiance<'_>| {
                out.rgb.iter_mut().for_each(|c| c.fill(radiance))
            };
            paths.errors("a", &Task::quiet(), &shade).unwrap()
        };
        let ((right, most), (off, few)) = (of(0.5), of(1.0));
        assert!(most < 0.5 * few && few < NEGLIGIBLE, "{most} {few}");
        assert!(right.mean < 2.0 * most && (off.mean - 1.0).abs() < 2.0 * few, "{right:?} {off:?}");
    }

    /// A technique that computes next to no error by elevation, and shades a tenth too much, is told so.
    #[test]
    fn elevations_are_measured_whatever_was_computed() {
        let geometry = Geometry::new(Arc::new(shapes::icosphere(3)), Sites::Vertices);
        let (lights, brdf) = (crate::shared::trials::lights::furnace(), parse("lambert:albedo=0.5").unwrap());
        let paths = direct(&geometry, &lights, &*brdf);
        let tiny = |degrees: f64| Elevation::measured([degrees.to_radians(); 2], 1e-6);
        let report = Report::estimated(1e-6, vec![tiny(0.0), tiny(80.0)]);
        let shade = |_: &crate::Points<'_>, out: &mut crate::Radiance<'_>| {
            out.rgb.iter_mut().for_each(|c| c.fill(0.55))
        };
        let c = paths.certificate("a", &report, &Task::quiet(), &shade).unwrap();
        for degrees in [5.0f64, 40.0, 70.0] {
            let error = c.at(degrees.to_radians()).expect("an elevation");
            assert!((0.08..0.2).contains(&error), "{degrees}: {error}");
        }
    }
}
