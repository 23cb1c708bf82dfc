//! Light beyond what a consumer, or the halves of its file, hold, and what is done about it.

use crate::profile::HALF;
use crate::{Engine, Files, Request};
use steradian_formats::TexelFormat;
use steradian_light::Lights;
use steradian_light::suns::{self, luminance};

/// What is done about light that does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remedy {
    /// The file has 32-bit floats instead of halves.
    Floats,
    /// Suns are lights of their own, and not in the file.
    SunsTakenOut,
    /// Nothing: it is clipped. No part of the light is a sun.
    Clipped,
}

impl Remedy {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Floats => "floats",
            Self::SunsTakenOut => "suns-taken-out",
            Self::Clipped => "clipped",
        }
    }
}

/// Light beyond what fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeyondRange {
    /// The largest radiance that fits, W sr⁻¹ m⁻².
    pub largest: f64,
    /// The largest radiance of the light.
    pub peak: f64,
    /// Part of the luminous flux of the light that does not fit.
    pub lost: f64,
    /// Part of the luminous flux that became lights of their own.
    pub taken: f64,
    /// What is done about it.
    pub remedy: Remedy,
}

/// Decides about light that does not fit, for consumers that filter by themselves: whose files are the light
/// as it is. Where 32-bit floats were asked for, the file is as it was asked for. Takes suns out of `lights`,
/// and writes them and the format of the file into `request`.
pub(crate) fn settle(engine: &Engine, request: &mut Request, lights: &mut Lights) -> Option<BeyondRange> {
    let Files::LatLong { half, .. } = engine.files else { return None };
    if request.engine.is_none() || request.format == Some(TexelFormat::Rgba32f) {
        return None;
    }
    let largest = if half { engine.largest.min(HALF) } else { engine.largest };
    let peak = peak(lights);
    if peak <= largest {
        return None;
    }
    let lost = share_beyond(lights, largest);
    let mut beyond = BeyondRange { largest, peak, lost, taken: 0.0, remedy: Remedy::Clipped };
    if engine.largest > HALF {
        // The consumer keeps what the file holds. A format that was asked for stays.
        if request.format.is_none() {
            request.format = Some(TexelFormat::Rgba32f);
            beyond.remedy = Remedy::Floats;
        }
        return Some(beyond);
    }
    let taken = suns::take(lights);
    if !taken.suns.is_empty() {
        beyond.taken = taken.shares.iter().sum();
        beyond.remedy = Remedy::SunsTakenOut;
        request.suns.extend(taken.suns);
    }
    Some(beyond)
}

/// The largest radiance.
fn peak(lights: &Lights) -> f64 {
    let texels = lights.environment.iter().flat_map(|e| &e.image.planes).flatten().copied();
    let disks = lights.disks.iter().flat_map(|d| d.radiance);
    texels.map(f64::from).chain(disks).fold(0.0, f64::max)
}

/// The part of the luminous flux that is lost where radiance is clipped to `most`.
fn share_beyond(lights: &Lights, most: f64) -> f64 {
    let (mut whole, mut kept) = (0.0, 0.0);
    if let Some(e) = &lights.environment {
        whole += luminance(e.image.integral());
        let mut clipped = e.image.clone();
        clipped.planes.iter_mut().flatten().for_each(|v| *v = v.min(most as f32));
        kept += luminance(clipped.integral());
    }
    for d in &lights.disks {
        whole += luminance(d.radiance) * d.solid_angle();
        kept += luminance(d.radiance.map(|l| l.min(most))) * d.solid_angle();
    }
    if whole > 0.0 { (whole - kept) / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use std::path::PathBuf;
    use std::sync::Arc;
    use steradian_light::Environment;
    use steradian_sphere::{Layout, SphereImage};

    /// A grey sky with a round sun of two degrees across about a direction.
    fn sunny(sun: f32) -> Lights {
        let towards = DVec3::new(0.48, 0.6, 0.64);
        let image = SphereImage::from_fn(Layout::LatLong, 256, 128, |d| {
            [if d.angle_between(towards) < 0.02 { sun } else { 1.0 }; 3]
        });
        Lights { environment: Some(Arc::new(Environment { image })), ..Lights::default() }
    }

    fn settled(name: &str, format: Option<TexelFormat>, sun: f32) -> (Option<BeyondRange>, Request, Lights) {
        let engine = Engine::find(name).expect("known");
        let mut request = Request::of(engine, PathBuf::from("out"), "x");
        request.format = format;
        let mut lights = sunny(sun);
        let beyond = settle(engine, &mut request, &mut lights);
        (beyond, request, lights)
    }

    #[test]
    fn suns_that_halves_clip_are_kept_by_floats_or_become_lights() {
        let before = peak(&sunny(2e5));
        let (beyond, request, lights) = settled("blender", None, 2e5);
        let b = beyond.expect("clipped");
        assert_eq!((b.remedy, request.format), (Remedy::Floats, Some(TexelFormat::Rgba32f)));
        assert_eq!((peak(&lights), b.peak), (before, before));
        // A sun of radiance L in a sky of 1 loses (L − 65504) Ω of L Ω + 4π − Ω.
        let omega = {
            let i = sunny(2.0).environment.expect("image").image.integral()[0];
            i - 4.0 * std::f64::consts::PI
        };
        let want = (2e5 - HALF) * omega / (2e5 * omega + 4.0 * std::f64::consts::PI - omega);
        assert!((b.lost / want - 1.0).abs() < 1e-4, "{} {want}", b.lost);
        for name in ["godot", "unity", "unreal"] {
            let (beyond, request, lights) = settled(name, None, 2e5);
            let b = beyond.expect("clipped");
            assert_eq!((b.remedy, request.format), (Remedy::SunsTakenOut, None), "{name}");
            let [sun] = request.suns[..] else { panic!("{name}: one sun") };
            assert!(sun.direction.angle_between(DVec3::new(0.48, 0.6, 0.64)) < 2e-3, "{name}");
            assert!(peak(&lights) < 2.0 && b.taken > 0.9, "{name}: {} {}", peak(&lights), b.taken);
        }
        // PlayCanvas's own texels end at 64.
        assert_eq!(settled("playcanvas", None, 2e3).0.map(|b| b.remedy), Some(Remedy::SunsTakenOut));
    }

    #[test]
    fn what_fits_and_what_was_asked_for_stays() {
        assert_eq!(settled("godot", None, 6e4).0, None);
        assert_eq!(settled("godot", Some(TexelFormat::Rgba32f), 2e5).0, None);
        // Levels of a chain are filtered: their format's loss is told where they are written.
        assert_eq!(settled("bevy", None, 2e5).0, None);
        let (beyond, request, _) = settled("blender", Some(TexelFormat::Rgba16f), 2e5);
        assert_eq!(beyond.map(|b| b.remedy), Some(Remedy::Clipped));
        assert_eq!(request.format, Some(TexelFormat::Rgba16f));
    }
}
