//! Green, Kautz & Durand 2007, 5.1: "it only takes 4 seconds to perform an accurate convolution with a
//! spherical Gaussian with σ = 1 degree (required SH-order: 325)", and the chain σ_{j+1} = 2σ_j of their cube
//! map. `cargo bench -p steradian-prefilter --bench gkd07 -- [LIGHT]`
//!
//! 512 rows of light; level 0 a cube of 256² texels a face. The heat kernel exp(−l(l+1)σ²/2) is at 1e-7 at
//! band 325.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

mod shared;

use shared::{lights, on_one_thread, sampled, seconds};
use steradian_base::Task;
use steradian_prefilter::{Lobe, Zonal, deviation, filter_image};
use steradian_sphere::{Layout, sh};

const TOLERANCE: f64 = 1e-3;

fn main() {
    let words = shared::words();
    let lights = lights(words.first().map_or("studio", String::as_str), 512);
    on_one_thread(|| {
        let image = &lights.environment.as_ref().expect("the light is an image").image;
        let sigma = 1.0_f64.to_radians();
        let k: Vec<f64> = (0..=325).map(|l| (-0.5 * f64::from(l * (l + 1)) * sigma * sigma).exp()).collect();
        println!("heat kernel of 1 degree at band 325: {:.1e}", k[325]);
        let there = seconds(|| sh::project(image, 325));
        let mut product = sh::project(image, 325);
        product.convolve(&k);
        let back = seconds(|| sh::synthesize(&product, Layout::Cube, 256, 256));
        let flat = seconds(|| sh::synthesize(&product, Layout::LatLong, 1024, 512));
        println!(
            "order 325, paper 4 s: analysis {:.1} ms + lat-long 1024 x 512 {:.1} ms",
            there * 1e3,
            flat * 1e3
        );
        println!("    or + cube 6 x 256^2 {:.1} ms: {:.0} times faster", back * 1e3, 4.0 / (there + back));
        chain(&lights);
    });
}

/// Levels of twice the angle, at half the size, to a tolerance.
fn chain(lights: &steradian_light::Lights) {
    let lobes: Vec<Lobe> = (0..7).map(|j| Lobe::gaussian(f64::from(1 << j).to_radians())).collect();
    let kernels: Vec<&dyn Zonal> = lobes.iter().map(|l| l as _).collect();
    let analysis = seconds(|| sampled(lights, &kernels, TOLERANCE));
    let light = sampled(lights, &kernels, TOLERANCE);
    println!(
        "\nthe chain to relative RMS error {TOLERANCE}; analysis to band {}: {:.1} ms",
        light.order(),
        analysis * 1e3
    );
    println!("| sigma, degrees | cube | band | ms | error measured |");
    println!("|---|---|---|---|---|");
    let mut all = analysis;
    for (j, lobe) in lobes.iter().enumerate() {
        let n = 256 >> j;
        let run = || filter_image(&light, lobe, (Layout::Cube, n, n), TOLERANCE, &Task::quiet());
        let (t, made) = (seconds(run), run().expect("nobody cancels"));
        let e = deviation(&light, lobe, &made.image, 60).rms;
        all += t;
        println!("| {} | {n} | {} | {:.2} | {e:.1e} |", 1 << j, made.way.order(), t * 1e3);
    }
    println!("all levels with the analysis: {:.1} ms", all * 1e3);
}
