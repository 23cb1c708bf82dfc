//! Figure 5.4: balls under light that is blurred more and more (downwards), of lobes that grow wider and
//! wider (to the right).
//!
//! Both are of one series of widths σ: light blurred by the heat kernel of standard deviation σ, and lobes
//! cosⁿ about the mirror direction with n = 1/σ², which have the same width. The paper: the highest frequency
//! of a picture is about the lesser of the light's and the lobe's, so that balls look alike within each of
//! its L-shaped delimiters, where the greater of the two widths is one. The table says which order holds
//! [`HELD`] of the energy beyond the mean, of light, lobe and reflected light.

use super::{Options, light, percent, save, say};
use anyhow::{Context, Result};
use glam::DVec3;
use steradian_render::tone::auto_exposure;
use steradian_render::{Cell, Develop, Film, Row, Sheet, ToneMapper};
use steradian_sphere::sh::{self, ColumnsRgb, PointSynthesis, ShTransform, zonal};

/// Standard deviations, degrees. The least hides what orders beyond [`ORDER`] would hold.
const WIDTHS: [f64; 5] = [1.0, 3.0, 8.0, 20.0, 45.0];
/// Highest order of light and pictures.
const ORDER: usize = 255;
/// Share of the energy beyond the mean that counts.
const HELD: f64 = 0.99;
/// Of the function's range, in a picture.
const ERROR: f64 = 1e-5;

/// Factors of the light's bands.
fn blur(degrees: f64) -> Vec<f64> {
    zonal::heat(ORDER, 0.5 * degrees.to_radians().powi(2))
}

/// Factors of a lobe of unit integral.
fn lobe(degrees: f64) -> Vec<f64> {
    let k = zonal::phong(ORDER, degrees.to_radians().powi(-2));
    let mut k: Vec<f64> = k.iter().map(|x| x / k[0]).collect();
    k.resize(ORDER + 1, 0.0);
    k
}

/// The order that holds [`HELD`] of Σ_{l ≥ 1}.
fn order(energies: impl Iterator<Item = f64>) -> usize {
    let all: Vec<f64> = energies.skip(1).collect();
    let total: f64 = all.iter().sum();
    let held = all.iter().scan(0.0, |held, e| Some(std::mem::replace(held, *held + e)));
    held.take_while(|before| *before < HELD * total).count()
}

pub fn run(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, "environments/latlong/grace_latlong.exr")?;
    let image = &lights.environment.as_ref().context("the light has no environment")?.image;
    let mut columns = ColumnsRgb::default();
    ShTransform::new(ORDER, image.width, image.height, sh::Grid::Equirectangular)
        .analyze_columns(image.planes.each_ref().map(Vec::as_slice), &mut columns);
    let energies: Vec<f64> = columns.band_energies().iter().map(|e| e.iter().sum()).collect();
    let reflected =
        |a: &[f64], b: &[f64]| order(energies.iter().zip(a).zip(b).map(|((e, a), b)| e * (a * b).powi(2)));
    let none = vec![1.0; ORDER + 1];
    say(&format!(
        "RH02 figure 5.4: orders that hold {} of the energy beyond the mean, under {name}",
        percent(HELD)
    ));
    let head: String = WIDTHS.iter().map(|w| format!("{:>12}", format!("{w}°"))).collect();
    say(&format!("{:<22}{head}", "lobe"));
    let lobes = WIDTHS.map(|w| {
        let k = lobe(w);
        order((0..=ORDER).map(|l| (2 * l + 1) as f64 * k[l] * k[l]))
    });
    say(&format!("{:<22}{}", "its order", lobes.map(|f| format!("{f:>12}")).concat()));
    let side = o.side.unwrap_or(160);
    let films: Vec<Vec<Film>> = WIDTHS
        .iter()
        .map(|l| WIDTHS.iter().map(|b| ball(&columns, &blur(*l), &lobe(*b), side)).collect())
        .collect();
    // That of the smoothest ball suits them all.
    let smooth = &films[WIDTHS.len() - 1][WIDTHS.len() - 1];
    let ev = auto_exposure(smooth, |i| smooth.alpha[i]);
    let develop = Develop { ev, mapper: ToneMapper::Aces };
    let mut rows = Vec::new();
    for (i, l) in WIDTHS.iter().enumerate() {
        let own = reflected(&blur(*l), &none);
        let line: String =
            WIDTHS.iter().map(|b| format!("{:>12}", reflected(&blur(*l), &lobe(*b)))).collect();
        say(&format!("{:<22}{line}", format!("light {l}°, order {own}")));
        let cells = WIDTHS.iter().enumerate().map(|(j, b)| {
            let caption = format!("order {}", reflected(&blur(*l), &lobe(*b)));
            Some(Cell { picture: framed(develop.film(&films[i][j]), i.max(j)), caption: vec![caption] })
        });
        rows.push(Row {
            label: vec![format!("light {l}°"), format!("order {own}")], cells: cells.collect()
        });
    }
    say(
        "Relative RMS between the balls of a delimiter and the one on the diagonal; and of each diagonal to the one before:",
    );
    for d in 1..WIDTHS.len() {
        let corner = &films[d][d];
        let within: Vec<f64> =
            (0..d).flat_map(|k| [apart(&films[d][k], corner), apart(&films[k][d], corner)]).collect();
        let worst = within.iter().copied().fold(0.0, f64::max);
        say(&format!(
            "{:>4}°: at most {}, {}",
            WIDTHS[d],
            percent(worst),
            percent(apart(&films[d - 1][d - 1], corner))
        ));
    }
    let sheet = Sheet {
        title: "Light and lobes as low-pass filters".into(),
        subtitle: format!(
            "under {name}; frames of one brightness: the greater of the two widths is the same"
        ),
        columns: WIDTHS.map(|w| format!("lobe {w}°")).into(),
        rows,
        text_size: 12.5,
    };
    save(o, "figure-5.4.png", &sheet.draw())
}

/// A ball seen along +Z: what comes from the mirror direction after both filters.
fn ball(light: &ColumnsRgb, a: &[f64], b: &[f64], side: usize) -> Film {
    let factors: Vec<f64> = a.iter().zip(b).map(|(a, b)| a * b).collect();
    let at = |k: usize| (2.0 * k as f64 + 1.0) / side as f64 - 1.0;
    let (pixels, mirrors): (Vec<usize>, Vec<DVec3>) = (0..side * side)
        .filter_map(|k| {
            let (x, y) = (at(k % side), -at(k / side));
            let z2 = 1.0 - x * x - y * y;
            let n = DVec3::new(x, y, z2.max(0.0).sqrt());
            (z2 > 0.0).then(|| (k, 2.0 * n.z * n - DVec3::Z))
        })
        .unzip();
    let mut planes: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; mirrors.len()]);
    PointSynthesis::new(light, &factors, ERROR).at(&mirrors, planes.each_mut().map(Vec::as_mut_slice));
    let mut film = Film::new(side, side);
    for (i, k) in pixels.into_iter().enumerate() {
        (0..3).for_each(|c| film.rgb[c][k] = planes[c][i].max(0.0));
        film.alpha[k] = 1.0;
    }
    film
}

fn apart(a: &Film, b: &Film) -> f64 {
    steradian_render::errors(a, b, |i| b.alpha[i] > 0.0).relative_rms
}

/// A frame whose brightness tells the delimiter.
fn framed(mut picture: steradian_render::Display, delimiter: usize) -> steradian_render::Display {
    let (w, h) = (picture.width, picture.height);
    let share = 1.0 - 0.2 * delimiter as f64;
    let yellow = [235.0, 200.0, 40.0].map(|v: f64| (v * share) as u8);
    for (k, pixel) in picture.rgb.as_chunks_mut::<3>().0.iter_mut().enumerate() {
        let (x, y) = (k % w, k / w);
        if x.min(y).min(w - 1 - x).min(h - 1 - y) < 3 {
            *pixel = yellow;
        }
    }
    picture
}
