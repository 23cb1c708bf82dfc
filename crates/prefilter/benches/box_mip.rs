//! Box mip levels against Phong of the same width: Kautz's course notes (2006) put N = 225 beside a bias of
//! 2.25 and leave open "how much better cosine-lobe filtering vs. box-filtering is".
//! `cargo bench -p steradian-prefilter --bench box_mip -- [LIGHT]`
//!
//! 256 rows of light. Errors are RMS over directions, relative to the exact map. For each size of the cube:
//! the level of matched width, the level that is best in hindsight, and the error at a bias of 2.25. Then the
//! other way round: given the box lookup, the Phong exponent that it is nearest to, and what is still left.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

mod shared;

use glam::DVec3;
use shared::{lights, sampled};
use steradian_base::Task;
use steradian_prefilter::methods::{BoxMip, effective_sigma};
use steradian_prefilter::{Lobe, Sampled, Zonal, filter_image, probe};
use steradian_sphere::{Layout, SphereImage};

const N: f64 = 225.0;
const PROBES: usize = 6000;

fn main() {
    let words = shared::words();
    let spec = words.first().map_or("studio", String::as_str);
    let phong = Lobe::phong(N);
    let light = sampled(&lights(spec, 256), &[&Lobe::phong(2000.0) as &dyn Zonal], 1e-4);
    let directions: Vec<DVec3> = (0..PROBES).map(|k| probe::direction(k, PROBES)).collect();
    let truth = exact(&light, &phong, &directions);
    println!("{spec}: box mip against Phong N = {N}");
    println!("| cube | level of matched width | error | best level | error | error at bias 2.25 |");
    println!("|---|---|---|---|---|---|");
    for n in [32, 64, 128, 256] {
        let chain = BoxMip::new(&light, n);
        let error = |level| distance(&lookups(&chain, level, &directions), &truth);
        let matched = chain.level(effective_sigma(&phong));
        let best = best(0.0, f64::from(n.ilog2()), error);
        println!(
            "| {n} | {matched:.2} | {:.3} | {best:.2} | {:.3} | {:.3} |",
            error(matched),
            error(best),
            error(2.25)
        );
    }
    let chain = BoxMip::new(&light, 128);
    let level = chain.level(effective_sigma(&phong));
    let boxed = lookups(&chain, level, &directions);
    let other = |x: f64| distance(&boxed, &exact(&light, &Lobe::phong(x.exp2()), &directions));
    let nearest = best(5.0, 10.5, other);
    println!(
        "cube 128, level {level:.2}: nearest Phong exponent {:.0}, error left {:.3}",
        nearest.exp2(),
        other(nearest)
    );
    let near = distance(&exact(&light, &Lobe::phong(N * 1.2), &directions), &truth);
    println!("for scale: Phong {:.0} against Phong {N}: {near:.3}", N * 1.2);
}

/// The exact map at directions, through a lat-long map of 512 rows.
fn exact(light: &Sampled, kernel: &Lobe, directions: &[DVec3]) -> Vec<[f64; 3]> {
    let made = filter_image(light, kernel, (Layout::LatLong, 1024, 512), 1e-4, &Task::quiet());
    let image: SphereImage = made.expect("nobody cancels").image;
    directions.iter().map(|&d| image.bicubic(d).map(f64::from)).collect()
}

fn lookups(chain: &BoxMip, level: f64, directions: &[DVec3]) -> Vec<[f64; 3]> {
    directions.iter().map(|&d| chain.lookup(d, level)).collect()
}

fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    probe::relative_rms(a.iter().copied().zip(b.iter().copied()))
}

/// Argument between two ends at which `f` is least: by a grid, then by golden section.
fn best(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let grid = (0..=16).map(|k| low + (high - low) * f64::from(k) / 16.0);
    let at = grid.map(|x| (f(x), x)).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(low, |p| p.1);
    let step = (high - low) / 16.0;
    let (mut a, mut b) = ((at - step).max(low), (at + step).min(high));
    for _ in 0..16 {
        let (x, y) = (a + 0.382 * (b - a), a + 0.618 * (b - a));
        if f(x) < f(y) { b = y } else { a = x }
    }
    0.5 * (a + b)
}
