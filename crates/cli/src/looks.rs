//! Materials whose technique the user may have left open: then the registry's Cards and certificates choose.

use crate::context::{Backend, Context};
use crate::failure::Failure;
use crate::inputs::Method;
use crate::studio::{self, Baked, Look};
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_brdf::{Brdf, SharedBrdf};
use steradian_light::Lights;
use steradian_render::{Maps, Surface, Texture};
use steradian_scene::Camera;
use steradian_techniques::Card;

/// A material as asked for.
#[derive(Clone)]
pub struct Wanted {
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// Technique or reference; `None` leaves the choice to the certificates.
    pub method: Option<Method>,
    /// Parameters of the technique.
    pub params: ParamValues,
    /// Multiplies the net reflectance.
    pub texture: Option<Arc<Texture>>,
    /// Normals and roughness that vary.
    pub maps: Maps,
}

/// Rooms that are baked to choose among, unless the first ones miss the tolerance.
const CANDIDATES: usize = 3;
/// An error that no picture shows: the first room to reach it is taken.
const INVISIBLE: f64 = 5e-3;
/// Rooms of a larger error need a specimen like the material, where no tolerance is given.
const USEFUL: f64 = 0.25;
/// An error from which on the reference is worth a hint.
const VISIBLE: f64 = 0.05;

impl Wanted {
    /// The material with a technique.
    pub fn with(&self, method: Method) -> Look {
        Look {
            brdf: self.brdf.clone(),
            method,
            params: self.params.clone(),
            texture: self.texture.clone(),
            maps: self.maps.clone(),
        }
    }

    /// Are both the same but for their textures?
    fn shades_like(&self, other: &Look) -> bool {
        self.brdf.spec() == other.brdf.spec()
            && self.params == other.params
            && self.maps.is_empty() == other.maps.is_empty()
            && self.method.as_ref().is_none_or(|m| m.slug() == other.method.slug())
    }
}

/// Bakes every material; those that differ in their textures only share a bake.
pub fn bake(
    wanted: &[Wanted],
    lights: &Lights,
    camera: &Camera,
    tolerance: Option<f64>,
    context: &Context,
) -> Result<Vec<(Look, Baked)>, Failure> {
    let mut out: Vec<(Look, Baked)> = Vec::new();
    for w in wanted {
        let done = out.iter().find(|(look, _)| w.shades_like(look));
        let next = match (done, &w.method) {
            (Some((look, baked)), _) => {
                (w.with(look.method.clone()), shared(baked, w.texture.clone(), w.maps.clone()))
            }
            (None, Some(method)) => {
                let look = w.with(method.clone());
                let baked = studio::bake(&look, lights, camera, tolerance, context)?;
                (look, baked)
            }
            (None, None) => choose(w, lights, camera, tolerance, context)?,
        };
        say_left_out((&next.0, &next.1), context);
        out.push(next);
    }
    Ok(out)
}

/// Says what of a surface's maps its technique leaves out.
pub fn say_left_out((look, baked): (&Look, &Baked), context: &Context) {
    let mut left_out = baked.varies.left_out(look.maps.alpha2.is_some(), look.maps.filters());
    if baked.lit && !look.maps.is_empty() {
        left_out.push("its maps, but for the mean normal, under lights that no environment holds");
    }
    if !left_out.is_empty() {
        context.say(format_args!("{} leaves out {}", look.method.slug(), left_out.join(" and ")));
    }
}

/// The same bake under other textures; it costs nothing.
pub fn shared(b: &Baked, base_colour: Option<Arc<Texture>>, maps: Maps) -> Baked {
    Baked {
        surface: Surface { shader: b.surface.shader.clone(), base_colour, maps },
        certificate: b.certificate.clone(),
        judge: b.judge.clone(),
        varies: b.varies,
        lit: b.lit,
        #[cfg(feature = "gpu")]
        bake: b.bake.clone(),
        #[cfg(feature = "gpu")]
        direct: b.direct.clone(),
        bytes: 0,
        seconds: 0.0,
    }
}

/// Without a tolerance the room of the smallest certified error, with one the smallest of those that meet it; else
/// the reference.
fn choose(
    w: &Wanted,
    lights: &Lights,
    camera: &Camera,
    tolerance: Option<f64>,
    context: &Context,
) -> Result<(Look, Baked), Failure> {
    let fits = |card: &Card, error: f64| match tolerance {
        Some(t) => error <= t,
        None => error <= USEFUL || stands_for(card, &*w.brdf),
    };
    let mut fit: Vec<(Look, Baked)> = Vec::new();
    let mut tried = 0;
    for t in steradian_techniques::registry() {
        let card = t.card();
        if card.needs.sites || (card.materials)(&*w.brdf).is_err() {
            continue;
        }
        let good_enough = tolerance.is_none() && fit.iter().any(|f| f.1.error() <= INVISIBLE);
        if good_enough || (tried >= CANDIDATES && !fit.is_empty()) {
            break;
        }
        let look = w.with(Method::Technique(*t));
        match studio::bake(&look, lights, camera, tolerance, context) {
            Ok(baked) if fits(card, baked.error()) => fit.push((look, baked)),
            Ok(_) => {}
            Err(f) if f.code == 2 => {} // these lights or parameters are not for it
            Err(f) => return Err(f),
        }
        tried += 1;
    }
    let cost = |b: &Baked| if tolerance.is_some() { b.bytes as f64 } else { b.error() };
    if let Some((look, baked)) = fit.into_iter().min_by(|a, b| cost(&a.1).total_cmp(&cost(&b.1))) {
        let (slug, error, known) = (look.method.slug(), baked.error(), baked.known());
        let spec = w.brdf.spec();
        let hint = if error > VISIBLE { "; --technique reference is exact, and slow" } else { "" };
        context.say(format_args!(
            "technique {slug} for {spec}: relative RMS error {:.2} % ({known}){hint}",
            100.0 * error
        ));
        return Ok((look, baked));
    }
    reference(w, lights, camera, tolerance, context)
}

/// Is one of the room's specimens of the same model, and as isotropic? Otherwise the room takes the material as
/// something else, a mirror for example.
fn stands_for(card: &Card, brdf: &dyn Brdf) -> bool {
    let like = |b: &dyn Brdf| b.info().name == brdf.info().name && b.is_isotropic() == brdf.is_isotropic();
    card.specimens.iter().any(|s| steradian_brdf::parse(s).is_ok_and(|b| like(&*b)))
}

fn reference(
    w: &Wanted,
    lights: &Lights,
    camera: &Camera,
    tolerance: Option<f64>,
    context: &Context,
) -> Result<(Look, Baked), Failure> {
    let spec = w.brdf.spec();
    let why = match tolerance {
        Some(t) => format!("no technique takes {spec} to an error of {t}"),
        None => format!("no technique is made for {spec}"),
    };
    if context.common.backend == Backend::Gpu {
        return Err(Failure::usage(format!(
            "{why}: name a technique, or use --backend cpu for the reference"
        )));
    }
    context.say(format_args!("{why}: the reference computes every point, which takes longer"));
    let look = w.with(Method::Reference);
    let baked = studio::bake(&look, lights, camera, tolerance, context)?;
    Ok((look, baked))
}
