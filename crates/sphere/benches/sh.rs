//! Times of the spherical harmonic engine, with the slow way beside each fast one where it is bearable.
//! `cargo bench -p steradian-sphere --bench sh`

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use glam::{DMat3, Mat3};
use std::hint::black_box;
use std::time::Instant;
use steradian_sphere::sh::{
    Grid, Rotation, ShRgb, ShTransform, TURNS, Turns, count, project, project_direct, synthesize,
    synthesize_direct, wigner_d,
};
use steradian_sphere::{Layout, SphereImage, glam};

/// Best of a few runs, in milliseconds.
fn best<R>(mut f: impl FnMut() -> R) -> f64 {
    let mut best = f64::INFINITY;
    let start = Instant::now();
    for _ in 0..9 {
        let t = Instant::now();
        black_box(f());
        best = best.min(t.elapsed().as_secs_f64() * 1e3);
        if start.elapsed().as_secs_f64() > 3.0 {
            break;
        }
    }
    best
}

fn coefficients(order: usize) -> ShRgb {
    let c = std::array::from_fn(|k| (0..count(order)).map(|i| ((i * i + k) as f64).sin()).collect());
    ShRgb { order, c }
}

fn image(width: usize, height: usize) -> SphereImage {
    let mut image = SphereImage::new(Layout::LatLong, width, height);
    for (k, p) in image.planes.iter_mut().enumerate() {
        p.iter_mut().enumerate().for_each(|(i, v)| *v = ((i * (k + 3)) as f32).sin());
    }
    image
}

fn main() {
    println!("{:<44} {:>10}  ratio to the direct sum", "RGB, all threads", "ms");
    for (order, width, height) in [(31, 256, 128), (255, 1024, 512), (511, 2048, 1024), (1023, 4096, 2048)] {
        let (sh, map) = (coefficients(order), image(width, height));
        let plan = ShTransform::new(order, width, height, Grid::Equirectangular);
        let mut planes = map.planes.clone();
        let ana = best(|| plan.analyze(map.planes.each_ref().map(Vec::as_slice)));
        let syn = best(|| plan.synthesize(&sh, planes.each_mut().map(Vec::as_mut_slice)));
        let what = format!("band {order}, {width}x{height}");
        println!("{:<44} {ana:>10.2}", format!("analysis  {what}"));
        println!("{:<44} {syn:>10.2}", format!("synthesis {what}"));
        if order == 31 {
            let slow = best(|| project_direct(&map, order));
            let fast = best(|| project(&map, order));
            println!("{:<44} {fast:>10.2}  {:.0}x", format!("project   {what}"), slow / fast);
        }
    }
    for order in [8, 64, 255, 1023] {
        let sh = coefficients(order);
        let turn = Rotation::new(order, DMat3::from_rotation_x(0.7));
        println!("{:<44} {:>10.3}", format!("rotation  band {order}"), best(|| turn.apply_rgb(&sh)));
    }
    let sh = coefficients(4);
    // A vertex buffer's share of the second-level cache.
    let rotations: Vec<Mat3> = (0..2048_u16).map(|i| Mat3::from_rotation_y(f32::from(i))).collect();
    let turns = Turns::new(&rotations);
    let mut out = vec![[[[0.0; TURNS]; 25]; 3]; turns.blocks()];
    let many = best(|| (0..50).for_each(|_| turns.apply(&sh, &mut out)));
    let one =
        best(|| rotations.iter().map(|r| Rotation::new(4, r.as_dmat3()).apply_rgb(&sh)).collect::<Vec<_>>());
    let rate = 50.0 * rotations.len() as f64 / many * 1e-3;
    println!(
        "{:<44} {:>10.3}  {rate:.0} million/s, {:.0}x",
        "rotation  5 bands, 2048 vertices",
        many / 50.0,
        one / many * 50.0
    );
    for order in [64, 255] {
        let sh = coefficients(order);
        let fast = best(|| synthesize(&sh, Layout::Cube, 256, 256));
        let note = if order == 64 {
            format!("{:.1}x", best(|| synthesize_direct(&sh, Layout::Cube, 256, 256)) / fast)
        } else {
            String::new()
        };
        println!("{:<44} {fast:>10.2}  {note}", format!("synthesis band {order}, cube 256"));
    }
    println!("{:<44} {:>10.2}", "Wigner d, band 255", best(|| wigner_d(255, 0.7)));
}
