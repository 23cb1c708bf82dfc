//! Environments by formula: a physically based clear sky with its sun, an overcast sky, a studio with soft
//! boxes, and the white furnace. They stand wherever a file is taken, by name:
//!
//! | spec | meaning |
//! |---|---|
//! | `sky:elevation=35,azimuth=120,turbidity=3,ground=0.2` | clear sky and sun; degrees, azimuth from +X towards +Z |
//! | `overcast:zenith=20,ground=0.2` | CIE standard overcast sky of zenith radiance L_z |
//! | `studio:scale=1` | six soft boxes before a graded backdrop |
//! | `furnace:radiance=1` | the same radiance from everywhere |
//!
//! `ground` and `radiance` take one number or `r/g/b`. Radiance is linear Rec. 709 in W sr⁻¹ m⁻² of the
//! visible band: luminance in cd m⁻² is [`EFFICACY`] times the luminance of the RGB.

mod atmosphere;
mod clear;
mod formula;
mod scattering;
mod spec;
mod spectrum;

use crate::DiskLight;
pub use clear::ClearSky;
pub use spec::SkyError;
pub use spectrum::{EFFICACY, luminance};
use steradian_base::{ParamError, ParamInfo, ParamValues, Value, split_spec};
use steradian_sphere::SphereImage;

/// An environment made by formula.
#[derive(Debug, Clone)]
pub struct Generated {
    /// Lat-long radiance, without the sun.
    pub image: SphereImage,
    /// The sun, unclipped.
    pub sun: Option<DiskLight>,
    /// One line: what it is, with all parameters.
    pub description: String,
}

/// The names that [`by_name`] knows.
pub const NAMES: [&str; 4] = ["sky", "studio", "overcast", "furnace"];

/// Does a spec name an environment by formula (rather than a file)?
pub fn is_name(spec: &str) -> bool {
    NAMES.contains(&split_spec(spec).0)
}

/// Largest side of an image.
const MAX_SIDE: usize = 32_768;

const GROUND: ParamInfo = ParamInfo::rgb("ground", [0.0, 1.0], 0.2, "diffuse albedo of the ground");
const ELEVATION: ParamInfo =
    ParamInfo::angle("elevation", [-5.0, 90.0], 35.0, "of the sun above the horizon");
const AZIMUTH: ParamInfo =
    ParamInfo::angle("azimuth", [-3600.0, 3600.0], 120.0, "of the sun, from +X towards +Z");
const TURBIDITY: ParamInfo = ParamInfo::real("turbidity", [1.0, 10.0], 3.0, "1 pure air, 10 haze");
const ZENITH: ParamInfo = ParamInfo::real("zenith", [0.0, 1e9], 20.0, "radiance of the zenith");
const SCALE: ParamInfo = ParamInfo::real("scale", [0.0, 1e9], 1.0, "factor of the radiance");
const RADIANCE: ParamInfo = ParamInfo::rgb("radiance", [0.0, 1e9], 1.0, "from everywhere");

/// The parameters of every sky, in the order of [`NAMES`].
pub const PARAMETERS: [&[ParamInfo]; 4] =
    [&[ELEVATION, AZIMUTH, TURBIDITY, GROUND], &[SCALE], &[ZENITH, GROUND], &[RADIANCE]];

/// Makes the environment that a spec names, as a lat-long image of `width` × `height` texels.
pub fn by_name(spec: &str, width: usize, height: usize) -> Result<Generated, SkyError> {
    let (name, text) = split_spec(spec);
    let Some(k) = NAMES.iter().position(|n| *n == name) else {
        return Err(SkyError::UnknownName(name.to_owned()));
    };
    let side = 1..=MAX_SIDE;
    if !(side.contains(&width) && side.contains(&height)) {
        return Err(SkyError::Size(width, height));
    }
    let values = ParamValues::parse(text, PARAMETERS[k]);
    values.and_then(|v| made(k, &v, width, height)).map_err(|error| SkyError::Param { name: NAMES[k], error })
}

/// The sky of place `k` among [`NAMES`].
fn made(k: usize, v: &ParamValues, width: usize, height: usize) -> Result<Generated, ParamError> {
    let plain = |image, description| Generated { image, sun: None, description };
    Ok(match k {
        0 => {
            let sun = [v.number(&ELEVATION)?, v.number(&AZIMUTH)?, v.number(&TURBIDITY)?];
            clear_sky(sun, v.triple(&GROUND)?, width, height)
        }
        1 => {
            let scale = v.number(&SCALE)?;
            let image = formula::studio(scale, width, height);
            plain(image, format!("studio with six soft boxes, scale {scale}"))
        }
        2 => {
            let (zenith, ground) = (v.number(&ZENITH)?, v.triple(&GROUND)?);
            let image = formula::overcast(zenith, ground, width, height);
            let description = format!(
                "CIE standard overcast sky, zenith radiance {zenith} W sr⁻¹ m⁻², ground albedo {}",
                Value::Rgb(ground)
            );
            plain(image, description)
        }
        _ => {
            let radiance = v.triple(&RADIANCE)?;
            let image = formula::furnace(radiance, width, height);
            plain(image, format!("white furnace, radiance {}", Value::Rgb(radiance)))
        }
    })
}

/// `degrees`: elevation and azimuth, then turbidity.
fn clear_sky(
    [elevation, azimuth, turbidity]: [f64; 3],
    ground: [f64; 3],
    width: usize,
    height: usize,
) -> Generated {
    let sky =
        ClearSky { elevation: elevation.to_radians(), azimuth: azimuth.to_radians(), turbidity, ground };
    let (image, sun) = sky.render(width, height);
    let description = format!(
        "clear sky, sun at elevation {elevation}° and azimuth {azimuth}°, turbidity {turbidity}, ground albedo {}",
        Value::Rgb(ground)
    );
    Generated { image, sun, description }
}

#[cfg(test)]
mod tests;
