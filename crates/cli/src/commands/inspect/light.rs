//! What an environment is.

use super::{Line, Report, file_name};
use crate::context::Context;
use crate::failure::Failure;
use crate::inputs::{self, Adjust};
use glam::DVec3;
use rayon::prelude::*;
use serde_json::{Value, json};
use steradian_light::load::Samples;
use steradian_light::{DiskLight, Lights};
use steradian_sphere::layout::Position;
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};

/// Bands of the reported spectrum.
const BANDS: usize = 16;
/// Histogram bins per factor of two.
const BINS_PER_STOP: f64 = 16.0;
/// Stops of the histogram below and above 1.
const STOPS: f64 = 64.0;

/// Sums over an image, in one pass over its rows.
#[derive(Clone)]
struct Sums {
    min: [f32; 3],
    max: [f32; 3],
    negative: u64,
    lowest_positive: f32,
    brightest: (f32, usize),
    /// Luminous energy and solid angle by luminance.
    bins: Vec<(f64, f64)>,
}

impl Sums {
    fn new() -> Self {
        Self {
            min: [f32::INFINITY; 3],
            max: [f32::NEG_INFINITY; 3],
            negative: 0,
            lowest_positive: f32::INFINITY,
            brightest: (f32::NEG_INFINITY, 0),
            bins: vec![(0.0, 0.0); (2.0 * STOPS * BINS_PER_STOP) as usize],
        }
    }

    fn add(&mut self, rgb: [f32; 3], omega: f64, index: usize) {
        for c in 0..3 {
            self.min[c] = self.min[c].min(rgb[c]);
            self.max[c] = self.max[c].max(rgb[c]);
            self.negative += u64::from(rgb[c] < 0.0);
        }
        let y = steradian_render::tone::luminance(rgb);
        if y > self.brightest.0 {
            self.brightest = (y, index);
        }
        if y > 0.0 {
            self.lowest_positive = self.lowest_positive.min(y);
        }
        let stop = if y > 0.0 { (f64::from(y).log2() + STOPS) * BINS_PER_STOP } else { 0.0 };
        let bin = (stop as usize).min(self.bins.len() - 1);
        self.bins[bin].0 += f64::from(y.max(0.0)) * omega;
        self.bins[bin].1 += omega;
    }

    fn merge(mut self, o: Self) -> Self {
        for c in 0..3 {
            self.min[c] = self.min[c].min(o.min[c]);
            self.max[c] = self.max[c].max(o.max[c]);
        }
        self.negative += o.negative;
        self.lowest_positive = self.lowest_positive.min(o.lowest_positive);
        if o.brightest.0 > self.brightest.0 {
            self.brightest = o.brightest;
        }
        self.bins.iter_mut().zip(o.bins).for_each(|(a, b)| *a = (a.0 + b.0, a.1 + b.1));
        self
    }

    /// Part of the luminous energy that the brightest `part` of the sphere holds.
    fn share(&self, part: f64) -> f64 {
        let (energy, omega) = self.bins.iter().fold((0.0, 0.0), |s, b| (s.0 + b.0, s.1 + b.1));
        if energy <= 0.0 {
            return 0.0;
        }
        let (mut left, mut sum) = (part * omega, 0.0);
        for (e, w) in self.bins.iter().rev().filter(|b| b.1 > 0.0) {
            let taken = (left / w).min(1.0);
            sum += taken * e;
            left -= taken * w;
            if left <= 0.0 {
                break;
            }
        }
        sum / energy
    }
}

/// Rows per block: blocks are summed in order, whatever the number of threads.
const ROWS: usize = 64;

fn sums(image: &SphereImage) -> Sums {
    let rows = image.layout.faces() * image.height;
    let blocks: Vec<Sums> = (0..rows.div_ceil(ROWS))
        .into_par_iter()
        .map(|b| {
            let mut s = Sums::new();
            for row in b * ROWS..((b + 1) * ROWS).min(rows) {
                let omega = image.row_solid_angles(row / image.height, row % image.height);
                for (i, &w) in omega.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                    let k = row * image.width + i;
                    s.add([image.planes[0][k], image.planes[1][k], image.planes[2][k]], w, k);
                }
            }
            s
        })
        .collect();
    blocks.into_iter().fold(Sums::new(), Sums::merge)
}

/// Direction of texel `k` of a plane.
fn direction(image: &SphereImage, k: usize) -> DVec3 {
    let row = k / image.width;
    let at = Position {
        face: row / image.height,
        x: (k % image.width) as f64 + 0.5,
        y: (row % image.height) as f64 + 0.5,
    };
    image.layout.direction(image.width, image.height, at).unwrap_or(DVec3::Y)
}

/// The report on an image or a sky.
pub fn report(spec: &str, adjust: &Adjust, level: usize, context: &mut Context) -> Result<Report, Failure> {
    let mut facts = Vec::new();
    let mut samples = None;
    let (image, disks) = if inputs::is_sky(spec) {
        let lights = inputs::light(spec, adjust, context)?;
        let disks = lights.disks.clone();
        (lights.into_image(), disks)
    } else {
        let loaded = inputs::map(spec, adjust, level, context)?;
        let r = loaded.report;
        samples = r.samples;
        facts.push(("file_width", json!(r.width)));
        facts.push(("file_height", json!(r.height)));
        facts.push(("file_layout", json!(r.file_layout.name())));
        facts.push(("layout_stated", json!(r.layout_stated)));
        facts.push(("profile", json!(r.profile)));
        facts.push(("low_range", json!(r.low_range)));
        facts.push(("warnings", json!(r.warnings)));
        (loaded.image, Vec::new())
    };
    Ok(describe(spec, &image, samples, &disks, facts))
}

/// Irradiance on a floor under the image: ∫ L ⟨d·y⟩₊ dω by texel centres and exact solid angles.
fn floor(image: &SphereImage) -> [f64; 3] {
    let (w, h) = (image.width, image.height);
    let row = |k: usize| {
        let (face, j) = (k / h, k % h);
        let mut sum = [0.0; 3];
        for i in 0..w {
            let up = image.layout.texel_direction(w, h, face, i, j).map_or(0.0, |d| d.y);
            if up > 0.0 {
                let weight = up * image.layout.solid_angle(w, h, face, i, j);
                let texel = image.texel(face, i, j);
                (0..3).for_each(|c| sum[c] += weight * f64::from(texel[c]));
            }
        }
        sum
    };
    let rows: Vec<[f64; 3]> = (0..image.layout.faces() * h).into_par_iter().map(row).collect();
    rows.iter().fold([0.0; 3], |a, b| std::array::from_fn(|c| a[c] + b[c]))
}

/// What a disk of unit radiance gives a floor, exact where it is wholly above the horizon: π sin²ρ sin(elevation).
fn on_floor(disk: &DiskLight) -> f64 {
    std::f64::consts::PI * disk.angular_radius.sin().powi(2) * disk.direction.y.max(0.0)
}

/// `sum` with each disk's radiance times its weight added.
fn plus_disks(sum: [f64; 3], disks: &[DiskLight], weight: impl Fn(&DiskLight) -> f64) -> [f64; 3] {
    disks.iter().fold(sum, |s, d| std::array::from_fn(|c| s[c] + weight(d) * d.radiance[c]))
}

/// `samples`: those of the file, where the image is made from them.
fn describe(
    spec: &str,
    image: &SphereImage,
    samples: Option<Samples>,
    disks: &[DiskLight],
    facts: Vec<(&str, Value)>,
) -> Report {
    let mut s = sums(image);
    if let Some(Samples { min, max, negative }) = samples {
        (s.min, s.max, s.negative) = (min, max, negative);
    }
    let sh = spectrum(image, disks);
    let bands = band_energy(&sh);
    let total: f64 = bands.iter().sum();
    let integral = plus_disks(image.integral(), disks, DiskLight::solid_angle);
    let mean = integral.map(|v| v / (4.0 * std::f64::consts::PI));
    let up = plus_disks(floor(image), disks, on_floor);
    let shares = [1e-4, 1e-3, 1e-2, 1e-1].map(|p| s.share(p));
    let brightest = direction(image, s.brightest.1);
    let dominant = inputs::dominant(&sh);
    let stops = (s.brightest.0 / s.lowest_positive).log2();
    let low_range = facts.iter().any(|(k, v)| *k == "low_range" && *v == json!(true));
    let suns = suns(image);
    let advice = advice(&s, &bands, disks, low_range);
    let mut json = json!({
        "kind": "environment",
        "name": file_name(spec),
        "layout": layout_name(image.layout),
        "width": image.width,
        "height": image.height,
        "faces": image.layout.faces(),
        "min": s.min,
        "max": s.max,
        "mean": mean,
        "integral": integral,
        "irradiance_up": up,
        "dynamic_range_stops": stops,
        "negative_samples": s.negative,
        "brightest": {"direction": brightest.to_array(), "luminance": s.brightest.0},
        "dominant_direction": dominant.map(|d| d.to_array()),
        "energy_in_brightest": {"0.01%": shares[0], "0.1%": shares[1], "1%": shares[2], "10%": shares[3]},
        "sh_energy": bands.iter().map(|b| if total > 0.0 { b / total } else { 0.0 }).collect::<Vec<_>>(),
        "disks": disks.iter().map(disk_json).collect::<Vec<_>>(),
        "suns_in_the_image": suns.iter().map(|(d, _)| disk_json(d)).collect::<Vec<_>>(),
        "advice": advice,
    });
    if let Value::Object(map) = &mut json {
        for (key, value) in facts {
            map.insert(key.into(), value);
        }
    }
    let mut lines = lines(&json, image, &s, &bands, mean, up, shares, brightest, dominant, stops);
    lines.extend(suns.iter().map(|(d, share)| ("sun in the image", sun_line(d, *share))));
    Report { json, lines: with_disks(lines, disks, &advice) }
}

fn lines(
    json: &Value,
    image: &SphereImage,
    s: &Sums,
    bands: &[f64],
    mean: [f64; 3],
    up: [f64; 3],
    shares: [f64; 4],
    brightest: DVec3,
    dominant: Option<DVec3>,
    stops: f32,
) -> Vec<Line> {
    let total: f64 = bands.iter().sum();
    let mut seen = 0.0;
    let cumulative: Vec<String> = bands
        .iter()
        .take(8)
        .enumerate()
        .map(|(l, b)| {
            seen += b;
            format!("l≤{l} {:.1} %", 100.0 * seen / total.max(f64::MIN_POSITIVE))
        })
        .collect();
    let place = |d: DVec3| {
        let (elevation, azimuth) = (d.y.clamp(-1.0, 1.0).asin().to_degrees(), d.z.atan2(d.x).to_degrees());
        format!(
            "({:.3}, {:.3}, {:.3}), elevation {elevation:.1}°, azimuth {azimuth:.1}° from +X to +Z",
            d.x, d.y, d.z
        )
    };
    let stated = json
        .get("layout_stated")
        .and_then(Value::as_bool)
        .map_or("", |s| if s { "" } else { " (by its shape)" });
    let size = match image.layout.faces() {
        1 => format!("{} x {}", image.width, image.height),
        n => format!("{n} faces of {} x {}", image.width, image.height),
    };
    let range = |v: [f32; 3]| format!("{} {} {}", v[0], v[1], v[2]);
    let three = |v: [f64; 3]| format!("{:.5} {:.5} {:.5}", v[0], v[1], v[2]);
    let mut out: Vec<Line> = vec![
        ("name", json["name"].as_str().unwrap_or_default().into()),
        ("layout", format!("{}{stated}, {size}", layout_name(image.layout))),
        ("smallest", range(s.min)),
        ("largest", range(s.max)),
        ("mean", format!("{} (radiance, W sr⁻¹ m⁻²)", three(mean))),
        ("irradiance up", format!("{} (on a floor, W m⁻²)", three(up))),
        ("range", format!("{stops:.1} stops")),
        ("negative", format!("{} samples", s.negative)),
        ("brightest", format!("{} at {}", s.brightest.0, place(brightest))),
    ];
    if let Some(d) = dominant {
        out.push(("dominant", place(d)));
    }
    let percent = |v: f64| format!("{:.1} %", 100.0 * v);
    out.push((
        "energy",
        format!(
            "brightest 0.01 % of the sphere holds {}, 0.1 % {}, 1 % {}, 10 % {}",
            percent(shares[0]),
            percent(shares[1]),
            percent(shares[2]),
            percent(shares[3])
        ),
    ));
    out.push(("SH energy", format!("{} (of {} bands)", cumulative.join(", "), bands.len())));
    out
}

fn with_disks(mut lines: Vec<Line>, disks: &[DiskLight], advice: &[String]) -> Vec<Line> {
    for d in disks {
        let elevation = d.direction.y.clamp(-1.0, 1.0).asin().to_degrees();
        let flux = d.radiance.map(|c| c * d.solid_angle());
        lines.push((
            "disk",
            format!(
                "elevation {elevation:.1}°, radius {:.3}°, irradiance across it {:.3} {:.3} {:.3} W m⁻²",
                d.angular_radius.to_degrees(),
                flux[0],
                flux[1],
                flux[2]
            ),
        ));
    }
    lines.extend(advice.iter().map(|a| ("advice", a.clone())));
    lines
}

/// Images of more texels are not searched for suns.
const MOST_TEXELS: usize = 1 << 25;

/// The suns that `--extract-sun` would take out of the image, and their parts of its flux.
fn suns(image: &SphereImage) -> Vec<(DiskLight, f64)> {
    if image.planes[0].len() > MOST_TEXELS {
        return Vec::new();
    }
    let e = steradian_light::suns::extract(image, &steradian_light::suns::SunOptions::default());
    e.suns.into_iter().zip(e.shares).collect()
}

fn sun_line(d: &DiskLight, share: f64) -> String {
    let [x, y, z] = d.direction.to_array();
    let radius = d.angular_radius.to_degrees();
    let percent = 100.0 * share;
    format!(
        "at ({x:.3}, {y:.3}, {z:.3}), radius {radius:.3}°, {percent:.1} % of the flux (convert --extract-sun)"
    )
}

fn disk_json(d: &DiskLight) -> Value {
    json!({
        "direction": d.direction.to_array(),
        "angular_radius_degrees": d.angular_radius.to_degrees(),
        "radiance": d.radiance,
    })
}

fn spectrum(image: &SphereImage, disks: &[DiskLight]) -> ShRgb {
    let mut all = sh::project(image, BANDS - 1);
    let alone = inputs::coefficients(&Lights { disks: disks.to_vec(), ..Lights::default() }, BANDS - 1);
    for (to, from) in all.c.iter_mut().zip(&alone.c) {
        to.iter_mut().zip(from).for_each(|(a, b)| *a += b);
    }
    all
}

/// Σ over channels and m of squared coefficients, by band.
fn band_energy(sh: &ShRgb) -> Vec<f64> {
    let band = |l: usize| sh.c.iter().flat_map(|c| &c[l * l..(l + 1) * (l + 1)]).map(|v| v * v).sum();
    (0..=sh.order).map(band).collect()
}

fn layout_name(layout: Layout) -> &'static str {
    steradian_light::load::Arrangement::of(layout).name()
}

fn advice(s: &Sums, bands: &[f64], disks: &[DiskLight], low_range: bool) -> Vec<String> {
    let mut out = Vec::new();
    if low_range {
        out.push("display-referred data: lights are clipped, so that lighting comes out too dark; use the HDR original".into());
    }
    let sharp = s.share(1e-4);
    if sharp > 0.2 {
        out.push(format!(
            "{:.0} % of the energy is in 0.01 % of the sphere: a sun or a lamp. SH of few bands will ring, and sampling will be noisy",
            100.0 * sharp
        ));
    }
    if s.max.iter().any(|m| *m > 65504.0) {
        out.push("beyond the range of half floats (65504): write 32-bit floats".into());
    }
    if s.negative > 0 {
        out.push("negative samples are kept as data; --negative zero removes them".into());
    }
    let total: f64 = bands.iter().sum();
    let three: f64 = bands.iter().take(3).sum();
    if disks.is_empty() && sharp <= 0.2 && total > 0.0 {
        let part = 100.0 * three / total;
        out.push(format!("9 SH coefficients hold {part:.0} % of the energy below band {BANDS}; diffuse lighting needs no more"));
    }
    if s.brightest.0 <= 1.0 && !low_range {
        out.push("nothing is brighter than 1: it may have been clipped or tone-mapped".into());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bright_texel_is_found_and_holds_its_energy() {
        let mut image = SphereImage::from_fn(Layout::LatLong, 64, 32, |_| [1.0; 3]);
        let k = image.index(0, 48, 10);
        image.planes.iter_mut().for_each(|p| p[k] = 1e6);
        let s = sums(&image);
        assert_eq!(s.brightest.1, k);
        // The texel covers about 0.07 % of the sphere.
        assert!(s.share(1e-2) > 0.99 && s.share(1e-5) < 0.1);
        assert!((s.share(1.0) - 1.0).abs() < 1e-9);
        let d = direction(&image, k);
        assert!((d.y - (std::f64::consts::PI * 10.5 / 32.0).cos()).abs() < 1e-12);
    }

    #[test]
    fn the_white_furnace_has_one_band() {
        let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |_| [1.0; 3]);
        let bands = band_energy(&spectrum(&image, &[]));
        assert!((bands[0] - 12.0 * std::f64::consts::PI).abs() < 1e-4);
        assert!(bands[1..].iter().all(|b| *b < 1e-12 * bands[0]));
        assert!((floor(&image)[0] - std::f64::consts::PI).abs() < 1e-2);
    }

    #[test]
    fn a_disk_overhead_counts_in_the_floor_and_in_the_sphere() {
        let disk = DiskLight { direction: DVec3::Y, angular_radius: 0.1, radiance: [2.0; 3] };
        let up = plus_disks([1.0; 3], &[disk], on_floor);
        assert!((up[0] - (1.0 + 2.0 * std::f64::consts::PI * 0.1f64.sin().powi(2))).abs() < 1e-12);
        assert_eq!(plus_disks([0.0; 3], &[disk], DiskLight::solid_angle)[1], 2.0 * disk.solid_angle());
    }
}
