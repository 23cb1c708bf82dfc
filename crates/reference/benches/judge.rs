//! Milliseconds and evaluations per point of the reference, at 1024 × 512, for models, lobe widths and
//! angles.
#![allow(clippy::print_stdout)]

use glam::DVec3;
use std::time::Instant;
use steradian_base::Task;
use steradian_light::{DiskLight, Environment, Lights};
use steradian_reference::{Lookup, Reference, ReferencePoint};
use steradian_sphere::{Frame, Layout, SphereImage};

/// A noisy sky with windows and a sun of a few texels.
fn environment(w: usize, h: usize) -> SphereImage {
    let mut image = SphereImage::new(Layout::LatLong, w, h);
    let mut s = 7u32;
    for j in 0..h {
        for i in 0..w {
            s = s.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = (s >> 8) as f32 / 16_777_216.0;
            let sky = 1.0 - j as f32 / h as f32;
            let window = if (i * 8 / w) % 3 == 1 && (j * 8 / h) == 3 { 30.0 } else { 0.0 };
            let sun = if i.abs_diff(w / 3) < 3 && j.abs_diff(h / 4) < 3 { 5e4 } else { 0.0 };
            let k = image.index(0, i, j);
            for (c, tint) in [0.8, 0.9, 1.2].into_iter().enumerate() {
                image.planes[c][k] = (sky + 0.5 * noise) * tint + window + sun;
            }
        }
    }
    image
}

fn points(degrees: f64) -> Vec<ReferencePoint> {
    (0..8)
        .map(|k| {
            let a = f64::from(k) * 2.399;
            let y = 0.95 - 1.6 * f64::from(k) / 8.0;
            let r = (1.0_f64 - y * y).sqrt();
            let frame = Frame::from_normal(DVec3::new(r * a.cos(), y, r * a.sin()));
            let (s, c) = degrees.to_radians().sin_cos();
            let wo = frame.to_world(DVec3::new(s * (0.3 * a).cos(), s * (0.3 * a).sin(), c));
            ReferencePoint { frame, wo, position: None }
        })
        .collect()
}

const SPECS: [&str; 24] = [
    "lambert",
    "phong:n=20",
    "phong:n=1000",
    "phong-map:n=200",
    "phong-normalized:s=50",
    "microfacet:sigma=0.1",
    "blinn-phong:n=300",
    "blinn-phong-gl:kd=0.3,ks=0.5,n=50",
    "cook-torrance:m=0.2",
    "ggx:alpha=1",
    "ggx:alpha=0.3",
    "ggx:alpha=0.1",
    "ggx:alpha=0.04",
    "ggx:ax=0.04,ay=0.4",
    "ashikhmin-shirley:nu=1000,nv=10",
    "ward:ax=0.05,ay=0.3",
    "ward:ax=0.1,ay=0.1,variant=1992",
    "banks:n=50",
    "banks-map:n=200",
    "kajiya-kay:s=100",
    "lafortune:@skin",
    "oren-nayar:sigma=0.5",
    "minnaert:k=0.5",
    "poulin-fournier:n=20",
];

fn main() {
    let size: usize =
        std::env::var("STERADIAN_BENCH_WIDTH").ok().and_then(|v| v.parse().ok()).unwrap_or(1024);
    let image = environment(size, size / 2);
    let mut lights = Lights::from(Environment { image });
    lights.disks.push(DiskLight {
        direction: DVec3::new(0.5, 0.4, -0.7).normalize(),
        angular_radius: 0.00465,
        radiance: [3e4; 3],
    });
    let start = Instant::now();
    let reference = match Reference::new(&lights, Lookup::Constant, &Task::quiet()) {
        Ok(j) => j,
        Err(e) => return println!("{e}"),
    };
    println!("{size} x {}: pyramid {:.0} ms", size / 2, start.elapsed().as_secs_f64() * 1e3);
    println!("{:40} {:>5} {:>9} {:>11} {:>9}", "model", "angle", "ms/point", "evaluations", "error");
    for spec in SPECS {
        let Ok(brdf) = steradian_brdf::parse(spec) else {
            println!("{spec:40} not there");
            continue;
        };
        for angle in [0.0, 60.0, 85.0] {
            let points = points(angle);
            let start = Instant::now();
            let out =
                reference.radiance_batch(brdf.as_ref(), &points, 1e-4, &Task::quiet()).unwrap_or_default();
            let ms = start.elapsed().as_secs_f64() * 1e3 / points.len() as f64;
            let evaluations = out.iter().map(|e| e.evaluations).sum::<u64>() / points.len() as u64;
            let error = out.iter().map(|e| e.error).fold(0.0, f64::max);
            println!("{spec:40} {angle:5} {ms:9.2} {evaluations:11} {error:9.1e}");
        }
    }
}
