//! How long photographs take to become polynomials, beside decoding them, and the memory that it took:
//! seconds of the clock for each photograph.
//! `cargo bench -p steradian-relight --bench polynomials`
//!
//! `PHOTOGRAPHS=LIST.lp` takes the photographs of a list; else twelve of three megapixels are made by
//! formula, as PNG. The baseline, last, decodes into planes of single precision and sums in double, texel by
//! texel. Peaks of memory are those of the process so far (Linux).

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use glam::DVec3;
use std::path::PathBuf;
use std::time::Instant;
use steradian_formats::{
    LightPosition, Limits, Photograph, Raster, WriteOptions, read_image, read_lp, read_photograph,
    write_image, write_lp,
};
use steradian_parallel::prelude::*;
use steradian_relight::polynomial::{Channels, Fit, Photographs};

/// Photographs that are decoded at a time.
const AT_ONCE: usize = 2;

fn formula(folder: &std::path::Path) -> PathBuf {
    let (w, h) = (2000, 1500);
    let light = |k: usize| {
        let z: f64 = 0.3 + 0.05 * k as f64;
        let (s, phi) = ((1.0 - z * z).sqrt(), 2.4 * k as f64);
        DVec3::new(s * phi.cos(), s * phi.sin(), z)
    };
    let one = |k: usize| {
        let l = light(k);
        let texel = |t: usize, c: usize| {
            let (x, y) = ((t % w) as f64 / 40.0, (t / w) as f64 / 55.0);
            let n = DVec3::new(0.4 * x.sin() * y.cos(), 0.4 * x.cos() * y.sin(), 1.0).normalize();
            let noise = (t * 7919 + c * 104_729) % 1009;
            ((0.4 + 0.3 * noise as f64 / 1009.0) * n.dot(l).max(0.0)) as f32
        };
        let planes = [0, 1, 2].map(|c| (0..w * h).map(|t| texel(t, c)).collect::<Vec<f32>>());
        let file = format!("{k}.png");
        let raster = Raster::rgb(w, h, planes);
        write_image(&folder.join(&file), &raster, &WriteOptions::default()).expect("written");
        LightPosition { file, position: l.to_array() }
    };
    let lights: Vec<LightPosition> = (0..12).map(one).collect();
    let list = folder.join("all.lp");
    write_lp(&list, &lights).expect("written");
    list
}

/// Largest resident size of this process so far.
fn peak() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kib = status.lines().find_map(|l| l.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse().ok());
    kib.map_or_else(|| "not known".into(), |k: u64| format!("{} MB", (k << 10) / 1_000_000))
}

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    let list = std::env::var_os("PHOTOGRAPHS").map_or_else(|| formula(folder.path()), PathBuf::from);
    let limits = Limits::default();
    let lights = read_lp(&list, &limits).expect("a list");
    let above = list.parent().expect("a folder");
    let files: Vec<PathBuf> = lights.iter().map(|l| above.join(&l.file)).collect();
    let directions: Vec<DVec3> = lights.iter().map(|l| DVec3::from(l.position)).collect();
    let fit = Fit::<6>::new(&directions).expect("lights that determine polynomials");
    let read = |files: &[PathBuf]| -> Vec<Photograph> {
        let one = |f: &PathBuf| read_photograph(f, &limits).expect("a photograph");
        files.par_iter().with_max_len(1).map(one).collect()
    };
    let (w, h) = read(&files[..1])[0].size();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    println!("{} photographs of {w} x {h} texels, {threads} threads; peak before {}", files.len(), peak());
    let each = |what: &str, start: Instant| {
        let seconds = start.elapsed().as_secs_f64() / files.len() as f64;
        println!("{what:<32} {seconds:.3} s, peak {}", peak());
    };
    let start = Instant::now();
    files.chunks(AT_ONCE).for_each(|some| drop(read(some)));
    each("decoding alone", start);
    for channels in [Channels::Luminance, Channels::Colour] {
        let start = Instant::now();
        let mut sums = Photographs::new(&fit, channels, w * h);
        files.chunks(AT_ONCE).for_each(|some| sums.add_all(&read(some)).expect("of one size"));
        each(&format!("decoding and sums, {channels:?}"), start);
        let start = Instant::now();
        drop(sums.finish());
        println!("{:<32} {:.3} s once", "coefficients of the sums", start.elapsed().as_secs_f64());
    }
    let start = Instant::now();
    let mut sums = vec![[[0.0f64; 6]; 3]; w * h];
    for (file, l) in files.iter().zip(&directions) {
        let planes = read_image(file, &limits).expect("an image").into_rgb().expect("colour");
        let (u, v) = (l.x, l.y);
        let along = [u * u, v * v, u * v, u, v, 1.0];
        sums.par_iter_mut().enumerate().for_each(|(t, sums)| {
            for (sum, plane) in sums.iter_mut().zip(&planes) {
                sum.iter_mut().zip(along).for_each(|(s, a)| *s += a * f64::from(plane[t]));
            }
        });
    }
    each("planes, sums in double, Colour", start);
}
