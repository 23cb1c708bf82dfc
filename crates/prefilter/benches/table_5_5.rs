//! Table 5.5 of Ramamoorthi & Hanrahan 2002: the microfacet reflectance 5.34 in angular and in frequency
//! space. `cargo bench -p steradian-prefilter --bench table_5_5 -- [LIGHT]`
//!
//! 128 rows of light (256 × 128), maps of 128 × 128 texels, T × T = 100 directions of the viewer about the
//! mirror direction, one thread. Frequency space is timed whole: analysis of the light, maps, all 100
//! explicit maps; the reflectance's coefficients are computed once and timed apart. Angular space, for each
//! texel of each map, sums the light's texels that lie in the lobe (2·1.73 σ about the mirror direction: 95 %
//! of it, the paper's cut, ε = 0.05): it is timed on a sample of texels of all maps and scaled. The
//! difference of the two, without the cut, is RMS over the sample, relative.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

mod shared;

use glam::DVec3;
use shared::{lights, on_one_thread, seconds};
use std::f64::consts::PI;
use std::hint::black_box;
use steradian_base::Task;
use steradian_brdf::central::{Centre, Lpq};
use steradian_prefilter::shrm::{CoefficientMaps, Grid, Plan, Term, explicit, frame, pairs};
use steradian_sphere::sh::{self, ColumnsRgb, ShTransform};
use steradian_sphere::{Layout, SphereImage};

/// σ, F, P; angular seconds for 100 maps, frequency seconds for all and for the reflection maps alone, on a
/// 1.4 GHz Pentium 4.
const PAPER: [(f64, usize, usize, [f64; 3]); 5] = [
    (0.1, 24, 3, [923.0, 2.70, 1.55]),
    (0.2, 12, 2, [2744.0, 1.55, 0.72]),
    (0.3, 7, 2, [5731.0, 1.49, 0.67]),
    (0.4, 5, 2, [9034.0, 1.47, 0.65]),
    (0.5, 5, 2, [12580.0, 1.45, 0.64]),
];
const ROWS: usize = 128;
const T: usize = 10;
/// Texels of maps in the sample.
const SAMPLE: usize = 400;

fn main() {
    let words = shared::words();
    let lights = lights(words.first().map_or("studio", String::as_str), ROWS);
    let image = &lights.environment.as_ref().expect("the light is an image").image;
    println!("RH02 table 5.5; seconds, the paper's and ours on one thread");
    println!(
        "| σ | F, P | energy held | angular, 100 maps | frequency, all | SHRM | angular/frequency | ρ̂_lpq | RMS, θ_o ≤ 60° | RMS, all |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for row in PAPER {
        on_one_thread(|| line(image, row));
    }
}

fn line(image: &SphereImage, (sigma, f, p, paper): (f64, usize, usize, [f64; 3])) {
    let brdf = steradian_brdf::parse(&format!("microfacet:sigma={sigma}")).expect("the spec is right");
    let project = || Lpq::project(&*brdf, Centre::Reflection, f, p, &Task::quiet()).expect("isotropic");
    let lpq = project();
    let coefficients = seconds(project);
    let terms: Vec<Term<'_>> = pairs(p).iter().map(|&(p, q)| Term { q, k: lpq.row(p, q) }).collect();
    let transform = ShTransform::new(f, 2 * ROWS, ROWS, sh::Grid::Equirectangular);
    let plan = Plan::new(f, p, Grid::new(ROWS, ROWS));
    let set = explicit::set(T);
    let shrm = || -> CoefficientMaps {
        let mut light = ColumnsRgb::default();
        transform.analyze_columns(image.planes.each_ref().map(Vec::as_slice), &mut light);
        plan.maps(&light, &terms, &Task::quiet()).expect("nobody cancels")
    };
    let all = || explicit::local(&shrm(), p, &set).expect("the maps are complete");
    let (made, created) = (seconds(all), seconds(shrm));
    let light = LightTexels::new(image);
    let cut = Lobe { sigma, reach: 2.0 * 1.73 * sigma };
    let sample: Vec<(usize, usize)> = (0..SAMPLE).map(|k| (k % (T * T), k * 7919 % (ROWS * ROWS))).collect();
    let value = |lobe: &Lobe, (map, at): (usize, usize)| {
        let c = plan.grid().direction(at / ROWS, at % ROWS);
        light.sum(lobe, c, viewer(c, set[map]))
    };
    let summed = seconds(|| sample.iter().map(|s| black_box(value(&cut, *s))[0]).sum::<f64>());
    let angular = summed * (T * T * ROWS * ROWS) as f64 / SAMPLE as f64;
    let maps = all();
    let whole = Lobe { sigma, reach: PI };
    let rms = |most: f64| {
        let (mut error, mut signal) = (0.0, 0.0);
        for s in sample.iter().filter(|s| set[s.0][0] <= most) {
            let exact = value(&whole, *s);
            for c in 0..3 {
                error += (f64::from(maps[s.0][c][s.1]) - exact[c]).powi(2);
                signal += exact[c].powi(2);
            }
        }
        (error / signal).sqrt()
    };
    println!(
        "| {sigma} | {f}, {p} | {:.4} | {} → {angular:.1} | {} → {made:.5} | {} → {created:.5} | {:.0} → {:.0} | {coefficients:.4} | {:.1} % | {:.1} % |",
        lpq.share(f, p),
        paper[0],
        paper[1],
        paper[2],
        paper[0] / paper[1],
        angular / made,
        100.0 * rms(PI / 3.0),
        100.0 * rms(PI),
    );
}

/// The viewer in world directions, from (θ_o, φ_o) about c.
fn viewer(c: DVec3, [theta, phi]: [f64; 2]) -> DVec3 {
    let [x, y, z] = frame(c);
    (x * phi.cos() + y * phi.sin()) * theta.sin() + z * theta.cos()
}

struct Lobe {
    sigma: f64,
    /// Largest angle from the mirror direction.
    reach: f64,
}

/// The light's texels: directions, and radiance times solid angle.
struct LightTexels {
    /// Rows of the image: θ, and its texels.
    rows: Vec<(f64, Vec<Texel>)>,
}

type Texel = (DVec3, [f64; 3]);

impl LightTexels {
    fn new(image: &SphereImage) -> Self {
        let (w, h) = (image.width, image.height);
        let row = |j: usize| {
            let area = Layout::LatLong.solid_angle(w, h, 0, 0, j);
            let texel = |i: usize| {
                let d = Layout::LatLong.texel_direction(w, h, 0, i, j).expect("lat-long fills its image");
                (d, image.texel(0, i, j).map(|l| f64::from(l) * area))
            };
            (PI * (j as f64 + 0.5) / h as f64, (0..w).map(texel).collect())
        };
        Self { rows: (0..h).map(row).collect() }
    }

    /// Σ L f_cos Ω of (5.34) for the mirror direction c of the viewer wo.
    fn sum(&self, lobe: &Lobe, c: DVec3, wo: DVec3) -> [f64; 3] {
        let n = (wo + c).normalize();
        let (alpha, least) = (c.y.clamp(-1.0, 1.0).acos(), lobe.reach.cos());
        let scale = 1.0 / (4.0 * PI * lobe.sigma * lobe.sigma);
        let mut sum = [0.0; 3];
        for (theta, texels) in &self.rows {
            if (theta - alpha).abs() > lobe.reach {
                continue;
            }
            for (wi, l) in texels {
                if c.dot(*wi) < least || n.dot(*wi) <= 0.0 {
                    continue;
                }
                let theta_h = n.dot((*wi + wo).normalize()).min(1.0).acos();
                let f = scale * (-(theta_h / lobe.sigma).powi(2)).exp();
                (0..3).for_each(|k| sum[k] += f * l[k]);
            }
        }
        sum
    }
}
