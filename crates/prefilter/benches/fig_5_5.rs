//! Figure 5.5 of Ramamoorthi & Hanrahan 2002: accuracy of an order F approximation of reflected light, and
//! its estimates, for Phong s = 32 in Grace Cathedral.
//! `cargo bench -p steradian-prefilter --bench fig_5_5 -- [LIGHT]`
//!
//! Without an argument the light is `environments/angular/grace_probe.hdr` of the data folder, else a made
//! studio. Accuracy is 1 − ε, ε the part of the reflected energy that is left out: a mean over all
//! directions.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

mod shared;

use steradian_prefilter::shrm::error::{
    KernelSpectrum, LightSpectrum, bound, lesser, printed_bound, reflected,
};
use steradian_prefilter::{Lobe, Zonal};
use steradian_sphere::sh::{self, ColumnsRgb, ShTransform};

/// The order that the paper calls exact, and the one used here.
const PAPER: usize = 30;
const ORDER: usize = 255;
const S: f64 = 32.0;

fn main() {
    let words = shared::words();
    let grace = steradian_testkit::data("environments/angular/grace_probe.hdr");
    let spec = words.first().cloned().or(grace.map(|p| p.display().to_string()));
    let lights = shared::lights(spec.as_deref().unwrap_or("studio"), 512);
    let image = &lights.environment.as_ref().expect("the light is an image").image;
    let plan = ShTransform::new(ORDER, image.width, image.height, sh::Grid::Equirectangular);
    let mut columns = ColumnsRgb::default();
    plan.analyze_columns(image.planes.each_ref().map(Vec::as_slice), &mut columns);
    let bands = columns.band_energies().iter().map(|e| e.iter().sum()).collect();
    let squares: [Vec<f32>; 3] = std::array::from_fn(|c| image.planes[c].iter().map(|x| x * x).collect());
    let square = ShTransform::new(0, image.width, image.height, sh::Grid::Equirectangular)
        .analyze(squares.each_ref().map(Vec::as_slice));
    let total = square.c.iter().map(|c| c[0]).sum::<f64>() * (4.0 * std::f64::consts::PI).sqrt();
    let light = LightSpectrum { bands, total };
    let kernel = phong();
    println!(
        "RH02 figure 5.5: Phong s = {S}; light's energy to order {PAPER}: {:.3}",
        1.0 - light.epsilon(PAPER)
    );
    println!(
        "F_L for 0.5, 0.2, 0.1 of the energy left (5.16): {:?}",
        [0.5, 0.2, 0.1].map(|e| light.order(e))
    );
    println!(
        "| F | true, against F = {PAPER} | true, exact | min of errors | bound 5.19 as printed | repaired |"
    );
    println!("|---|---|---|---|---|---|");
    let all = reflected(&light, &kernel, ORDER, 0);
    let paper = reflected(&light, &kernel, PAPER, 0);
    let mut kept = true;
    for f in 0..=PAPER {
        let got = reflected(&light, &kernel, f, 0);
        let (truth, repaired) = (got / all, 1.0 - bound(&light, &kernel, f, 0));
        kept &= repaired <= truth + 1e-12;
        println!(
            "| {f} | {:.5} | {truth:.5} | {:.5} | {:.5} | {repaired:.5} |",
            got / paper,
            1.0 - lesser(&light, &kernel, f, 0),
            1.0 - printed_bound(&light, &kernel, f, 0),
        );
    }
    println!(
        "The repaired bound states {} accuracy than there is.",
        if kept { "never more" } else { "MORE" }
    );
}

/// ρ̂_l² = (2l+1)/4π k_l², and ∫ ρ̂² = (s+1)²/(2π(2s+1)).
fn phong() -> KernelSpectrum {
    let k = Lobe::phong(S).coefficients(ORDER);
    let square = |(l, k): (usize, &f64)| (2 * l + 1) as f64 / (4.0 * std::f64::consts::PI) * k * k;
    let squares: Vec<f64> = k.iter().enumerate().map(square).collect();
    KernelSpectrum::radial(&squares, (S + 1.0).powi(2) / (2.0 * std::f64::consts::PI * (2.0 * S + 1.0)))
}
