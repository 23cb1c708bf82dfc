//! Points shaded by a technique, freshly baked or saved.

use super::{Answers, Options, Request};
use crate::context::Context;
use crate::csv;
use crate::elevation::{Elevations, points as error_of_points};
use crate::failure::Failure;
use crate::inputs;
use glam::{DVec3, Vec3};
use serde_json::json;
use std::sync::Arc;
use steradian_brdf::SharedBrdf;
use steradian_light::Lights;
use steradian_techniques::direct::{Direct, split};
use steradian_techniques::{
    AnyBake, AnyTechnique, Geometry, Material, Points, PointsBuf, Radiance, SavedBake, Sites, View,
};

/// Bakes, then shades.
pub fn baked(
    technique: &'static dyn AnyTechnique,
    o: &Options,
    brdf: &SharedBrdf,
    lights: &Lights,
    q: &Request,
    context: &mut Context,
) -> Result<Answers, Failure> {
    let geometry = geometry(o, technique, q, context)?;
    let task = context.task.clone().with_tolerance(o.tolerance);
    let params = inputs::parameters(&o.params)?;
    let (baked, direct) = split(lights, o.beside.suns());
    let material = Material::new(brdf.clone());
    let mut bake = technique.bake(&baked, &material, geometry.as_ref(), &params, &task)?;
    Ok(answers(&mut *bake, &View::default(), Some((brdf, &direct)), q))
}

/// Shades by a bake from a file.
pub fn saved(file: &SavedBake, q: &Request) -> Result<Answers, Failure> {
    crate::saved::for_any_mesh(file)?;
    let mut bake = file.open()?;
    let view = View { light_rotation: file.turn, ..View::default() };
    Ok(answers(&mut *bake, &view, None, q))
}

fn answers(
    bake: &mut dyn AnyBake,
    view: &View,
    direct: Option<(&SharedBrdf, &Direct)>,
    q: &Request,
) -> Answers {
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.n.len()]);
    bake.frame(view);
    for (view, points) in batches(bake, view, q) {
        if bake.card().needs.view {
            bake.frame(&view);
        }
        let part = shade(bake, direct, q, &points);
        for (k, i) in points.into_iter().enumerate() {
            (0..3).for_each(|c| rgb[c][i] = part[c][k]);
        }
    }
    let lit = direct.is_some_and(|(_, lights)| !lights.is_empty());
    let c = bake.certificate().clone();
    let c = if lit { c.beside_exact_lights() } else { c };
    let elevations = Elevations::of(&c);
    let error = |i: usize| elevations.at(q.n[i].dot(q.wo[i]).clamp(-1.0, 1.0).acos()).unwrap_or(c.error);
    let row = |i: usize| (std::array::from_fn(|k| csv::shortest(rgb[k][i])), error(i));
    Answers {
        rows: (0..q.n.len()).map(row).collect(),
        error: c.error,
        certificate: Some(json!({
            "error": c.error, "known": c.known.word(), "metric": c.metric, "points": error_of_points(&c),
        })),
    }
}

/// The points that are shaded at once: all, or for rooms that prepare a frame those of one direction of view.
fn batches(bake: &dyn AnyBake, view: &View, q: &Request) -> Vec<(View, Vec<usize>)> {
    if !bake.card().needs.view {
        return vec![(*view, (0..q.n.len()).collect())];
    }
    let mut out: Vec<(View, Vec<usize>)> = Vec::new();
    let mut order: Vec<usize> = (0..q.n.len()).collect();
    let key = |i: usize| q.wo[i].to_array().map(f64::to_bits);
    order.sort_by_key(|&i| key(i));
    for i in order {
        match out.last_mut() {
            Some((_, points)) if key(points[0]) == key(i) => points.push(i),
            _ => out.push((seen_along(q.wo[i], view), vec![i])),
        }
    }
    out
}

/// A viewer far away along `wo`.
fn seen_along(wo: DVec3, view: &View) -> View {
    const FAR: f64 = 1e6;
    View { eye: (FAR * wo).as_vec3(), forward: -wo.as_vec3(), ..*view }
}

fn shade(
    bake: &dyn AnyBake,
    direct: Option<(&SharedBrdf, &Direct)>,
    q: &Request,
    points: &[usize],
) -> [Vec<f32>; 3] {
    let mut buf = PointsBuf::with_capacity(points.len());
    for &i in points {
        let p = q.p.as_ref().map_or(Vec3::ZERO, |p| p[i].as_vec3());
        buf.push(q.n[i].as_vec3(), q.t[i].as_vec3(), q.wo[i].as_vec3(), p);
    }
    let mut all: Points<'_> = buf.as_points();
    // Every point is its own site.
    let sites: Vec<u32> = points.iter().map(|&i| i as u32).collect();
    let weights = vec![0.0f32; points.len()];
    if bake.card().needs.sites {
        all.site.index = [&sites, &sites, &sites];
        all.site.weight = [&weights, &weights];
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
    bake.shade(&all, &mut Radiance::of(&mut rgb));
    if let Some((brdf, direct)) = direct {
        direct.add(&**brdf, &all, &mut Radiance::of(&mut rgb));
    }
    rgb
}

fn geometry(
    o: &Options,
    technique: &dyn AnyTechnique,
    q: &Request,
    context: &mut Context,
) -> Result<Option<Geometry>, Failure> {
    let needs = technique.card().needs.sites;
    let Some(mesh) = &o.mesh else {
        if needs {
            let slug = technique.card().slug;
            return Err(Failure::usage(format!("{slug} bakes on a mesh: give --mesh")));
        }
        return Ok(None);
    };
    let mesh = inputs::mesh(mesh, context)?;
    if !needs {
        return Ok(None);
    }
    let Some(p) = &q.p else {
        return Err(Failure::input(format!("{}: needs columns px,py,pz with --mesh", o.points.display())));
    };
    let sites = Sites::Points {
        p: p.iter().map(|v| v.as_vec3()).collect(),
        n: q.n.iter().map(|v| v.as_vec3()).collect(),
    };
    Ok(Some(Geometry { mesh: Arc::new(mesh), sites }))
}
