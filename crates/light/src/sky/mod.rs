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
use spec::{Key, parse};
pub use spectrum::{EFFICACY, luminance};
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
    NAMES.contains(&head(spec).0)
}

fn head(spec: &str) -> (&str, &str) {
    spec.split_once(':').unwrap_or((spec, ""))
}

/// Largest side of an image.
const MAX_SIDE: usize = 32_768;

const fn key(key: &'static str, default: f64, low: f64, high: f64, colour: bool) -> Key {
    Key { key, default, range: [low, high], colour }
}

const SKY: [Key; 4] = [
    key("elevation", 35.0, -5.0, 90.0, false),
    key("azimuth", 120.0, -3600.0, 3600.0, false),
    key("turbidity", 3.0, 1.0, 10.0, false),
    key("ground", 0.2, 0.0, 1.0, true),
];
const OVERCAST: [Key; 2] = [key("zenith", 20.0, 0.0, 1e9, false), key("ground", 0.2, 0.0, 1.0, true)];
const STUDIO: [Key; 1] = [key("scale", 1.0, 0.0, 1e9, false)];
const FURNACE: [Key; 1] = [key("radiance", 1.0, 0.0, 1e9, true)];

/// Makes the environment that a spec names, as a lat-long image of `width` × `height` texels.
pub fn by_name(spec: &str, width: usize, height: usize) -> Result<Generated, SkyError> {
    let (name, text) = head(spec);
    let side = 1..=MAX_SIDE;
    if is_name(spec) && !(side.contains(&width) && side.contains(&height)) {
        return Err(SkyError::Size(width, height));
    }
    match name {
        "sky" => {
            let v = parse("sky", &SKY, text)?;
            Ok(clear_sky([v[0][0], v[1][0], v[2][0]], v[3], width, height))
        }
        "overcast" => {
            let v = parse("overcast", &OVERCAST, text)?;
            let image = formula::overcast(v[0][0], v[1], width, height);
            let description = format!(
                "CIE standard overcast sky, zenith radiance {} W sr⁻¹ m⁻², ground albedo {}",
                v[0][0],
                triple(v[1])
            );
            Ok(Generated { image, sun: None, description })
        }
        "studio" => {
            let v = parse("studio", &STUDIO, text)?;
            let image = formula::studio(v[0][0], width, height);
            Ok(Generated {
                image,
                sun: None,
                description: format!("studio with six soft boxes, scale {}", v[0][0]),
            })
        }
        "furnace" => {
            let v = parse("furnace", &FURNACE, text)?;
            let image = formula::furnace(v[0], width, height);
            Ok(Generated {
                image,
                sun: None,
                description: format!("white furnace, radiance {}", triple(v[0])),
            })
        }
        _ => Err(SkyError::UnknownName(name.to_owned())),
    }
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
        triple(ground)
    );
    Generated { image, sun, description }
}

fn triple([r, g, b]: [f64; 3]) -> String {
    if r == g && g == b { format!("{r}") } else { format!("{r}/{g}/{b}") }
}

#[cfg(test)]
mod tests;
