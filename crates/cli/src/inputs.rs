//! Arguments that several commands take, and their values.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use steradian_base::{ParamValues, Value};
use steradian_light::load::{Arrangement, FileLayout, Profile};
use steradian_light::suns::Taken;
use steradian_light::{Lamp, Lights};
use steradian_scene::shadow::MapOptions;
use steradian_session::{Adjust, Destinations, Local, Paths, Shadows};
use steradian_techniques::direct::Suns;

/// How the file of a light is read, turned and scaled.
#[derive(Debug, Clone, Default, Args)]
pub struct AdjustArgs {
    /// Arrangement of the file: latlong, angular, sphere-map, octahedral, cross, strip, paraboloid, …
    /// [default: what the file records, else by its shape]
    #[arg(long, value_name = "NAME", value_parser = FileLayout::parse)]
    pub layout: Option<FileLayout>,
    #[arg(long, value_name = "NAME", value_parser = Profile::parse, help = format!("Convention of the file: {} [default: steradian, or what the file says]", crate::names::profiles()))]
    pub profile: Option<&'static Profile>,
    /// Rotation of the light about +Y, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub rotate: f64,
    /// Exposure value by which the light is scaled
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = exposure)]
    pub light_exposure: f64,
}

impl AdjustArgs {
    /// As the session takes it.
    pub fn get(&self) -> Adjust {
        let Self { layout, profile, rotate, light_exposure } = *self;
        Adjust { layout, profile, rotate, light_exposure }
    }
}

/// The size of a face of an output, as `--size` says.
pub fn side(size: (usize, usize), arrangement: Arrangement) -> Result<(usize, usize), Failure> {
    arrangement.side(size).map_err(|e| Failure::usage(format!("--size: {e}")))
}

/// A finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(format!("'{text}' is not a finite number")),
    }
}

/// An exposure value by which light may be scaled: its power of two stays in range.
pub fn exposure(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v.abs() <= 64.0 { Ok(v) } else { Err(format!("'{text}' is not -64 … 64")) })
}

/// A positive finite number.
pub fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err(format!("'{text}' is not positive")) })
}

/// `x,y,z`.
pub fn vector(text: &str) -> Result<[f64; 3], String> {
    let parts: Result<Vec<f64>, String> = text.split(',').map(|p| finite(p.trim())).collect();
    parts?.try_into().map_err(|_| format!("'{text}' is not x,y,z"))
}

/// A parameter of a technique as it was written.
pub type Parameter = (String, Value);

/// `name=value`.
pub fn parameter(text: &str) -> Result<Parameter, String> {
    let (name, value) = text.split_once('=').ok_or_else(|| format!("'{text}' is not NAME=VALUE"))?;
    Ok((name.trim().into(), value.trim().into()))
}

/// Parameters of a technique, each given once.
pub fn parameters(given: &[Parameter]) -> Result<ParamValues, Failure> {
    let mut out = ParamValues::default();
    for (name, value) in given {
        if out.0.insert(name.clone(), value.clone()).is_some() {
            return Err(Failure::usage(format!("--param {name} is given twice; give it once")));
        }
    }
    Ok(out)
}

/// Refuses a text output that cannot be written, before the work.
pub fn check_text(path: Option<&Path>, context: &mut Context) -> Outcome {
    let Some(path) = path else { return Ok(()) };
    Destinations::default().file("--output", path)?;
    Ok(context.writes(path)?)
}

/// Lights beside the environment, and how they are shaded.
#[derive(Debug, Clone, Default, Args)]
pub struct ExtraLights {
    /// Disk, directional and point lights beside the environment, as --extract-sun writes them; the first two
    /// turn and scale with it
    #[arg(long, value_name = "FILE.json")]
    pub sun_lights: Option<PathBuf>,
    /// A light beside the environment: disk:direction=X/Y/Z,angular-radius=DEGREES,irradiance=R/G/B,
    /// directional:direction=X/Y/Z,irradiance=R/G/B or point:position=X/Y/Z,intensity=R/G/B; as it stands,
    /// whatever --rotate and --light-exposure do to the environment
    #[arg(long, value_name = "SPEC", value_parser = Lamp::parse)]
    pub light: Vec<Lamp>,
    /// Disks and directional lights by the exact reflectance, or folded into the technique's data; the
    /// reference integrates them always
    #[arg(long, value_enum, default_value_t = SunShading::Exact)]
    suns: SunShading,
}

/// How disks and directional lights are shaded.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum SunShading {
    /// By the exact reflectance
    #[default]
    Exact,
    /// As part of the technique's data
    Fold,
}

impl ExtraLights {
    /// Adds the lights.
    pub fn join(&self, lights: &mut Lights, adjust: &Adjust, context: &mut Context) -> Outcome {
        if let Some(path) = &self.sun_lights {
            context.join_lights(path, lights, adjust)?;
        }
        self.light.iter().for_each(|l| l.join(lights));
        Ok(())
    }

    /// What becomes of disks and directional lights.
    pub fn suns(&self) -> Suns {
        match self.suns {
            SunShading::Exact => Suns::Exact,
            SunShading::Fold => Suns::Fold,
        }
    }
}

/// The technique for directional and point lights.
#[derive(Debug, Clone, Default, Args)]
pub struct LocalArg {
    /// Technique for directional and point lights, with its parameters, such as banks_table or
    /// vertex_analytic:rate=pixel, or the file that bake --local wrote; environment and disks stay with
    /// --technique [default: exact, or what the scene file says]
    #[arg(long, value_name = "SLUG[:NAME=VALUE,…]")]
    local: Option<String>,
}

impl LocalArg {
    /// The technique; `None` where it is not named, `Some(None)` where exact shading is.
    pub fn get(&self) -> Result<Option<Option<Local>>, Failure> {
        Ok(self.local.as_deref().map(Local::parse).transpose()?)
    }

    /// The same with what the files hold that its parameters name.
    pub fn open(&self, context: &mut Context) -> Result<Option<Option<Local>>, Failure> {
        let open = |local: Option<Local>| local.map(|l| context.open_local(&l, None)).transpose();
        Ok(self.get()?.map(open).transpose()?)
    }
}

/// Writes the file of suns that were taken out of a light, and says what was found.
pub fn write_suns(taken: &Taken, path: &Path, context: &Context) -> Outcome {
    context.write_text(Some(path), &context.json_text(taken.json()))?;
    taken.lines().iter().for_each(|line| context.say(line));
    Ok(())
}

/// What is asked of the path tracer.
#[derive(Debug, Default, clap::Args)]
pub struct PathArgs {
    /// Reflections of a path at most, with path; 1 is direct light with shadows [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    bounces: Option<u32>,
    /// Noise of path at which to stop: the standard error over radiance, RMS over a picture's surfaces or of
    /// each point [default: 0.01]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = positive)]
    noise: Option<f64>,
}

impl PathArgs {
    /// As the session takes it; refused where no path is traced.
    pub fn get(&self, traced: bool) -> Result<Paths, Failure> {
        if !traced && (self.bounces.is_some() || self.noise.is_some()) {
            return Err(Failure::usage("--bounces and --noise belong to path"));
        }
        let usual = Paths::default();
        Ok(Paths { bounces: self.bounces.unwrap_or(usual.bounces), noise: self.noise.unwrap_or(usual.noise) })
    }
}

/// Shadows of lights beside a technique's data.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct ShadowArg {
    /// What shadows suns, points and other lights beside a technique's data: ray, none, or auto (ray under
    /// techniques that know shadows; in render, lobe on a ground that another one shades); map,
    /// map:size=1024,taps=3 (shadow maps) or volume (shadow volumes); lobe: as ray, and the environment by
    /// rays over the reflectance's lobe, under the reference too, on the CPU [default: auto]
    #[arg(long, value_name = "HOW", value_parser = shadows)]
    pub shadows: Option<Shadows>,
}

fn shadows(text: &str) -> Result<Shadows, String> {
    match text {
        "auto" => Ok(Shadows::Auto),
        "none" => Ok(Shadows::Off),
        "ray" => Ok(Shadows::Ray),
        "volume" => Ok(Shadows::Volume),
        "lobe" => Ok(Shadows::Lobe),
        _ => match text.strip_prefix("map") {
            Some("") => Ok(Shadows::Map(MapOptions::default())),
            Some(rest) if rest.starts_with(':') => MapOptions::parse(&rest[1..]).map(Shadows::Map),
            _ => Err(steradian_base::unknown(
                "shadows",
                text,
                &["auto", "none", "ray", "map", "volume", "lobe"],
            )),
        },
    }
}
