//! Lights beside an environment: suns taken out of it, files of them, and lights by a spec.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::Adjust;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use steradian_light::suns::Taken;
use steradian_light::{Lamp, Lights};
use steradian_techniques::direct::Suns;

/// Lights beside the environment, and how they are shaded.
#[derive(Debug, Clone, Args)]
pub struct Beside {
    /// Disk, directional and point lights beside the environment, as --extract-sun writes them; the first two turn and
    /// scale with it
    #[arg(long, value_name = "FILE.json")]
    sun_lights: Option<PathBuf>,
    /// A light beside the environment: disk:direction=X/Y/Z,angular-radius=DEGREES,irradiance=R/G/B,
    /// directional:direction=X/Y/Z,irradiance=R/G/B or point:position=X/Y/Z,intensity=R/G/B; as it stands, whatever
    /// --rotate and --light-exposure do to the environment
    #[arg(long, value_name = "SPEC", value_parser = Lamp::parse)]
    light: Vec<Lamp>,
    /// Disks and directional lights by the exact reflectance, or folded into the technique's data; the reference
    /// integrates them always
    #[arg(long, value_enum, default_value_t = Way::Exact)]
    suns: Way,
}

/// How disks and directional lights are shaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Way {
    /// By the exact reflectance
    Exact,
    /// As part of the technique's data
    Fold,
}

impl Beside {
    /// Adds the lights.
    pub fn join(&self, lights: &mut Lights, adjust: &Adjust, context: &mut Context) -> Outcome {
        if let Some(path) = &self.sun_lights {
            join_file(path, lights, adjust, context)?;
        }
        self.light.iter().for_each(|l| l.join(lights));
        Ok(())
    }

    /// Is there any?
    pub fn is_some(&self) -> bool {
        self.sun_lights.is_some() || !self.light.is_empty()
    }

    /// What becomes of disks and directional lights.
    pub fn suns(&self) -> Suns {
        match self.suns {
            Way::Exact => Suns::Exact,
            Way::Fold => Suns::Fold,
        }
    }
}

/// Adds the lights of a file, distant ones turned and scaled as the environment is.
pub fn join_file(
    path: &Path,
    lights: &mut Lights,
    adjust: &Adjust,
    context: &mut Context,
) -> Result<(), Failure> {
    let all = Lamp::read(path)?;
    context.note_input(path);
    all.into_iter().for_each(|l| l.adjusted(adjust.rotation(), adjust.gain()).join(lights));
    Ok(())
}

/// Writes the file of suns, and says what was found.
pub fn write(taken: &Taken, path: &Path, context: &Context) -> Outcome {
    context.write_text(Some(path), &context.json_text(taken.json()))?;
    if taken.suns.is_empty() {
        context.say("no sun found: nothing in the light is small, round and bright enough");
    }
    for (d, share) in taken.suns.iter().zip(&taken.shares) {
        let [x, y, z] = d.direction.to_array();
        context.say(format_args!(
            "sun at ({x:.4}, {y:.4}, {z:.4}), angular radius {:.3} degrees, {:.1} % of the flux",
            d.angular_radius.to_degrees(),
            100.0 * share
        ));
    }
    Ok(())
}
