//! One tile: find, refine, shade, filter.

use super::filter::{position, weights};
use super::hits::{Found, find};
use super::look::look;
use super::sparse::Seen;
use super::{Settings, Shader, Stage};
use crate::Film;
use glam::Vec3;
use steradian_base::{Cancelled, Task};
use steradian_scene::{Camera, Ray};
use steradian_technique::{PointChart, PointsBuf, Radiance};

/// Points per call of a shader.
const BATCH: usize = 2048;

/// A finished tile.
pub struct Tile {
    at: (usize, usize),
    size: (usize, usize),
    /// Red, green, blue and coverage of every pixel, then how much of red, green and blue is background.
    pixels: Vec<[f32; 7]>,
}

/// One sample: its place in a pixel of the padded tile, and its weight in that pixel.
#[derive(Clone, Copy)]
struct Sample {
    pixel: u32,
    x: f32,
    y: f32,
    area: f32,
    value: [f32; 4],
}

/// The points of one surface, and the samples they belong to.
#[derive(Default)]
struct Group {
    points: PointsBuf,
    tint: Vec<[f32; 3]>,
    /// Emitted radiance; empty where the surface emits none.
    emission: Vec<[f32; 3]>,
    /// Small lights that each point sees.
    lights: Vec<u64>,
    /// For each point the first one of its pixel that is equal except for these lights, or itself.
    twins: Vec<u32>,
    /// For each point the first one of its pixel that is shadowed as it is, or itself.
    shadows: Vec<u32>,
    /// Sample and point.
    pairs: Vec<(u32, u32)>,
}

/// A point of the present pixel that further samples may share.
struct Shared {
    surface: usize,
    point: u32,
    n: Vec3,
    lights: u64,
}

/// A tile with a border of one pixel, which the filter reaches.
struct Job<'a> {
    stage: &'a Stage<'a>,
    settings: &'a Settings,
    /// Film position of the padded tile's corner; may be −1.
    origin: (isize, isize),
    width: usize,
    height: usize,
    samples: Vec<Sample>,
    groups: Vec<Group>,
    /// Points of the present pixel.
    shared: Vec<Shared>,
}

impl Tile {
    /// Renders the tile at `at` of `size` pixels.
    pub fn render(
        stage: &Stage<'_>,
        settings: &Settings,
        at: (usize, usize),
        size: (usize, usize),
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let mut job = Job {
            stage,
            settings,
            origin: (at.0 as isize - 1, at.1 as isize - 1),
            width: size.0 + 2,
            height: size.1 + 2,
            samples: Vec::new(),
            groups: (0..stage.surfaces.len()).map(|_| Group::default()).collect(),
            shared: Vec::new(),
        };
        job.place_samples();
        job.shade(task)?;
        Ok(Self { at, size, pixels: job.filter(size) })
    }

    /// Writes the tile into the film.
    pub fn copy_to(&self, film: &mut Film) {
        for (i, p) in self.pixels.iter().enumerate() {
            let k = (self.at.1 + i / self.size.0) * film.width + self.at.0 + i % self.size.0;
            (0..3).for_each(|c| film.rgb[c][k] = p[c]);
            film.alpha[k] = p[3];
            (0..3).for_each(|c| film.background[c][k] = p[4 + c]);
        }
    }
}

impl Job<'_> {
    fn ray(&self, pixel: usize, (x, y): (f32, f32)) -> Ray {
        let fx = (self.origin.0 + (pixel % self.width) as isize) as f32 + x;
        let fy = (self.origin.1 + (pixel / self.width) as isize) as f32 + y;
        self.stage.camera.ray(fx, fy, self.settings.width as u32, self.settings.height as u32)
    }

    fn place_samples(&mut self) {
        let n = self.settings.inner.max(1);
        let per = n * n;
        let pixels = self.width * self.height;
        let cast = |pixel: usize, k: usize| find(self.stage, &self.ray(pixel, position(k, n)));
        let mut first: Vec<Option<Found>> = (0..pixels * per).map(|i| cast(i / per, i % per)).collect();
        self.see_lights(&mut first);
        let sharp = self.sharp_pixels(&first, per);
        let edge = self.settings.edge.max(n);
        for pixel in 0..pixels {
            let found = &first[pixel * per..(pixel + 1) * per];
            self.shared.clear();
            if sharp[pixel] && edge > n {
                let at = |k: usize| position(k, edge);
                let mut hits: Vec<Option<Found>> =
                    (0..edge * edge).map(|k| find(self.stage, &self.ray(pixel, at(k)))).collect();
                self.see_lights(&mut hits);
                for (k, hit) in hits.into_iter().enumerate() {
                    self.add(pixel, at(k), 1.0 / (edge * edge) as f32, hit);
                }
            } else if found.iter().all(Option::is_none) {
                self.add(pixel, (0.5, 0.5), 1.0, None);
            } else {
                for (k, f) in found.iter().enumerate() {
                    self.add(pixel, position(k, n), 1.0 / per as f32, *f);
                }
            }
        }
    }

    /// Notes at points of shadowed surfaces which lights they see.
    fn see_lights(&self, found: &mut [Option<Found>]) {
        for (k, surface) in self.stage.surfaces.iter().enumerate() {
            let own: Vec<usize> =
                (0..found.len()).filter(|i| found[*i].is_some_and(|f| f.surface == k)).collect();
            let mut points = PointsBuf::with_capacity(own.len());
            own.iter().filter_map(|i| found[*i]).for_each(|f| points.push(f.n, f.tangent, f.wo, f.p));
            let seen = surface.shader.lights_seen(&points.as_points());
            for (i, lights) in own.into_iter().zip(seen) {
                found[i].iter_mut().for_each(|f| f.lights = lights);
            }
        }
    }

    /// Pixels in which an edge may pass: their samples disagree, or with one sample a pixel, those of
    /// neighbours do.
    fn sharp_pixels(&self, first: &[Option<Found>], per: usize) -> Vec<bool> {
        let pixels = self.width * self.height;
        let footprint = self.footprint();
        let mut sharp: Vec<bool> = (0..pixels)
            .map(|i| {
                let own = &first[i * per..(i + 1) * per];
                let sky = || own.iter().all(Option::is_none);
                own.iter().any(|f| differ(&own[0], f, footprint))
                    || (sky() && {
                        let d = self.ray(i, (0.5, 0.5)).direction;
                        self.stage.background.sharp_near(d, footprint)
                    })
            })
            .collect();
        if per == 1 {
            for i in 0..pixels {
                let right = (i % self.width + 1 < self.width).then_some(i + 1);
                let below = (i + self.width < pixels).then_some(i + self.width);
                for j in [right, below].into_iter().flatten() {
                    if differ(&first[i], &first[j], footprint) {
                        (sharp[i], sharp[j]) = (true, true);
                    }
                }
            }
        }
        sharp
    }

    /// Angle of a pixel at the film's centre, radians; 0 for parallel rays.
    fn footprint(&self) -> f32 {
        match self.stage.camera {
            Camera::Pinhole { fov_y, .. } => 2.0 * (0.5 * fov_y).tan() / self.settings.height.max(1) as f32,
            Camera::Orthographic { .. } => 0.0,
        }
    }

    /// Length on a surface that a pixel sees at distance t, metres.
    fn spacing(&self, t: f32) -> f32 {
        match self.stage.camera {
            Camera::Pinhole { .. } => self.footprint() * t,
            Camera::Orthographic { height, .. } => height / self.settings.height.max(1) as f32,
        }
    }

    fn add(&mut self, pixel: usize, at: (f32, f32), area: f32, found: Option<Found>) {
        let index = self.samples.len() as u32;
        let value = match found {
            Some(_) => [0.0, 0.0, 0.0, 1.0],
            None => {
                let [r, g, b] = self.stage.background.radiance(self.ray(pixel, at).direction);
                [r, g, b, 0.0]
            }
        };
        self.samples.push(Sample { pixel: pixel as u32, x: at.0, y: at.1, area, value });
        if let Some(f) = found {
            self.gather(f, index, area);
        }
    }

    fn gather(&mut self, f: Found, sample: u32, area: f32) {
        let even = self.settings.share && self.stage.surfaces[f.surface].is_even();
        let like = |s: &&Shared| even && s.surface == f.surface && !creased(s.n, f.n);
        let twin = self.shared.iter().find(like).map(|s| s.point);
        let point = match self.shared.iter().filter(like).find(|s| s.lights == f.lights) {
            Some(s) => s.point,
            None => {
                // Texels and bumps within a pixel see much the same: their shadows are one.
                let beside =
                    |s: &&Shared| s.surface == f.surface && !creased(s.n, f.n) && s.lights == f.lights;
                let shadow = self.shared.iter().find(beside).map(|s| s.point);
                self.new_point(&f, area, twin, shadow)
            }
        };
        self.groups[f.surface].pairs.push((sample, point));
    }

    fn new_point(&mut self, f: &Found, area: f32, twin: Option<u32>, shadow: Option<u32>) -> u32 {
        let root = if self.settings.points { 0.0 } else { area.sqrt() };
        // Isotropic footprint: the geometric mean of the foreshortened and the plain side.
        let length = self.spacing(f.t) * root / f.ng.dot(f.wo).max(0.05).sqrt();
        let side = length * f.uv_density;
        let angle = self.footprint() * root;
        let surface = &self.stage.surfaces[f.surface];
        let group = &mut self.groups[f.surface];
        let point = group.points.len() as u32;
        if surface.maps.is_empty() {
            group.points.push(f.n, f.tangent, f.wo, f.p);
        } else {
            let l = look(f, &surface.maps, side, length, angle);
            group.points.push_lobe([l.n, l.t, f.wo, f.p], l.lobe);
        }
        group.lights.push(f.lights);
        group.twins.push(twin.unwrap_or(point));
        group.shadows.push(shadow.unwrap_or(point));
        group.points.locate(f.uv, f.corners, f.weights);
        group.points.chart(PointChart {
            n: f.n.to_array(),
            t: f.tangent.to_array(),
            side: f.side * if f.along.w < 0.0 { -1.0 } else { 1.0 },
            footprint: side,
        });
        let texture = surface.base_colour.as_ref().map(|t| Vec3::from(t.sample(f.uv.x, f.uv.y, side)));
        if texture.is_some() || !self.stage.mesh.colors.is_empty() {
            group.tint.push((texture.unwrap_or(Vec3::ONE) * f.colour).to_array());
        }
        group.emission.extend(surface.maps.emission.as_ref().map(|t| t.sample(f.uv.x, f.uv.y, side)));
        self.shared.push(Shared { surface: f.surface, point, n: f.n, lights: f.lights });
        point
    }

    fn shade(&mut self, task: &Task) -> Result<(), Cancelled> {
        for (group, surface) in self.groups.iter().zip(self.stage.surfaces) {
            let even = self.settings.share && self.settings.interpolate && surface.is_smooth();
            let size = (self.width, self.height);
            let all = |shader: &dyn Shader| shade(shader, &group.points, task);
            // Of points that represent others or are nodes of an interpolation: their places alone.
            let some = |shader: &dyn Shader, lit: &dyn Fn(u32) -> u32, lights: &[u64]| {
                let points = &group.points;
                let whole = &if even { self.whole(group, lit) } else { vec![None; self.width * self.height] };
                let spare: Vec<bool> = (0..points.len() as u32).map(|p| lit(p) != p).collect();
                let [difference, least] = shader.difference();
                let seen = Seen { size, points, whole, spare: &spare, lights, difference, least };
                let mut rgb = seen.radiance(|q| shade(shader, q, task))?;
                for plane in &mut rgb {
                    (0..points.len()).for_each(|p| plane[p] = plane[lit(p as u32) as usize]);
                }
                Ok(rgb)
            };
            let mut rgb = match surface.shader.factors() {
                Some([open, share]) => {
                    // The first factor has no shadows.
                    let mut rgb = match even {
                        true => some(open, &|p| group.twins[p as usize], &vec![0; group.points.len()])?,
                        false => all(open)?,
                    };
                    let share = some(share, &|p| group.shadows[p as usize], &group.lights)?;
                    rgb.iter_mut().flatten().zip(share.iter().flatten()).for_each(|(v, s)| *v *= s);
                    rgb
                }
                None if even => some(&*surface.shader, &|p| p, &group.lights)?,
                None => all(&*surface.shader)?,
            };
            for (plane, c) in rgb.iter_mut().zip(0..3) {
                plane.iter_mut().zip(&group.tint).for_each(|(v, t)| *v *= t[c]);
                plane.iter_mut().zip(&group.emission).for_each(|(v, e)| *v += e[c]);
            }
            for &(sample, point) in &group.pairs {
                let to = &mut self.samples[sample as usize].value;
                (0..3).for_each(|c| to[c] = rgb[c][point as usize]);
            }
        }
        Ok(())
    }

    /// For each pixel the point of a group that all its samples share; `lit` maps a point to its
    /// representative.
    fn whole(&self, group: &Group, lit: &dyn Fn(u32) -> u32) -> Vec<Option<u32>> {
        let mut left = vec![0u32; self.width * self.height];
        self.samples.iter().for_each(|s| left[s.pixel as usize] += 1);
        let mut out = vec![None; left.len()];
        for &(sample, point) in &group.pairs {
            let pixel = self.samples[sample as usize].pixel as usize;
            let point = lit(point);
            if *out[pixel].get_or_insert(point) == point {
                left[pixel] -= 1;
            }
        }
        out.into_iter().zip(left).map(|(point, left)| point.filter(|_| left == 0)).collect()
    }

    /// Every pixel of the tile as the weighted mean of the samples that the filter reaches.
    fn filter(&self, size: (usize, usize)) -> Vec<[f32; 7]> {
        let mut sums = vec![[0.0f32; 8]; self.width * self.height];
        for s in &self.samples {
            let (wx, wy) = (weights(s.x), weights(s.y));
            let (px, py) = (s.pixel as usize % self.width, s.pixel as usize / self.width);
            for (dy, wy) in wy.into_iter().enumerate() {
                for (dx, wx) in wx.into_iter().enumerate() {
                    let (x, y) = (px + dx, py + dy);
                    if !(1..=self.width).contains(&x) || !(1..=self.height).contains(&y) {
                        continue;
                    }
                    let w = wx * wy * s.area;
                    let to = &mut sums[(y - 1) * self.width + x - 1];
                    (0..4).for_each(|c| to[c] += w * s.value[c]);
                    (0..3).for_each(|c| to[4 + c] += w * (1.0 - s.value[3]) * s.value[c]);
                    to[7] += w;
                }
            }
        }
        (0..size.0 * size.1)
            .map(|i| {
                let s = sums[(i / size.0 + 1) * self.width + i % size.0 + 1];
                std::array::from_fn(|c| s[c] / s[7])
            })
            .collect()
    }
}

/// Radiance of all points, batch by batch.
fn shade(shader: &dyn Shader, points: &PointsBuf, task: &Task) -> Result<[Vec<f32>; 3], Cancelled> {
    let n = points.len();
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; n]);
    for start in (0..n).step_by(BATCH) {
        let end = (start + BATCH).min(n);
        let mut radiance = Radiance { rgb: rgb.each_mut().map(|p| &mut p[start..end]) };
        shader.shade(&points.slice(start..end), &mut radiance, task)?;
    }
    Ok(rgb)
}

/// Do two samples lie on different sides of an edge?
fn differ(a: &Option<Found>, b: &Option<Found>, footprint: f32) -> bool {
    match (a, b) {
        (None, None) => false,
        (Some(a), Some(b)) => {
            a.surface != b.surface || a.lights != b.lights || creased(a.n, b.n) || apart(a, b, footprint)
        }
        _ => true,
    }
}

/// Normals that are more than 15° apart.
fn creased(a: Vec3, b: Vec3) -> bool {
    a.dot(b) < 0.966
}

/// Depths further apart than the surface's slope explains.
fn apart(a: &Found, b: &Found, footprint: f32) -> bool {
    let slope = 1.0 / a.ng.dot(a.wo).min(b.ng.dot(b.wo)).max(0.02);
    footprint > 0.0 && (a.t - b.t).abs() > 4.0 * footprint * a.t.min(b.t) * slope
}
