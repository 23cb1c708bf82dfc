//! `steradian verify`: what a prefiltered file of any tool really holds, level by level.
//!
//! The comparison is [`steradian_verify`]'s; here are files, words and the exit code.

mod decode;
mod report;

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, Adjust};
use clap::Args;
use decode::{Held, Reading};
use report::Summary;
use steradian_base::unknown;
use steradian_engines::{filament_irradiance, irradiance};
use steradian_light::load::{FileLayout, Profile};
use steradian_verify::laws::Consumer;
use steradian_verify::{Coefficients, Family, Input, Kernel, check};

/// Options of `steradian verify`.
#[derive(Debug, Args)]
pub struct Options {
    /// Texture (.ktx2, .ktx, .dds), image, pattern with {}, .gltf with a light, or folder of levels
    #[arg(value_name = "FILE")]
    file: String,
    /// Whose file: bevy, three, filament, gltf, khronos, godot, unreal, blender, raw, cmgen or cmft
    #[arg(short, long, value_name = "NAME", value_parser = consumer)]
    profile: Consumer,
    /// The light that it was made from: image or sky spec
    #[arg(short, long, value_name = "ENV")]
    environment: String,
    /// What it should hold: ggx, lambert, charlie, phong, beckmann [default: what file and name say, else the profile's]
    #[arg(long, value_name = "NAME", value_parser = family)]
    kernel: Option<Family>,
    /// Perceptual roughness of a file of one level [default: what the file says, else 0]
    #[arg(long, value_name = "R", allow_negative_numbers = true, value_parser = roughness)]
    perceptual_roughness: Option<f64>,
    /// Largest relative RMS error of a level against what the profile expects; above it, as with any fault, the command
    /// exits with 4
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Arrangement of the file: latlong, cross, strip, octahedral, … [default: by its shape]
    #[arg(long, value_name = "NAME", value_parser = FileLayout::parse)]
    layout: Option<FileLayout>,
    /// Arrangement of the light [default: by its shape]
    #[arg(long, value_name = "NAME", value_parser = FileLayout::parse)]
    light_layout: Option<FileLayout>,
    /// Convention of the light: openexr, cmgen, usd, … [default: steradian, or what the file says]
    #[arg(long, value_name = "NAME", value_parser = Profile::parse)]
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

/// The kernel that each level should hold.
fn expected(o: &Options, held: &Held) -> Vec<Kernel> {
    let get = |key: &str| held.metadata.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str());
    let name = std::path::Path::new(&o.file).file_name().map(|n| n.to_string_lossy().to_lowercase());
    let name = name.unwrap_or_default();
    let says = |words: &[&str]| words.iter().any(|w| name.contains(w));
    let family =
        o.kernel.or_else(|| get("steradian.kernel").and_then(Family::from_name)).or_else(|| match () {
            () if says(&["diffuse", "irradiance", "lambert"]) => Some(Family::Lambert),
            () if says(&["sheen", "charlie"]) => Some(Family::Charlie),
            () => None,
        });
    let last = held.levels.len() - 1;
    // Our own files of one kernel say its roughness; the law of an engine is not asked there.
    let recorded: Vec<f64> = get("steradian.perceptual_roughness")
        .map(|t| t.split_whitespace().filter_map(|v| v.parse().ok()).collect())
        .unwrap_or_default();
    let alone = o
        .perceptual_roughness
        .or_else(|| (last == 0 && o.profile.name == "raw").then(|| recorded.first().copied()).flatten());
    (0..=last)
        .map(|m| {
            let law = o.profile.kernel(m, last);
            match (family, law.roughness()) {
                (Some(Family::Lambert), _) => Kernel { family: Family::Lambert, width: 0.0 },
                (f, Some(r)) => {
                    Kernel::at(f.unwrap_or(Family::Ggx), if last == 0 { alone.unwrap_or(r) } else { r })
                }
                _ => law,
            }
        })
        .collect()
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let reading = Reading { profile: o.profile.profile, layout: o.layout };
    let held = decode::decode(&o.file, &reading, context)?;
    let adjust = Adjust {
        layout: o.light_layout,
        profile: o.light_profile,
        rotate: o.rotate,
        light_exposure: o.light_exposure,
    };
    let lights = inputs::light(&o.environment, &adjust, context)?;
    let wanted = expected(&o, &held);
    let read = o.light_profile.unwrap_or_else(Profile::own);
    let input = Input {
        levels: &held.levels,
        expected: &wanted,
        law: o.profile.law,
        lights: &lights,
        read,
        step: held.step,
    };
    let report = check(&input, &context.task)?;
    let irradiance = held.sh.as_deref().map(|sh| {
        let light = inputs::coefficients(&lights, 2);
        let want = if o.profile.name == "gltf" { irradiance(&light) } else { filament_irradiance(&light) };
        Coefficients::compare(sh, &want)
    });
    let name = std::path::Path::new(&o.file).file_name().map(|n| n.to_string_lossy().into_owned());
    let summary =
        Summary { file: name, consumer: &o.profile, report: &report, irradiance, tolerance: o.tolerance };
    if context.common.json {
        context.print_json(summary.json())?;
    } else {
        context.print(&summary.text())?;
    }
    let (faults, worst) = (summary.faults(), report.worst());
    if !faults.is_empty() {
        return Err(Failure::missed(faults.join("; ")));
    }
    match o.tolerance {
        Some(t) if worst > t => Err(Failure::missed(format!(
            "relative RMS error {worst:.2e} is above {t:.2e}; no fault has a name"
        ))),
        _ => Ok(()),
    }
}
