//! Measures the time in which bidirectional texture functions are compressed: roughly, by formula, 81 views
//! and 81 lights of bumps that hide each other. The side is 64 texels, or the value of `BTF_SIDE`.
//! `cargo bench -p steradian-relight --bench btf`

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use std::time::Instant;
use steradian_relight::btf::{Btf, Compressed, Method, bonn};

fn main() {
    let side: usize = std::env::var("BTF_SIDE").ok().and_then(|s| s.parse().ok()).unwrap_or(64);
    let directions = bonn();
    let mut btf = Btf::new((side, side), &directions, &directions, true).expect("a function");
    for (v, view) in directions.iter().enumerate() {
        for (l, light) in directions.iter().enumerate() {
            let texel = |k: usize, c: usize| {
                let shift = 0.05 / view.z;
                let at = |k: usize, d: f64| k as f64 / side as f64 + shift * d;
                let (x, y) = (at(k % side, view.x), at(k / side, -view.y));
                let wave = |f: f64, x: f64| (std::f64::consts::TAU * f * x).sin();
                let n = glam::DVec3::new(0.8 * wave(3.0, x + 0.3 * y), 0.7 * wave(4.0, y), 1.0).normalize();
                let shine = n.dot((*view + *light).normalize()).max(0.0).powi(16);
                let base = 0.5 + 0.3 * wave(2.0, x * y + 0.2 * c as f64);
                (n.dot(*light).max(0.0) * (base + shine)) as f32
            };
            let planes = [0, 1, 2].map(|c| (0..side * side).map(|k| texel(k, c)).collect::<Vec<f32>>());
            btf.set(v, l, [&planes[0], &planes[1], &planes[2]]).expect("a picture");
        }
    }
    for method in [
        Method::Local { clusters: 32, components: 8 },
        Method::Local { clusters: 16, components: 8 },
        Method::View { components: 12 },
        Method::Chained { terms: 3, halves: 21, differences: 128 },
    ] {
        let start = Instant::now();
        let c = Compressed::new(&btf, method, &|| true).expect("nobody stops it");
        let (seconds, error, ratio) = (start.elapsed().as_secs_f64(), 100.0 * c.error(), c.ratio());
        println!(
            "{side}² texels: {method:?}: {seconds:.2} s, error {error:.2} %, 1:{ratio:.0}, {} steps",
            c.errors.len()
        );
    }
}
