//! Light beyond what a consumer, or the halves of its file, hold, and what is done about it.

use crate::companions::has_panorama;
use crate::profile::HALF;
use crate::{Engine, Files, Filtered, Level, Plan, Request};
use steradian_base::{Cancelled, Task};
use steradian_formats::packed::MAX_RGBD;
use steradian_formats::{Container, TexelFormat};
use steradian_light::adjust::share_beyond;
use steradian_light::{Lights, suns};
use steradian_prefilter::Sampled;
use steradian_sphere::Layout;

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
    /// The largest radiance that would be written: that of the light at the size of the map.
    pub peak: f64,
    /// Part of the luminous flux of the light that would not fit.
    pub lost: f64,
    /// Part of the luminous flux that became lights of their own.
    pub taken: f64,
    /// Part of the luminous flux that does not fit in spite of the remedy.
    pub left: f64,
    /// What is done about it.
    pub remedy: Remedy,
}

/// Part of the light below which suns stay in the map: what is lost is less than an eye sees, and without
/// them far more would have to come from lights beside the map.
const NEGLIGIBLE: f64 = 1e-3;

/// Decides about light that does not fit into an engine's files, or that the engine does not keep. Only maps
/// of the light as it is, such as the first level of a chain, are as bright as it; so it is measured in
/// these, at the size that was asked for. Where 32-bit floats were asked for, the file is as it was asked
/// for. Takes suns out of `lights`, and writes them and the format of the file into `request`.
pub(crate) fn settle(
    plan: &Plan,
    request: &mut Request,
    lights: &mut Lights,
    task: &Task,
) -> Result<Option<BeyondRange>, Cancelled> {
    let engine = plan.engine;
    if request.engine.is_none() || request.format == Some(TexelFormat::Rgba32f) {
        return Ok(None);
    }
    let limits = Limits::of(plan, request).kept_by(engine);
    let largest = limits.map.min(limits.panorama);
    // No texel of a map is brighter than the light.
    if brightest(lights) <= largest {
        return Ok(None);
    }
    let (peak, lost) = beyond(plan, limits, lights, task)?;
    if lost == 0.0 {
        return Ok(None);
    }
    let mut found = BeyondRange { largest, peak, lost, taken: 0.0, left: lost, remedy: Remedy::Clipped };
    if engine.floats {
        // A format that was asked for stays.
        if request.format.is_none() {
            request.format = Some(TexelFormat::Rgba32f);
            (found.remedy, found.left) = (Remedy::Floats, 0.0);
        }
        return Ok(Some(found));
    }
    if lost < NEGLIGIBLE {
        return Ok(None);
    }
    let taken = suns::take(lights);
    if !taken.suns.is_empty() {
        found.taken = taken.shares.iter().sum();
        found.remedy = Remedy::SunsTakenOut;
        // Of what is left, as a part of the whole.
        found.left = beyond(plan, limits, lights, task)?.1 * (1.0 - found.taken);
        request.suns.extend(taken.suns);
    }
    Ok(Some(found))
}

/// The largest radiances that the files of a request hold.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// The map that was asked for, and what lies beside it in its format.
    map: f64,
    /// The lat-long image beside a cube.
    panorama: f64,
}

impl Limits {
    fn of(plan: &Plan, request: &Request) -> Self {
        let texels = plan.with_format(request).format.largest().map_or(f64::INFINITY, f64::from);
        let floats = request.format == Some(TexelFormat::Rgba32f);
        // Images are of 32-bit floats, or of exponents that are large enough.
        let map = match (request.engine.map(|e| e.files), Container::of_name(&request.output)) {
            (None, None) => f64::INFINITY,
            (None, Some(_)) => texels,
            (Some(Files::Gltf), _) => MAX_RGBD.into(),
            (Some(Files::LatLong { half, cube: None, .. }), _) if half && !floats => HALF,
            (Some(Files::LatLong { cube: None, .. }), _) => f64::INFINITY,
            _ => texels,
        };
        Self { map, panorama: f64::INFINITY }
    }

    /// What is left of it where the engine keeps less.
    fn kept_by(self, engine: &Engine) -> Self {
        Self { map: self.map.min(engine.largest), panorama: self.panorama.min(engine.largest) }
    }
}

impl Filtered {
    /// The largest part of a map's luminous flux that the format of its texels clips.
    pub fn share_lost(&self) -> f64 {
        let limits = Limits::of(&self.plan, &self.request);
        let lost = |most: f64, l: &Level| share_beyond(&l.filtered.image, most);
        let beside = self
            .companions
            .maps()
            .map(|(name, l)| lost(if name == "panorama" { limits.panorama } else { limits.map }, l));
        self.levels.iter().map(|l| lost(limits.map, l)).chain(beside).fold(0.0, f64::max)
    }
}

/// The largest radiance, and the part of the luminous flux that does not fit, of the light as the maps of a
/// plan would hold it.
fn beyond(plan: &Plan, limits: Limits, lights: &Lights, task: &Task) -> Result<(f64, f64), Cancelled> {
    // Without kernels next to nothing is analysed.
    let light = Sampled::of(lights.clone(), &[], 1.0, task)?;
    let own = (light.image.width, light.image.height);
    let size = if plan.size.0 == 0 { own } else { plan.size };
    let of = |layout, (w, h), most| {
        let map = light.mirror(layout, w, h);
        let peak = map.planes.iter().flatten().copied().fold(0.0, f32::max);
        (f64::from(peak), share_beyond(&map, most))
    };
    let mut found = of(plan.layout, size, limits.map);
    if has_panorama(plan.engine) {
        let beside = of(Layout::LatLong, own, limits.panorama);
        found = (found.0.max(beside.0), found.1.max(beside.1));
    }
    Ok(found)
}

/// The largest radiance.
fn brightest(lights: &Lights) -> f64 {
    let texels = lights.environment.iter().flat_map(|e| &e.image.planes).flatten().copied();
    let disks = lights.disks.iter().flat_map(|d| d.radiance);
    // A directional light is as bright as the texel that it falls into is small.
    let directionals = if lights.directionals.is_empty() { 0.0 } else { f64::INFINITY };
    texels.map(f64::from).chain(disks).fold(directionals, f64::max)
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

    fn settled(
        name: &str,
        change: impl Fn(&mut Request),
        mut lights: Lights,
    ) -> (Option<BeyondRange>, Request, Lights) {
        let engine = Engine::find(name).expect("known");
        let mut request = Request::of(engine, PathBuf::from("out"), "x");
        change(&mut request);
        let plan = request.plan(u64::MAX).expect("a plan");
        let found = settle(&plan, &mut request, &mut lights, &Task::quiet()).expect("not cancelled");
        (found, request, lights)
    }

    fn usual(_: &mut Request) {}

    #[test]
    fn suns_that_halves_clip_are_kept_by_floats_or_become_lights() {
        let light = || sunny(2e5);
        let (found, request, lights) = settled("blender", usual, light());
        let b = found.expect("clipped");
        assert_eq!((b.remedy, request.format), (Remedy::Floats, Some(TexelFormat::Rgba32f)));
        assert_eq!((brightest(&lights), b.peak, b.left), (2e5, 2e5, 0.0));
        // A sun of radiance L in a sky of 1 loses (L − 65504) Ω of L Ω + 4π − Ω.
        let omega = {
            let i = sunny(2.0).environment.expect("image").image.integral()[0];
            i - 4.0 * std::f64::consts::PI
        };
        let want = (2e5 - HALF) * omega / (2e5 * omega + 4.0 * std::f64::consts::PI - omega);
        assert!((b.lost / want - 1.0).abs() < 1e-4, "{} {want}", b.lost);
        for name in ["godot", "unity", "unreal"] {
            let (found, request, lights) = settled(name, usual, light());
            let b = found.expect("clipped");
            assert_eq!((b.remedy, request.format), (Remedy::SunsTakenOut, None), "{name}");
            let [sun] = request.suns[..] else { panic!("{name}: one sun") };
            assert!(sun.direction.angle_between(DVec3::new(0.48, 0.6, 0.64)) < 2e-3, "{name}");
            assert!(brightest(&lights) < 2.0 && b.taken > 0.9, "{name}: {} {}", brightest(&lights), b.taken);
            assert_eq!(b.left, 0.0, "{name}");
        }
        // PlayCanvas's own texels end at 64.
        let (found, ..) = settled("playcanvas", usual, sunny(2e3));
        assert_eq!(found.map(|b| b.remedy), Some(Remedy::SunsTakenOut));
    }

    /// Cubes whose texels are halves, shared exponents, short floats or bytes.
    #[test]
    fn chains_hold_their_suns_or_lose_them_to_lights() {
        for (name, remedy, largest) in [
            ("three", Remedy::Floats, HALF),
            ("babylon", Remedy::Floats, HALF),
            ("khronos", Remedy::Floats, HALF),
            ("bevy", Remedy::SunsTakenOut, 65408.0),
            ("filament", Remedy::SunsTakenOut, 64512.0),
            ("gltf", Remedy::SunsTakenOut, 255.0),
        ] {
            let (found, request, _) = settled(name, usual, sunny(2e5));
            let b = found.expect("clipped");
            assert_eq!((b.remedy, b.largest), (remedy, largest), "{name}");
            assert!(b.lost > 0.3 && b.peak > 1.5e5 && b.left < 1e-3, "{name}: {b:?}");
            assert_eq!(request.suns.len(), usize::from(remedy == Remedy::SunsTakenOut), "{name}");
        }
        assert_eq!(settled("raw", usual, sunny(2e5)).0, None);
    }

    /// A sun of one texel of 512 x 256 that halves clip fits once it is shared among four times as many.
    #[test]
    fn what_counts_is_what_would_be_written() {
        let light = || {
            let mut image = SphereImage::new(Layout::LatLong, 512, 256);
            image.planes.iter_mut().for_each(|p| p.fill(1.0));
            image.planes.iter_mut().for_each(|p| p[512 * 100 + 77] = 1.5e5);
            Lights { environment: Some(Arc::new(Environment { image })), ..Lights::default() }
        };
        let (found, ..) = settled("godot", usual, light());
        assert_eq!(found.map(|b| b.remedy), Some(Remedy::SunsTakenOut));
        for (name, size) in
            [("godot", (256, 128)), ("unity", (256, 128)), ("blender", (256, 128)), ("bevy", (32, 32))]
        {
            let (found, request, lights) = settled(name, |r| r.size = Some(size), light());
            assert_eq!((found, request.format, request.suns.len()), (None, None, 0), "{name}");
            assert_eq!(brightest(&lights), 1.5e5, "{name}");
        }
        // Too little is lost for a sun to be taken out.
        let slightly = || {
            let mut lights = light();
            lights.adjust(0.0, 65_600.0 / 1.5e5);
            lights
        };
        assert_eq!(settled("godot", usual, slightly()).0, None);
        assert_eq!(settled("blender", usual, slightly()).0.map(|b| b.remedy), Some(Remedy::Floats));
    }

    #[test]
    fn what_fits_and_what_was_asked_for_stays() {
        let floats = |r: &mut Request| r.format = Some(TexelFormat::Rgba32f);
        let halves = |r: &mut Request| r.format = Some(TexelFormat::Rgba16f);
        assert_eq!(settled("godot", usual, sunny(6e4)).0, None);
        assert_eq!(settled("bevy", usual, sunny(6e4)).0, None);
        for name in ["godot", "bevy"] {
            assert_eq!(settled(name, floats, sunny(2e5)).0, None, "{name}");
        }
        for name in ["blender", "three"] {
            let (found, request, _) = settled(name, halves, sunny(2e5));
            let b = found.expect("clipped");
            assert_eq!((b.remedy, b.left), (Remedy::Clipped, b.lost), "{name}");
            assert_eq!(request.format, Some(TexelFormat::Rgba16f), "{name}");
        }
    }
}
