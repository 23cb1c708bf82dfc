//! Normals and horizons.

use super::links::Scatter;
use crate::local::FileName;
use crate::shared::surface::bumps::{self, Bumps, exact_facing, exact_frame};
use crate::shared::surface::texels::TextureLayers;
use crate::{BakeError, Material};
use glam::DVec3;
use std::sync::Arc;
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::SharedBrdf;
use steradian_relight::height::{Ellipses, HeightField, Horizons};
use steradian_scene::surface::Texture;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// The height map.
        pub height: Option<FileName> = bumps::HEIGHT_FILE,
        /// The normal map.
        pub normal: Option<FileName> = bumps::NORMAL_FILE,
        /// Height of white.
        pub relief: f64 = bumps::RELIEF,
        /// Form of the horizon, an index of the choices.
        pub shadow: usize = ParamInfo::choice("shadow", &["horizon", "ellipse", "none"], "what bumps hide of the light: the horizon at equal azimuths, one ellipse, or nothing").numbered(0.0),
        /// Azimuths of the horizon.
        pub azimuths: usize = ParamInfo::whole("azimuths", [4.0, 64.0], 16.0, "azimuths of shadow=horizon"),
        /// Angular radius of lights.
        pub width: f64 = ParamInfo::angle("width", [0.0, 45.0], 0.0, "angular radius of the lights, by which shadow=horizon softens"),
        /// Reflections from bump to bump.
        pub bounces: usize = ParamInfo::whole("bounces", [0.0, 4.0], 0.0, "reflections from bump to bump that reach the viewer, beside direct light"),
        /// Directions of the links.
        pub directions: usize = ParamInfo::whole("directions", [8.0, 256.0], 64.0, "directions along which bumps see each other, where there are bounces"),
    }
}

/// The horizon in the chosen form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// No horizon: nothing is hidden.
    Open,
    /// Elevations at this many azimuths, three a texture.
    Azimuths(usize),
    /// The five numbers of a conic, in two textures.
    Ellipse,
}

/// A bumpy surface.
pub struct Relief {
    pub brdf: SharedBrdf,
    pub bumps: Option<Bumps>,
    /// Mean normals.
    pub normals: TextureLayers,
    pub kept: Kept,
    pub horizons: TextureLayers,
    /// Angular radius of the lights, radians.
    pub width: f32,
    /// Links between bumps that see each other, where light is reflected between them.
    pub scatter: Option<Scatter>,
}

pub(super) fn bake(m: &Material, p: &Params, task: &Task) -> Result<Relief, BakeError> {
    let bumps = Bumps::of("bump_horizon", m, p.relief)?;
    let normals = match &bumps {
        Some(b) => Arc::new(b.map.mean().clone()),
        None => Arc::new(Texture::constant([0.0, 0.0, 1.0])),
    };
    let (kept, horizons) = match bumps.as_ref().and_then(|b| b.field.as_deref()) {
        Some(f) if p.shadow == 0 => (Kept::Azimuths(p.azimuths), azimuths(f, p.azimuths, task)?),
        Some(f) if p.shadow == 1 => (Kept::Ellipse, ellipses(f, task)?),
        _ => (Kept::Open, TextureLayers::new(Vec::new())),
    };
    let (width, normals) = (p.width.to_radians() as f32, TextureLayers::new(vec![normals]));
    let scatter = match bumps.as_ref().and_then(|b| b.field.as_deref()) {
        Some(f) if p.bounces > 0 => Scatter::new(f, &normals, [p.bounces, p.directions], task)?,
        _ => None,
    };
    Ok(Relief { brdf: m.brdf.clone(), bumps, normals, kept, horizons, width, scatter })
}

fn azimuths(f: &HeightField, count: usize, task: &Task) -> Result<TextureLayers, BakeError> {
    let go_on = || task.check().is_ok();
    let Some(h) = Horizons::new(f, count, &go_on) else {
        task.check()?;
        return Ok(TextureLayers::new(Vec::new()));
    };
    let texels = f.width() * f.height();
    let plane = |k: usize| (0..texels).map(|texel| h.sample(texel, k)).collect();
    let planes: Vec<Vec<f32>> = (0..count).map(plane).collect();
    Ok(TextureLayers::of_planes(f.width(), f.height(), &planes))
}

fn ellipses(f: &HeightField, task: &Task) -> Result<TextureLayers, BakeError> {
    let go_on = || task.check().is_ok();
    let Some(all) = Ellipses::new(f, &go_on) else {
        task.check()?;
        return Ok(TextureLayers::new(Vec::new()));
    };
    let planes: Vec<Vec<f32>> = (0..5).map(|k| all.0.iter().map(|e| e.0[k]).collect()).collect();
    Ok(TextureLayers::of_planes(f.width(), f.height(), &planes))
}

impl Relief {
    /// Texels a row and rows.
    pub(super) fn size(&self) -> (usize, usize) {
        match (self.kept, self.normals.size()) {
            // A flat normal map over heights.
            (Kept::Azimuths(_) | Kept::Ellipse, (1, 1)) => self.horizons.size(),
            (_, size) => size,
        }
    }

    /// Does a ray over the heights reach the light?
    pub(super) fn sees(&self, [i, j]: [usize; 2], wi: DVec3) -> bool {
        match self.bumps.as_ref().and_then(|b| b.field.as_deref()) {
            Some(f) if self.kept != Kept::Open => f.sees(i % f.width(), j % f.height(), wi),
            _ => true,
        }
    }

    /// The equation at a texel.
    pub(super) fn exact(&self, texel: [usize; 2], wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 || wo.z <= 0.0 || !self.sees(texel, wi) {
            return [0.0; 3];
        }
        let n = self.bumps.as_ref().map_or(DVec3::Z, |b| b.normal(texel));
        let n = exact_facing(n, wo);
        let [t, b] = exact_frame(n);
        let local = |w: DVec3| DVec3::new(w.dot(t), w.dot(b), w.dot(n)).normalize_or_zero();
        self.brdf.f_cos(local(wi), local(wo))
    }
}
