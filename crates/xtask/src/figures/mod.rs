//! Figures of Ramamoorthi & Hanrahan 2002, *Frequency Space Environment Map Rendering*, and of Kautz, Sloan &
//! Snyder 2002, *Fast, Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical Harmonics*
//! (`kss02-…`), of Green, Kautz & Durand 2007 (`gkd07-…`), and of Kautz 2004, the survey (`star04-…`): ours
//! beside the paper's.
//!
//! ```text
//! cargo run --release -p steradian-xtask -- figures gallery|btf|5.1|5.2|5.4|5.6|5.7|5.8|5.9|elevations|gkd07-4|5|6|7|prt|ggx|kss02-2|3|4|5|6|7|8|k06|star04|star04-6|7|8|9|15|haar [-o DIR] [--light FILE|SKY]
//!     [--brdf SPEC]… [--side N]
//! ```
//!
//! Tables go to standard output, pictures to DIR (by default the current folder). Real lights and materials
//! come from the data folder (`STERADIAN_DATA`); without it a studio stands in and says so.

mod btf;
mod chart;
mod elevations;
mod energy;
mod engines;
mod frequencies;
mod gallery;
mod gaussians;
mod grazing;
mod kautz;
mod light;
mod mesh;
mod microfacet;
mod noise;
mod occluded;
mod picture;
mod recovered;
mod representations;
mod sentences;
mod showcase;
mod statues;
mod survey;
mod transport;
mod velvet;

use anyhow::{Context, Result, bail};
use std::path::PathBuf;
use steradian_render::Display;

/// What a figure is asked for.
struct Options {
    /// Folder of pictures.
    out: PathBuf,
    /// In place of the figure's light.
    light: Option<String>,
    /// In place of, or beside, the figure's materials.
    brdfs: Vec<String>,
    /// Pixels a side.
    side: Option<usize>,
}

const USAGE: &str = "usage: figures gallery|btf|5.1|5.2|5.4|5.6|5.7|5.8|5.9|elevations|gkd07-4|gkd07-5|gkd07-6|gkd07-7|gkd07-prt|gkd07-ggx|kss02-2|kss02-3|kss02-4|kss02-5|kss02-6|kss02-7|kss02-8|k06|star04|star04-6|star04-7|star04-8|star04-9|star04-15|star04-haar [-o DIR] [--light FILE|SKY] [--brdf SPEC]… [--side N]";

/// `figures NAME …`.
pub fn run(mut words: impl Iterator<Item = String>) -> Result<()> {
    let name = words.next().unwrap_or_default();
    let mut o = Options { out: PathBuf::from("."), light: None, brdfs: Vec::new(), side: None };
    while let Some(option) = words.next() {
        let value = words.next().with_context(|| format!("{option} needs a value; {USAGE}"))?;
        match option.as_str() {
            "-o" | "--output" => o.out = value.into(),
            "--light" => o.light = Some(value),
            "--brdf" => o.brdfs.push(value),
            "--side" => {
                let side = value.parse().ok().filter(|n| (16..=2048).contains(n));
                o.side = Some(side.with_context(|| format!("--side {value}: give 16 to 2048"))?);
            }
            _ => bail!("{option}: {USAGE}"),
        }
    }
    std::fs::create_dir_all(&o.out).with_context(|| format!("{}", o.out.display()))?;
    match name.as_str() {
        "5.1" => showcase::run(&o),
        "5.2" => representations::run(&o),
        "5.4" => frequencies::run(&o),
        "5.6" => microfacet::run(&o),
        "5.7" => energy::run(&o),
        "5.8" => velvet::run(&o),
        "5.9" => grazing::run(&o),
        "elevations" => elevations::run(&o),
        "btf" => btf::run(&o),
        "gallery" => gallery::run(&o),
        "gkd07-4" => gaussians::run(&o),
        "gkd07-5" => occluded::widths(&o),
        "gkd07-6" => occluded::materials(&o),
        "gkd07-7" => occluded::shadows(&o),
        "gkd07-prt" => recovered::run(),
        "gkd07-ggx" => engines::run(&o),
        "kss02-2" => kautz::table(&o),
        "kss02-3" => statues::lights(&o),
        "kss02-4" => noise::varied(&o),
        "kss02-5" => noise::shadowed(&o),
        "kss02-6" => kautz::exponents(&o),
        "kss02-7" => statues::shadows(&o),
        "kss02-8" => statues::models(&o),
        "k06" => transport::basis(&o),
        "star04" => sentences::run(&o),
        "star04-6" => survey::analytical(&o),
        "star04-7" => survey::teapot(&o),
        "star04-8" => survey::sphere(&o),
        "star04-9" => survey::bumps(&o),
        "star04-15" | "star04-23" => survey::bust(&o),
        "star04-haar" => transport::wavelets(&o),
        _ => bail!(USAGE),
    }
}

/// Writes a picture to the folder.
fn save(o: &Options, name: &str, picture: &Display) -> Result<()> {
    let path = o.out.join(name);
    let plane = |c: usize| picture.rgb.iter().skip(c).step_by(3).map(|v| f32::from(*v) / 255.0).collect();
    let raster =
        steradian_formats::Raster::rgb(picture.width, picture.height, [plane(0), plane(1), plane(2)]);
    let options = steradian_formats::WriteOptions {
        already_encoded: true,
        ..steradian_formats::WriteOptions::default()
    };
    steradian_formats::write_image(&path, &raster, &options)?;
    say(&format!("{}: {} x {}", path.display(), picture.width, picture.height));
    Ok(())
}

/// A line on standard output.
#[expect(clippy::print_stdout, reason = "the tables are the output")]
fn say(line: &str) {
    println!("{line}");
}

/// 0.9876 as `98.8 %`.
fn percent(x: f64) -> String {
    format!("{:.1} %", 100.0 * x)
}
