//! The light of a figure.

use super::{Options, say};
use anyhow::Result;
use std::path::Path;
use std::sync::Arc;
use steradian_light::load::{LoadOptions, load};
use steradian_light::{Environment, Lights, sky};
use steradian_testkit::data_dir;

/// Size of lights by formula.
const SKY: (usize, usize) = (256, 128);

/// The light that the options name, else `file` of the data folder, else a studio; and its name.
pub fn of(o: &Options, file: &str) -> Result<(String, Lights)> {
    if let Some(spec) = &o.light {
        return if sky::is_name(spec) { by_formula(spec) } else { read(Path::new(spec)) };
    }
    match data_dir().map(|d| d.join(file)).filter(|p| p.exists()) {
        Some(path) => read(&path),
        None => {
            say(&format!("no {file} (STERADIAN_DATA): the built-in studio stands in"));
            by_formula("studio")
        }
    }
}

fn read(path: &Path) -> Result<(String, Lights)> {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    Ok((name, load(path, &LoadOptions::default())?.into_environment().into()))
}

fn by_formula(spec: &str) -> Result<(String, Lights)> {
    let sky = sky::by_name(spec, SKY.0, SKY.1).map_err(anyhow::Error::msg)?;
    let environment = Some(Arc::new(Environment { image: sky.image }));
    let lights = Lights { environment, disks: sky.sun.into_iter().collect(), ..Lights::default() };
    Ok((spec.into(), lights))
}
