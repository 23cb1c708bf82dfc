//! Figures 2 and 6 of Kautz, Sloan & Snyder 2002, *Fast, Arbitrary BRDF Shading for Low-Frequency Lighting
//! Using Spherical Harmonics*: the table of a reflectance, and how many coefficients highlights need.

use super::picture::{Ball, Show, bake, reference};
use super::{Options, light, percent, save, say};
use anyhow::Result;
use glam::DVec3;
use std::sync::Arc;
use steradian_base::Task;
use steradian_brdf::parse;
use steradian_light::{Environment, Lights};
use steradian_render::{Cell, Display, Row, Sheet};
use steradian_sphere::sh::{self, Window};
use steradian_sphere::{Layout, SphereImage};
use steradian_techniques::shared::material::view_table::ViewTable;

/// The reflectance of figure 2; the paper does not say its exponents.
const TABLE: &str = "ashikhmin-shirley:nu=12,nv=4";
const PAPER: [u8; 3] = [22, 24, 28];
const BANDS: usize = 5;

/// A plane of the table as a picture, seen from above: texels beyond the rim are not part of it.
fn plane(texels: &[f32], size: usize, colour: impl Fn(f32) -> [u8; 3]) -> Display {
    let reach = 1.0 + 2.0 / (size - 3) as f32;
    let at = |k: usize| (2.0 * k as f32 / (size - 1) as f32 - 1.0) * reach;
    let pixel = |k: usize| {
        // Rows of pictures run down, t of the table up.
        let (i, j) = (k % size, size - 1 - k / size);
        if at(i).hypot(at(j)) > 1.0 { PAPER } else { colour(texels[j * size + i]) }
    };
    Display { width: size, height: size, rgb: (0..size * size).flat_map(pixel).collect() }
}

/// Figure 2: red for positive, blue for negative; energies below.
pub fn table(o: &Options) -> Result<()> {
    let spec = o.brdfs.first().map_or(TABLE, String::as_str);
    let brdf = parse(spec)?;
    let size = o.side.unwrap_or(96);
    let table = ViewTable::bake(&*brdf, BANDS, size, &Task::quiet())?;
    let planes: Vec<Vec<f32>> = (0..BANDS * BANDS).map(|k| table.plane(1, k)).collect();
    let largest = planes.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
    // The square root shows what is small.
    let shade = |x: f32| (255.0 * (x.abs() / largest).sqrt()) as u8;
    let signed = |x: f32| if x >= 0.0 { [shade(x), 0, 0] } else { [0, 0, shade(x)] };
    let row = |l: usize| {
        let cell = |k: usize| {
            let m = k as isize - l as isize;
            Some(Cell {
                picture: plane(&planes[l * l + k], size, signed),
                caption: vec![format!("l = {l}, m = {m}")],
            })
        };
        let mut cells: Vec<_> = (0..2 * l + 1).map(cell).collect();
        cells.resize_with(2 * BANDS - 1, || None);
        Row { label: Vec::new(), cells }
    };
    let energies: Vec<Vec<f32>> = (0..BANDS)
        .map(|l| {
            let band = &planes[l * l..(l + 1) * (l + 1)];
            (0..size * size).map(|t| band.iter().map(|p| p[t] * p[t]).sum()).collect()
        })
        .collect();
    let most = energies.iter().flatten().fold(0.0f32, |m, x| m.max(*x));
    let grey = |x: f32| [(255.0 * (x / most).sqrt()) as u8; 3];
    let mut cells: Vec<Option<Cell>> = energies
        .iter()
        .enumerate()
        .map(|(l, e)| Some(Cell { picture: plane(e, size, grey), caption: vec![format!("energy, l = {l}")] }))
        .collect();
    cells.resize_with(2 * BANDS - 1, || None);
    say(&format!("KSS02 figure 2: {spec}, green channel, mean energy of a band over views (solid angle)"));
    for (l, e) in energies.iter().enumerate() {
        say(&format!("l = {l}: {:.5}", mean(e, size)));
    }
    let mut rows: Vec<Row> = (0..BANDS).map(row).collect();
    rows.push(Row { label: Vec::new(), cells });
    let sheet = Sheet {
        title: format!("{spec} as a table over the view"),
        subtitle:
            "red positive, blue negative, brightness the square root; last row: squares summed over a band"
                .into(),
        columns: vec![String::new(); 2 * BANDS - 1],
        rows,
        text_size: 11.0,
    };
    save(o, "kss02-2.png", &sheet.draw())
}

/// Over the hemisphere: a texel of the paraboloid has the solid angle 4/(1 + ρ²)² of its area.
fn mean(texels: &[f32], size: usize) -> f64 {
    let reach = 1.0 + 2.0 / (size - 3) as f64;
    let at = |k: usize| (2.0 * k as f64 / (size - 1) as f64 - 1.0) * reach;
    let (mut sum, mut all) = (0.0, 0.0);
    for (k, x) in texels.iter().enumerate() {
        let r2 = at(k % size).powi(2) + at(k / size).powi(2);
        if r2 <= 1.0 {
            let w = 4.0 / (1.0 + r2).powi(2);
            sum += w * f64::from(*x);
            all += w;
        }
    }
    sum / all
}

/// Columns of figure 6: heading, bands, window.
const COUNTS: [(&str, usize, f64); 5] = [
    ("n = 9", 3, 0.0),
    ("n = 25", 5, 0.0),
    ("n = 49", 7, 0.0),
    ("n = 225", 15, 0.0),
    ("n = 225, windowed", 15, 16.0),
];
const EXPONENTS: [[u32; 2]; 3] = [[12, 4], [24, 8], [48, 16]];

/// The first bands of a light as a light.
pub fn projected(lights: &Lights, bands: usize, window: f64) -> Lights {
    let Some(e) = &lights.environment else { return Lights::default() };
    let mut c = sh::project(&e.image, bands - 1);
    if window > 0.0 {
        c.window(Window::Hanning { width: window });
    }
    let image = SphereImage::from_fn(Layout::LatLong, 256, 128, |d: DVec3| c.value(d).map(|v| v as f32));
    Lights { environment: Some(Arc::new(Environment { image })), ..Lights::default() }
}

/// Figure 6: one reflectance, three exponents, by the number of coefficients.
pub fn exponents(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, "environments/latlong/probulator_grace.hdr")?;
    let ball = Ball::seen(o.side.unwrap_or(96));
    let mirror = parse("ggx:alpha=0.001,f0=1")?;
    let mut rows = Vec::new();
    let shown = ball.shaded(&mut *bake("mirror_map", &mirror, &lights, &[("size", 256.0)])?);
    let show = Show::of(&shown);
    let mut cells = vec![show.cell(&shown, vec!["the light in a mirror".into()])];
    for (_, bands, window) in COUNTS {
        let light = projected(&lights, bands, window);
        let film = ball.shaded(&mut *bake("mirror_map", &mirror, &light, &[("size", 256.0)])?);
        cells.push(show.cell(&film, Vec::new()));
    }
    rows.push(Row { label: vec!["light".into()], cells });
    say(&format!("KSS02 figure 6: Ashikhmin-Shirley under {name}, relative RMS error on a ball"));
    let heads: String = COUNTS.iter().map(|c| format!(" {:>18}", c.0)).collect();
    say(&format!("{:<10}{heads}", ""));
    for [nu, nv] in EXPONENTS {
        let brdf = parse(&format!("ashikhmin-shirley:nu={nu},nv={nv}"))?;
        let truth = ball.truth(&reference(&lights)?, &*brdf)?;
        let show = Show::of(&truth);
        let mut cells = vec![show.cell(&truth, vec!["integral".into()])];
        let mut line = String::new();
        for (_, bands, window) in COUNTS {
            // All light in the coefficients, as in the paper.
            let params = [("bands", bands as f64), ("window", window), ("lights", 0.0)];
            let film = ball.shaded(&mut *bake("sh_brdf", &brdf, &lights, &params)?);
            let error = percent(show.errors(&film).relative_rms);
            line += &format!(" {error:>18}");
            cells.push(show.cell(&film, vec![format!("error {error}")]));
        }
        say(&format!("({nu}, {nv}){line}"));
        rows.push(Row { label: vec![format!("AS ({nu}, {nv})")], cells });
    }
    let sheet = Sheet {
        title: "Coefficients against glossiness".into(),
        subtitle: format!("under {name}; spheres of Ashikhmin & Shirley's reflectance, tangents around +Y"),
        columns: std::iter::once("exact").chain(COUNTS.map(|c| c.0)).map(String::from).collect(),
        rows,
        text_size: 12.5,
    };
    save(o, "kss02-6.png", &sheet.draw())
}
