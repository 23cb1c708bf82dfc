//! `steradian verify`: what a prefiltered file of any tool really holds, level by level.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::{inputs, names};
use clap::Args;
use steradian_base::unknown;
use steradian_light::load::{FileLayout, Profile};
use steradian_session::Adjust;
use steradian_session::prefiltered::Request;
use steradian_verify::Family;
use steradian_verify::laws::Consumer;

/// Options of `steradian verify`.
#[derive(Debug, Args)]
pub struct Options {
    /// Texture (.ktx2, .ktx, .dds), image, pattern with {}, .gltf with a light, or folder of levels
    #[arg(value_name = "FILE")]
    file: String,
    #[arg(short, long, value_name = "NAME", value_parser = consumer, help = format!("Whose file: {}", names::listed(&Consumer::names())))]
    profile: Consumer,
    /// The light that it was made from: image or sky spec
    #[arg(short, long, value_name = "ENV")]
    environment: String,
    #[arg(long, value_name = "NAME", value_parser = family, help = format!("What it should hold: {} [default: what file and name say, else the profile's]", names::listed(&Family::ALL.map(Family::name))))]
    kernel: Option<Family>,
    /// Perceptual roughness of a file of one level [default: what the file says, else 0]
    #[arg(long, value_name = "R", allow_negative_numbers = true, value_parser = roughness)]
    perceptual_roughness: Option<f64>,
    /// Largest relative RMS error of a level against what the profile expects; above it, as with any fault,
    /// the command exits with 4
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Arrangement of the file: latlong, cross, strip, octahedral, … [default: by its shape]
    #[arg(long, value_name = "NAME", value_parser = FileLayout::parse)]
    layout: Option<FileLayout>,
    /// Arrangement of the light [default: by its shape]
    #[arg(long, value_name = "NAME", value_parser = FileLayout::parse)]
    light_layout: Option<FileLayout>,
    #[arg(long, value_name = "NAME", value_parser = Profile::parse, help = format!("Convention of the light: {} [default: steradian, or what the file says]", names::profiles()))]
    light_profile: Option<&'static Profile>,
    /// Rotation of the light about +Y, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, value_parser = inputs::finite)]
    rotate: f64,
    /// Exposure value by which the light is scaled
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = inputs::exposure)]
    light_exposure: f64,
}

fn consumer(text: &str) -> Result<Consumer, String> {
    Consumer::find(text).ok_or_else(|| unknown("profile", text, &Consumer::names()))
}

fn family(text: &str) -> Result<Family, String> {
    let names = Family::ALL.map(Family::name);
    Family::from_name(text).ok_or_else(|| unknown("kernel", text, &names))
}

fn roughness(text: &str) -> Result<f64, String> {
    let r = inputs::finite(text)?;
    if (0.0..=1.0).contains(&r) { Ok(r) } else { Err(format!("'{text}' is not within 0 to 1")) }
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let adjust = Adjust {
        layout: o.light_layout,
        profile: o.light_profile,
        rotate: o.rotate,
        light_exposure: o.light_exposure,
    };
    let request = Request {
        file: o.file,
        consumer: o.profile,
        environment: o.environment,
        adjust,
        kernel: o.kernel,
        perceptual_roughness: o.perceptual_roughness,
        layout: o.layout,
        tolerance: o.tolerance,
    };
    let (found, missed) = context.verify(&request)?.even_if_missed();
    if context.common.json {
        context.print_json(found.document())?;
    } else {
        context.print_words(&found.text())?;
    }
    // What they are is on standard output.
    let file = found.file.as_deref().unwrap_or_default();
    match found.faults().len() {
        0 => {}
        1 => return Err(Failure::missed(format!("{file}: 1 fault"))),
        n => return Err(Failure::missed(format!("{file}: {n} faults"))),
    }
    missed.map_or(Ok(()), |m| {
        let (worst, t) = (m.reached, m.asked);
        let why = format!("relative RMS error {worst:.2e} is above {t:.2e}; no fault has a name");
        Err(Failure::missed(why))
    })
}
