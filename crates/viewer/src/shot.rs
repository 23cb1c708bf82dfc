//! Pictures without a window, by the same bakes and the same renderer.

use crate::{Baker, DisplayMode, Error, Frame, Orbit, Painter, View, Wish};
use std::path::{Path, PathBuf};
use steradian_render::{Display, ToneMapper};
use steradian_session::{FRAME_RATE, Session, is_animation};

/// What is written.
#[derive(Debug, Clone)]
pub struct Shot {
    /// The file. With `{}` in its name, every frame is written; .apng is an animation.
    pub file: PathBuf,
    /// Frames of a full turn of the camera. Where the file is one PNG the same view is drawn as often, and
    /// the last one written.
    pub frames: usize,
    /// Pixels.
    pub size: [usize; 2],
}

/// A picture that was written.
pub struct Taken {
    /// How it was drawn.
    pub frame: Frame,
    /// The adapter.
    pub adapter: String,
    /// Milliseconds of each frame, drawn and developed.
    pub milliseconds: Vec<f64>,
    /// The command line that makes the same picture.
    pub command: String,
}

/// Draws a wish without a window and writes it.
pub fn shoot(session: Session, wish: &Wish, shot: &Shot) -> Result<Taken, Error> {
    let task = session.task.clone();
    let mut painter = Painter::open()?;
    let mut baker = Baker::new(session);
    let live = baker.bake(wish, task.clone())?;
    let mut wish = wish.clone();
    let mut orbit = wish.orbit.unwrap_or_else(|| Orbit::of(&live.camera()));
    wish.orbit = Some(orbit);
    let each = shot.file.file_name().is_some_and(|n| n.to_string_lossy().contains("{}"));
    let animated = is_animation(&shot.file);
    let mut shown = Vec::new();
    let mut milliseconds = Vec::new();
    let mut last = None;
    let mut exposure = wish.exposure;
    for k in 0..shot.frames.max(1) {
        let view = View {
            sides: vec![live.clone()],
            camera: orbit.camera(),
            turn: wish.turn,
            size: shot.size,
            exposure,
            mapper: ToneMapper::from_name(&wish.tone_mapper).unwrap_or_default(),
            mode: DisplayMode::Picture,
            truth: None,
            still: true,
            sky: None,
        };
        task.check().map_err(steradian_session::Error::from)?;
        let frame = painter.paint(&view)?;
        exposure = Some(frame.ev);
        milliseconds.push(frame.draw_ms + frame.develop_ms);
        if animated {
            shown.push(frame.pictures[0].clone());
        } else if each {
            let name = shot.file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            let file = shot.file.with_file_name(name.replacen("{}", &format!("{k:04}"), 1));
            write(&baker, &file, &frame.pictures[0])?;
        }
        if each || animated {
            orbit.turn(std::f32::consts::TAU / shot.frames.max(1) as f32, 0.0);
        }
        last = Some(frame);
    }
    let Some(frame) = last else { return Err(Error::Window("no frame was drawn".into())) };
    if animated {
        baker.session().write_animation(&shot.file, &shown, FRAME_RATE)?;
    } else if !each {
        write(&baker, &shot.file, &frame.pictures[0])?;
    }
    let command = wish.command(shot.size, frame.ev);
    Ok(Taken { adapter: painter.describe(), command, milliseconds, frame })
}

/// Writes a picture as PNG, whole or not at all.
fn write(baker: &Baker, file: &Path, picture: &Display) -> Result<(), Error> {
    Ok(baker.session().write_display(file, picture, Vec::new())?)
}
