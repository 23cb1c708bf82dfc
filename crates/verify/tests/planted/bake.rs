//! Lights, and files baked from them, right or wrong.

use glam::{DMat3, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::Task;
use steradian_light::{Environment, Lights};
use steradian_prefilter::{Sampled, Zonal, filter_image, mirror_image};
use steradian_sphere::{Layout, SphereImage};
use steradian_verify::Kernel;

/// Random numbers of 0 to 1.
pub struct Random(pub u64);

impl Random {
    pub fn draw(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn latlong(f: impl Fn(DVec3) -> [f32; 3] + Sync) -> SphereImage {
    SphereImage::from_fn(Layout::LatLong, 128, 64, f)
}

/// A blue sky over brown ground, with clouds and a sun of 300 in a few texels.
pub fn sky() -> SphereImage {
    let sun = DVec3::new(0.5, 0.55, -0.67).normalize();
    latlong(|d| {
        let cloud = 0.25 * (1.0 + (7.0 * d.x + 3.0 * d.z).sin() * (5.0 * d.z - 2.0 * d.x * d.y).cos());
        let disk = if d.angle_between(sun) < 0.06 { 300.0 } else { 0.0 };
        let glow = 2.0 * (8.0 * (d.dot(sun) - 1.0)).exp();
        let up = if d.y > 0.0 {
            [0.25 + cloud, 0.45 + cloud, 0.9 + 0.6 * cloud]
        } else {
            [0.22 + 0.05 * (9.0 * d.x).sin(), 0.16, 0.09]
        };
        up.map(|v| (v + glow + disk) as f32)
    })
}

/// Windows and lamps in a dim room.
pub fn studio() -> SphereImage {
    latlong(|d| {
        let panel = |at: DVec3, wide: f64, high: f64| {
            let side = DVec3::Y.cross(at).normalize();
            d.dot(at) > 0.0 && d.dot(side).abs() < wide && d.dot(at.cross(side)).abs() < high
        };
        let mut v = [0.06 + 0.04 * d.y + 0.02 * d.x, 0.055 + 0.03 * d.y, 0.05 + 0.02 * d.z];
        let mut add = |on: bool, c: [f64; 3]| (0..3).for_each(|k| v[k] += if on { c[k] } else { 0.0 });
        add(panel(DVec3::new(0.8, 0.3, 0.5).normalize(), 0.3, 0.2), [12.0, 11.0, 9.0]);
        add(panel(DVec3::new(-0.7, 0.5, 0.3).normalize(), 0.12, 0.35), [4.0, 5.0, 8.0]);
        add(panel(DVec3::new(0.1, 0.2, -1.0).normalize(), 0.08, 0.08), [40.0, 30.0, 20.0]);
        add((d.y + 0.55).abs() < 0.03, [0.5, 0.4, 0.3]);
        v.map(|v| v as f32)
    })
}

/// A street at night as a camera with noise sees it: coloured lamps of a texel or two.
pub fn photograph() -> SphereImage {
    let mut random = Random(7);
    let mut image = latlong(|d| {
        let wall = 0.1 + 0.08 * (6.0 * d.x * d.y + 4.0 * d.z).sin().abs();
        let v = [wall, 0.8 * wall, 0.5 * wall + 0.05 * (1.0 + d.y)];
        v.map(|v| v as f32)
    });
    for k in 0..image.planes[0].len() {
        (0..3).for_each(|c| image.planes[c][k] *= (0.6 + 0.8 * random.draw()) as f32);
    }
    for k in 0..25 {
        let y: f64 = 0.9 * random.draw() - 0.2;
        let phi = 2.0 * PI * random.draw();
        let r = (1.0 - y * y).sqrt();
        let (f, i, j) = image.texel_of(DVec3::new(r * phi.cos(), y, r * phi.sin()));
        let bright = 20.0 * (4.0 * random.draw()).exp();
        let colour = [[1.0, 0.6, 0.2], [0.9, 0.2, 0.1], [0.2, 0.9, 0.4], [0.4, 0.6, 1.0]][k % 4];
        let k = image.index(f, i, j);
        (0..3).for_each(|c| image.planes[c][k] += (bright * colour[c]) as f32);
    }
    image
}

pub fn lights(image: &SphereImage) -> Lights {
    Lights { environment: Some(Arc::new(Environment { image: image.clone() })), ..Lights::default() }
}

/// Levels of side `n`, n/2, …: cubes.
pub fn bake(image: &SphereImage, kernels: &[Kernel], n: usize) -> Vec<SphereImage> {
    let task = Task::quiet();
    let zonal: Vec<Option<Box<dyn Zonal>>> = kernels.iter().map(|k| k.zonal()).collect();
    let known: Vec<&dyn Zonal> = zonal.iter().flatten().map(AsRef::as_ref).collect();
    let light = Sampled::new(&lights(image), &known, 1e-3, &task).expect("is not cancelled");
    let level = |(m, k): (usize, &Option<Box<dyn Zonal>>)| {
        let shape = (Layout::Cube, (n >> m).max(1), (n >> m).max(1));
        match k {
            Some(k) => filter_image(&light, k.as_ref(), shape, 1e-3, &task).expect("is not cancelled").image,
            None => mirror_image(&light, shape).image,
        }
    };
    zonal.iter().enumerate().map(level).collect()
}

/// Every value of every level.
pub fn values(levels: &[SphereImage], mut f: impl FnMut(usize, [f32; 3]) -> [f32; 3]) -> Vec<SphereImage> {
    let mut out = levels.to_vec();
    for (m, level) in out.iter_mut().enumerate() {
        for k in 0..level.planes[0].len() {
            let v = f(m, level.planes.each_ref().map(|p| p[k]));
            (0..3).for_each(|c| level.planes[c][k] = v[c]);
        }
    }
    out
}

/// The light's image turned about +Y by a number of its columns, and the turn.
pub fn turned(image: &SphereImage, columns: usize) -> (SphereImage, DMat3) {
    let mut out = image.clone();
    // A turn by φ about +Y takes azimuth atan2(z, x) to itself less φ.
    out.planes.iter_mut().for_each(|p| p.chunks_exact_mut(image.width).for_each(|r| r.rotate_left(columns)));
    (out, DMat3::from_rotation_y(2.0 * PI * columns as f64 / image.width as f64))
}

/// Levels with directions moved by a symmetry of the cube.
pub fn moved(levels: &[SphereImage], g: DMat3) -> Vec<SphereImage> {
    let back = g.transpose();
    let one = |l: &SphereImage| SphereImage::from_fn(l.layout, l.width, l.height, |d| l.nearest(back * d));
    levels.iter().map(one).collect()
}

/// The image a number of times smaller: means or single texels.
pub fn reduced(image: &SphereImage, factor: usize, means: bool) -> SphereImage {
    let (w, h) = (image.width / factor, image.height / factor);
    if means {
        return image.resample(Layout::LatLong, w, h);
    }
    let mut out = SphereImage::new(Layout::LatLong, w, h);
    for (j, i) in (0..h).flat_map(|j| (0..w).map(move |i| (j, i))) {
        let from = image.index(0, i * factor + factor / 2, j * factor + factor / 2);
        let to = out.index(0, i, j);
        (0..3).for_each(|c| out.planes[c][to] = image.planes[c][from]);
    }
    out
}
