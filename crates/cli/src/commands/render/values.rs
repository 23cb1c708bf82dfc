//! Values of options, as text.

use crate::inputs;
use steradian_render::scenefile::SceneBackground;
use steradian_render::{NormalFiltering, ToneMapper};

/// Exposure of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exposure {
    Auto,
    Ev(f32),
}

pub fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" { Ok(Exposure::Auto) } else { Ok(Exposure::Ev(inputs::finite(text)? as f32)) }
}

pub fn blur(text: &str) -> Result<f64, String> {
    let degrees = inputs::finite(text)?;
    if (0.0..=90.0).contains(&degrees) {
        Ok(degrees)
    } else {
        Err(format!("'{text}' is not 0 to 90 degrees"))
    }
}

pub fn size(text: &str) -> Result<(usize, usize), String> {
    let bad = || format!("'{text}' is not WIDTHxHEIGHT with sides of 1 to 32768 pixels");
    let (w, h) = text.split_once(['x', 'X', '×']).unwrap_or((text, text));
    let side = |s: &str| s.parse().ok().filter(|n| (1..=32768).contains(n)).ok_or_else(bad);
    Ok((side(w)?, side(h)?))
}

pub fn tone_mapper(text: &str) -> Result<ToneMapper, String> {
    let names = ToneMapper::ALL.map(ToneMapper::name);
    ToneMapper::from_name(text).ok_or_else(|| steradian_base::unknown("tone mapper", text, &names))
}

pub fn normal_filtering(text: &str) -> Result<NormalFiltering, String> {
    let names = NormalFiltering::ALL.map(|a| a.0);
    NormalFiltering::from_name(text)
        .ok_or_else(|| steradian_base::unknown("filtering of normals", text, &names))
}

pub fn background(text: &str) -> Result<SceneBackground, String> {
    match text {
        "environment" => Ok(SceneBackground::Environment(0.0)),
        "none" => Ok(SceneBackground::Colour([0.0; 3])),
        _ => {
            let c = inputs::vector(&text.replace('/', ","));
            c.map(|c| SceneBackground::Colour(c.map(|v| v as f32)))
                .map_err(|_| format!("'{text}' is not environment, none or R/G/B"))
        }
    }
}
