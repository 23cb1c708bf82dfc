//! Section 3.3.1 of Green, Kautz & Durand 2007: visibility from the data of diffuse precomputed transfer, by
//! dividing the cosine out, its error by elevation on a bunny that stands on a plate, beside that of
//! visibility's own coefficients.

use super::{mesh, say};
use anyhow::{Result, anyhow};
use glam::DVec3;
use std::f64::consts::TAU;
use steradian_base::Task;
use steradian_scene::{Bvh, Mesh, Ray};
use steradian_sphere::{Frame, sh};
use steradian_transfer::{Recovery, Settings, Site, Transfer, divided, share, transfer};

/// Sites that are looked at.
const SITES: usize = 3000;
/// Elevations are the middles of so many bins, azimuths as many again.
const BINS: usize = 9;
const AZIMUTHS: usize = 12;
/// Error of a coefficient of t, and of the diagonal of least squares.
const PRECISION: f64 = 5e-3;
const RIDGE: f64 = 0.01;
const WAYS: [&str; 4] = ["its own", "by the cosine", "by the open", "least squares"];

/// What rays see from a site, by elevation and azimuth.
struct Seen {
    direction: DVec3,
    bin: usize,
    open: f64,
}

pub fn run() -> Result<()> {
    let mesh = mesh::bunny()?;
    let all: Vec<Site> = Site::vertices(&mesh).into_iter().filter(|s| s.n != glam::Vec3::ZERO).collect();
    let sites: Vec<Site> = all.iter().step_by(all.len().div_ceil(SITES)).copied().collect();
    let offset = 1e-4 * mesh.bounds().map_or(1.0, |(a, b)| (b - a).length());
    let bvh = Bvh::build(&mesh);
    let seen: Vec<Vec<Seen>> = sites.iter().map(|s| looked(&bvh, s, offset)).collect();
    let (mut lost, mut count) = (0.0, 0.0);
    for s in seen.iter().flatten() {
        lost += 1.0 - s.open;
        count += 1.0;
    }
    say(&format!(
        "GKD07 3.3.1: visibility of {} sites on a bunny on a plate, RMS error against rays by elevation, cut to 0 ... 1; blocked: {}",
        sites.len(),
        super::percent(lost / count)
    ));
    for bands in 2..=5 {
        table(&mesh, &sites, &seen, bands, offset)?;
    }
    Ok(())
}

fn looked(bvh: &Bvh, s: &Site, offset: f32) -> Vec<Seen> {
    let frame = Frame::from_normal(s.n.as_dvec3());
    let at = |k: usize| {
        let bin = k / AZIMUTHS;
        let elevation = (bin as f64 + 0.5) / BINS as f64 * 0.25 * TAU;
        let (s, c) = elevation.sin_cos();
        let (y, x) = (TAU * (k % AZIMUTHS) as f64 / AZIMUTHS as f64).sin_cos();
        (bin, frame.to_world(DVec3::new(c * x, c * y, s)))
    };
    let one = |(bin, direction): (usize, DVec3)| {
        let ray = Ray { origin: s.p + offset * s.n, direction: direction.as_vec3() };
        Seen { direction, bin, open: if bvh.occluded(&ray, f32::INFINITY) { 0.0 } else { 1.0 } }
    };
    (0..BINS * AZIMUTHS).map(at).map(one).collect()
}

fn table(mesh: &Mesh, sites: &[Site], seen: &[Vec<Seen>], bands: usize, offset: f32) -> Result<()> {
    let scene = steradian_transfer::Scene::new(mesh).map_err(|e| anyhow!("{e}"))?;
    let settings = Settings { bands, tolerance: PRECISION, offset, ..Settings::default() };
    let t: Transfer = transfer(&scene, sites, &settings, None, &Task::quiet()).map_err(|e| anyhow!("{e}"))?;
    let recovery = Recovery::new(bands, RIDGE);
    let (plain, mut y) = (sh::zonal::phong(bands - 1, 0.0), vec![0.0; bands * bands]);
    let mut squares = [[0.0; WAYS.len()]; BINS];
    let mut uncut = [0.0f64; WAYS.len()];
    for (k, site) in sites.iter().enumerate() {
        let (n, vector) = (site.n.as_dvec3().normalize_or_zero(), t.vector(k, 0));
        let nearest = recovery.visibility(n, vector);
        for s in &seen[k] {
            sh::eval(bands - 1, s.direction, &mut y);
            let sum = |c: &mut dyn Iterator<Item = f64>| y.iter().zip(c).map(|(y, c)| y * c).sum::<f64>();
            let values = [
                sum(&mut t.visibility(k).iter().map(|v| f64::from(*v)))
                    / sh::zonal::value(&plain, n.dot(s.direction)),
                divided(n, vector, s.direction),
                share(n, vector, s.direction),
                sum(&mut nearest.iter().copied()),
            ];
            for (w, v) in values.into_iter().enumerate() {
                squares[s.bin][w] += (v.clamp(0.0, 1.0) - s.open).powi(2);
                uncut[w] = uncut[w].max((v - 0.5).abs() + 0.5);
            }
        }
    }
    let names: Vec<String> = WAYS.iter().map(|w| format!("{w:>14}")).collect();
    say(&format!("{bands} bands   {}", names.join("")));
    let each = (sites.len() * AZIMUTHS) as f64;
    let line = |label: String, values: [f64; WAYS.len()]| {
        let text: Vec<String> = values.iter().map(|v| format!("{v:>14.3}")).collect();
        say(&format!("{label:>9} {}", text.join("")));
    };
    for (bin, sums) in squares.iter().enumerate() {
        let degrees = (bin as f64 + 0.5) / BINS as f64 * 90.0;
        line(format!("{degrees:.0}°"), sums.map(|s| (s / each).sqrt()));
    }
    line("largest".into(), uncut);
    Ok(())
}
