//! Shadows of bumps on each other, and light from bump to bump, for techniques whose data differ from texel
//! to texel: compared with the path tracer's photographs of the surface that the data describe.

use super::trials::{Outcome, difference};
use super::{MATTE, Plan, takes};
use crate::btf::{Pattern, Shape, Surface};
use crate::{Error, Session};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_brdf::parse;
use steradian_light::DirectionalLight;
use steradian_relight::btf::Btf;
use steradian_relight::polynomial::{Channels, Fit, FitError, Photographs};
use steradian_scene::surface::{Planes, Texture};
use steradian_techniques::local::{AnyLocal, Content, LocalFrame, LocalLights};
use steradian_techniques::{Material, PointsBuf, Radiance, View, find_local};

/// Texels a side of sixteen half balls.
const SIDE: usize = 32;
/// Their height over the width, which is their radius, 0.42 of a quarter, but for 5 %: slopes are up to the
/// vertical, and balls both shadow the plane and light it.
const RELIEF: f64 = 0.1;
/// Views of the photographs from which maps are made: the normal and six on a spiral down to 75°.
const VIEWS: usize = 7;
/// Lights of these photographs: four for each of the six numbers of a polynomial.
const LIGHTS: usize = 25;
/// Lights of the photographs used for comparison, which differ from those of the maps except for the one
/// along the normal.
const TRIED: usize = 6;
/// Scattering events where light is reflected from bump to bump: direct light and two reflections more. Each
/// further event lengthens all paths by one.
const EVENTS: u32 = 3;
/// Paths of a texel and light: the comparison is a mean over 1024 texels and six lights, 98,304 paths.
const SAMPLES: u32 = 16;
/// Photographs with shadows alone, and with light from bump to bump.
const KINDS: [u32; 2] = [1, EVENTS];

/// Photographs of one surface, of the two [`KINDS`].
pub(super) struct Bumps {
    /// Photographs from which maps are made.
    known: [Arc<Btf>; 2],
    /// Photographs along the normal with which techniques are compared.
    truth: [Btf; 2],
}

impl Session {
    /// The photographs.
    fn bumps(&mut self) -> Result<Bumps, Error> {
        let mut kind = |bounces: u32, views: usize, lights: usize| {
            let surface = Surface {
                shape: Shape::Pattern(Pattern::Hemispheres, SIDE),
                relief: RELIEF,
                brdf: parse(MATTE)?,
                base_colour: None,
                views,
                lights,
                bounces,
                samples: SAMPLES,
                seed: 1,
                format: "exr",
            };
            self.photographed(&surface)
        };
        let [direct, scattered] = KINDS;
        Ok(Bumps {
            known: [Arc::new(kind(direct, VIEWS, LIGHTS)?), Arc::new(kind(scattered, VIEWS, LIGHTS)?)],
            truth: [kind(direct, 1, TRIED + 1)?, kind(scattered, 1, TRIED + 1)?],
        })
    }

    /// Shadows and light between bumps: does either bring a technique nearer to the photographs? `None` where
    /// it claims neither, or has data of a mesh.
    pub(super) fn shadows_of_bumps(
        &mut self,
        plan: &Plan,
        t: &'static dyn AnyLocal,
        photographs: &mut Option<Bumps>,
    ) -> Result<Option<[Outcome; 2]>, Error> {
        let card = t.card();
        let claims = card.capabilities.self_shadowing && card.capabilities.interreflections;
        if !plan.has(card) || !claims || super::scatters(t) || !takes(card, MATTE) {
            return Ok(None);
        }
        let bumps = match photographs {
            Some(known) => known,
            None => photographs.insert(self.bumps()?),
        };
        let heights = find_local("bump_horizon").ok_or_else(|| Error::failed("bump_horizon is missing"))?;
        // A map holds photographs with or without light between bumps; techniques with heights take a
        // parameter for it.
        let params =
            |bounces: u32| [("relief", RELIEF), ("bounces", f64::from(bounces))].into_iter().collect();
        let mut bare: ParamValues = params(0);
        bare.0.insert("shadow".into(), "none".into());
        let off = |t: &dyn AnyLocal, made_of: usize, values: &ParamValues, against: usize, task: &Task| {
            let found = bumps.shaded(t, bumps.material(t, made_of)?, values, task)?;
            Ok::<f64, Error>(100.0 * difference(&found, &bumps.seen(against)))
        };
        let own = |kind: usize| match t.card().slug == heights.card().slug {
            true => params(KINDS[kind] - 1),
            false => ParamValues::default(),
        };
        let task = &self.task;
        let without = off(heights, 0, &bare, 0, task)?;
        let shadowed = off(t, 0, &own(0), 0, task)?;
        let [direct, scattered] = [off(t, 0, &own(0), 1, task)?, off(t, 1, &own(1), 1, task)?];
        let held = |without: f64, with: f64| {
            let text = format!("on half balls {without:.1} % off photographs without, {with:.1} % with");
            if with < without { Outcome::Holds(text) } else { Outcome::Fails(text) }
        };
        Ok(Some([held(without, shadowed), held(direct, scattered)]))
    }
}

impl Bumps {
    /// The reflectance with the contents of a technique's parameters, from photographs of a kind.
    fn material(&self, t: &dyn AnyLocal, kind: usize) -> Result<Material, Error> {
        let mut planes = Planes::default();
        let mut apparent = None;
        for plane in t.planes() {
            match plane.content {
                Content::Heights => planes = planes.with(plane.name, texture(|k| [heights()[k]; 3])?),
                Content::Polynomials => {
                    let all = polynomials(&self.known[kind]).map_err(Error::failed)?;
                    for k in 0..all[0][0].len() {
                        let term = texture(|texel| [0, 1, 2].map(|c| all[c][texel][k]))?;
                        planes = planes.with(&format!("{}.{k}", plane.name), term);
                    }
                }
                Content::Bidirectional => apparent = Some(self.known[kind].clone()),
                _ => {}
            }
        }
        let material = Material::new(parse(MATTE)?).with_textures(planes);
        Ok(match apparent {
            Some(btf) => material.with_apparent(btf),
            None => material,
        })
    }

    /// Mean of the photographs under each light that is tried, white being 1.
    fn seen(&self, kind: usize) -> Vec<[f64; 3]> {
        let truth = &self.truth[kind];
        let texels = |l: usize| (0..truth.texels()).map(move |k| truth.value(k, 0, l).map(f64::from));
        (1..=TRIED).flat_map(texels).collect()
    }

    /// The same mean by a technique on a plane.
    fn shaded(
        &self,
        t: &dyn AnyLocal,
        material: Material,
        params: &ParamValues,
        task: &Task,
    ) -> Result<Vec<[f64; 3]>, Error> {
        let bake = t.bake(&material, None, params, task)?;
        let mut q = PointsBuf::default();
        for k in 0..SIDE * SIDE {
            let at = |x: usize| (x as f32 + 0.5) / SIDE as f32;
            q.push(Vec3::Z, Vec3::X, Vec3::Z, Vec3::ZERO);
            q.locate(Vec2::new(at(k % SIDE), at(k / SIDE)), [0; 3], [0.0; 2]);
        }
        let mut out = Vec::new();
        for l in &self.truth[0].lights()[1..] {
            let lights = LocalLights {
                directionals: vec![DirectionalLight { direction: *l, irradiance: [PI; 3] }],
                points: Vec::new(),
            };
            let (view, mesh, shadowed) = (&View::default(), None, false);
            let frame = LocalFrame { lights: &lights, view, mesh, shadowed };
            let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
            bake.lit(&frame)?.add(None, &q.as_points(), &mut Radiance::of(&mut rgb));
            out.extend((0..q.len()).map(|i| [0, 1, 2].map(|c| f64::from(rgb[c][i]))));
        }
        Ok(out)
    }
}

fn heights() -> Vec<f32> {
    Pattern::Hemispheres.heights(SIDE)
}

fn texture(of: impl Fn(usize) -> [f32; 3]) -> Result<Arc<Texture>, Error> {
    let all: Vec<[f32; 3]> = (0..SIDE * SIDE).map(of).collect();
    let planes = [0, 1, 2].map(|c| all.iter().map(|x| x[c]).collect::<Vec<f32>>());
    Texture::new(SIDE, SIDE, &planes).map(Arc::new).ok_or_else(|| Error::failed("a texture is empty"))
}

/// For each channel, the six polynomial coefficients of each texel, fitted to the photographs along the
/// normal; white is 1.
fn polynomials(btf: &Btf) -> Result<[Vec<[f32; 6]>; 3], FitError> {
    const WHITE: f32 = 255.0;
    let lights: &[DVec3] = btf.lights();
    let fit = Fit::<6>::new(lights)?;
    let mut sums = Photographs::new(&fit, Channels::Colour, btf.texels());
    for l in 0..lights.len() {
        let planes =
            [0, 1, 2].map(|c| (0..btf.texels()).map(|k| btf.value(k, 0, l)[c]).collect::<Vec<f32>>());
        sums.add(planes.each_ref().map(|p| &p[..]))?;
    }
    let all = sums.finish().planes;
    let texel = |c: usize, t: usize| std::array::from_fn(|k| all[c][k][t] / WHITE);
    Ok([0, 1, 2].map(|c| (0..btf.texels()).map(|t| texel(c, t)).collect()))
}
