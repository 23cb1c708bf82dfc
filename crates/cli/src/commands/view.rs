//! `steradian view`: a window.

use crate::commands::render::{size, tone_mapper};
use crate::context::Context;
use crate::failure::{Failure, Outcome};
use clap::Args;
use std::path::PathBuf;
use steradian_render::ToneMapper;

/// Options of `steradian view`.
#[derive(Debug, Args)]
// Without the feature the command says so and reads none of them.
#[cfg_attr(not(feature = "view"), allow(dead_code))]
pub struct Options {
    /// Scene file (.toml), mesh file, or built-in shape [default: what was seen last, at first a knot in a
    /// studio]
    #[arg(value_name = "SCENE|MESH|SHAPE")]
    input: Option<String>,
    /// Light: an image, or a sky spec such as sky:elevation=35
    #[arg(short, long, value_name = "FILE|SKY")]
    environment: Option<String>,
    /// Rotation of the light about +Y, degrees
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    rotate: Option<f64>,
    /// Reflectance of the mesh, such as ggx:alpha=0.2
    #[arg(short, long, value_name = "SPEC")]
    brdf: Option<String>,
    /// Technique
    #[arg(short, long, value_name = "SLUG")]
    technique: Option<String>,
    /// Exposure in stops (EV) before the tone mapper [default: automatic]
    #[arg(long, value_name = "EV", allow_negative_numbers = true)]
    exposure: Option<f32>,
    /// Tone mapper: linear, reinhard, aces, agx, neutral, …
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    tone_mapper: Option<ToneMapper>,
    /// Draw into a file instead of a window, by the same renderer; with {} in its name every frame of a turn,
    /// as .apng all of them
    #[arg(long, value_name = "OUT.png")]
    screenshot: Option<PathBuf>,
    /// Frames that are drawn; of one .png the last one is written
    #[arg(long, value_name = "N", default_value_t = 1, requires = "screenshot", value_parser = clap::value_parser!(u16).range(1..))]
    frames: u16,
    /// Size of the screenshot, pixels
    #[arg(long, value_name = "WxH", default_value = "1280x800", requires = "screenshot", value_parser = size)]
    size: (usize, usize),
}

#[cfg(not(feature = "view"))]
pub fn run(_: Options, _: &Context) -> Outcome {
    Err(Failure::failed("this build has no window: build with --features view"))
}

#[cfg(feature = "view")]
pub fn run(o: Options, context: &mut Context) -> Outcome {
    use serde_json::json;
    use steradian_session::{ANIMATION, Method, Session};
    use steradian_viewer::{Shot, Wish};

    let given = [&o.environment, &o.brdf, &o.technique].iter().any(|g| g.is_some())
        || o.rotate.is_some()
        || o.exposure.is_some()
        || o.tone_mapper.is_some();
    let mut wish = o.input.as_deref().map_or_else(Wish::default, Wish::of);
    if let Some(t) = &o.technique {
        wish.technique = Some(Method::find(t)?.slug().into());
    }
    wish.light = o.environment.or(wish.light);
    wish.brdf = o.brdf.or(wish.brdf);
    wish.turn = o.rotate.unwrap_or(wish.turn);
    wish.exposure = o.exposure.or(wish.exposure);
    if let Some(t) = o.tone_mapper {
        wish.tone_mapper = t.name().into();
    }
    let failed = |e: steradian_viewer::Error| match e {
        steradian_viewer::Error::Session(e) => Failure::from(e),
        steradian_viewer::Error::Window(why) => Failure::failed(why),
    };
    let Some(file) = o.screenshot else {
        let wish = (o.input.is_some() || given).then_some(wish);
        return steradian_viewer::run(wish, context.common.max_memory).map_err(failed);
    };
    context.check_output(&file, &["png", ANIMATION])?;
    let session = std::mem::take::<Session>(context);
    let shot = Shot { file, frames: o.frames.into(), size: [o.size.0, o.size.1] };
    let taken = steradian_viewer::shoot(session, &wish, &shot).map_err(failed)?;
    let ms = &taken.milliseconds;
    let least = ms.iter().copied().fold(f64::INFINITY, f64::min);
    if context.common.json {
        let name = shot.file.file_name().map(|n| n.to_string_lossy().into_owned());
        return context.print_json(json!({
            "output": name, "adapter": taken.adapter, "milliseconds": ms, "exposure": taken.frame.ev,
            "bytes": taken.frame.bytes, "command": taken.command,
        }));
    }
    let path = shot.file.display();
    context.say(format_args!("{path}: {} frames, {least:.0} ms at best on {}", ms.len(), taken.adapter));
    context.say(&taken.command);
    Ok(())
}
