//! Links between the vertices of a mesh and the surfaces that they see.

use super::shade;
use super::tables::{Emitter, Params, Seen, Tables};
use crate::certify::sites::Paths;
use crate::local::{LocalLights, error};
use crate::shared::trials::lights::three_directionals;
use crate::{BakeError, Geometry, Material, View};
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_scene::Mesh;
use steradian_sphere::Frame;
use steradian_sphere::quadrature::fibonacci;
use steradian_transfer::{Link, Links, Scene, Site, TransferError};

const SLUG: &str = "precomputed_visibility";
/// Most numbers of the vertices under the lights of a frame: 128 MiB, the largest buffer that every GPU can
/// bind.
const MOST: usize = 1 << 25;
/// Points at which the error is measured: edges of shadows, which cross few triangles, have nearly all of it.
const POINTS: usize = 1536;
/// Largest distance that rays start off the surface, relative to the diagonal of the mesh.
const OFFSET: f32 = 1e-5;
/// Distance by which sites on the border of a wall move from their vertex into a triangle, relative to the
/// way to the triangle's centre.
const INSIDE: f32 = 1e-2;

pub(super) fn bake(m: &Material) -> Tables {
    Tables { brdf: m.brdf.clone(), seen: None, measured: None }
}

fn refused(why: impl Into<String>) -> BakeError {
    BakeError::Geometry { slug: SLUG, why: why.into() }
}

fn of_transfer(e: TransferError) -> BakeError {
    match e {
        TransferError::Cancelled(c) => c.into(),
        TransferError::Memory { needed, allowed, .. } => {
            BakeError::Memory { slug: SLUG, need: needed, allowed }
        }
        e => refused(e.to_string()),
    }
}

/// The vertices that lie on an edge of one triangle alone: on the border of a wall.
fn border(mesh: &Mesh) -> Vec<bool> {
    let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
    for [a, b, c] in &mesh.triangles {
        for (v, w) in [(a, b), (b, c), (c, a)] {
            *edges.entry([*v.min(w), *v.max(w)]).or_default() += 1;
        }
    }
    let mut out = vec![false; mesh.positions.len()];
    edges.into_iter().filter(|e| e.1 == 1).flat_map(|e| e.0).for_each(|v| out[v as usize] = true);
    out
}

/// The vertices, moved off the surface; those on the border of a wall are moved into one of their triangles,
/// so that they see an adjoining wall.
fn sites(mesh: &Mesh) -> Vec<Site> {
    let (mut out, border) = (Site::vertices(mesh), border(mesh));
    let most = OFFSET * mesh.diagonal();
    // Each vertex follows the one of its triangles whose normal is nearest to its own; `best` is the cosine
    // between both.
    let mut best = vec![0.0f32; out.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        let across = (b - a).cross(c - a);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        // Closer to the triangle than to walls that stand on its edges.
        let off = (0.9 * INSIDE * across.length() / (3.0 * longest)).min(most);
        for (v, p) in t.iter().map(|v| *v as usize).zip([a, b, c]) {
            let cosine = across.normalize_or_zero().dot(out[v].n);
            if cosine > best[v] {
                best[v] = cosine;
                let inside = if border[v] { INSIDE } else { 0.0 };
                out[v].p = p + ((a + b + c) / 3.0 - p) * inside + out[v].n * off;
            }
        }
    }
    out
}

/// Adds the mesh to the tables, and measures the error on it.
pub(super) fn transfer(
    t: Tables,
    m: &Material,
    g: &Geometry,
    p: &Params,
    task: &Task,
) -> Result<Tables, BakeError> {
    let mesh = &*g.mesh;
    if mesh.normals.len() != mesh.positions.len() {
        return Err(refused("needs a mesh with normals"));
    }
    let count = if p.bounces > 0 { p.directions } else { 0 };
    if (mesh.positions.len() + 1).saturating_mul(3 * count) > MOST {
        let most = MOST / (3 * mesh.positions.len() + 3);
        return Err(refused(format!(
            "takes {most} directions at most with {} vertices",
            mesh.positions.len()
        )));
    }
    let scene = Scene::new(mesh).map_err(of_transfer)?;
    let sites = sites(mesh);
    let directions = fibonacci(count).directions;
    let single: Vec<Vec3> = directions.iter().map(|d| d.as_vec3()).collect();
    let mut links = Links::new(&scene, &sites, &single, 0.0, task).map_err(of_transfer)?.links;
    if p.hits == 1 {
        links.iter_mut().for_each(nearest);
    }
    let frame = |(v, site): (usize, &Site)| {
        let n = site.n.as_dvec3().normalize_or(DVec3::Z);
        let t = mesh.tangents.get(v).map_or(DVec3::ZERO, |t| t.truncate().as_dvec3());
        if t == DVec3::ZERO { Frame::from_normal(n) } else { Frame::from_normal_tangent(n, t) }
    };
    let frames: Vec<Frame> = sites.iter().enumerate().map(frame).collect();
    let weight = |f: &Frame| PI / directions.iter().map(|d| d.dot(f.n).max(0.0)).sum::<f64>();
    let weights = frames.iter().map(weight).collect();
    let (emitters, corners) = emitters(mesh);
    let seen = Seen {
        bvh: scene.bvh,
        origins: sites.iter().map(|s| s.p).collect(),
        frames,
        weights,
        directions,
        links,
        emitters,
        corners,
        slots: g.materials.iter().map(|m| m.brdf.clone()).collect(),
        own: m.brdf.clone(),
    };
    let mut tables = Tables { seen: Some(seen), ..t };
    tables.measured = Some(measured(&tables, m, g, p, task)?);
    Ok(tables)
}

/// Moves all of the weight to the corner that has most of it.
fn nearest(l: &mut Link) {
    let [v, w] = l.weight;
    let u = 1.0 - v - w;
    l.weight = if u >= v && u >= w {
        [0.0, 0.0]
    } else if v >= w {
        [1.0, 0.0]
    } else {
        [0.0, 1.0]
    };
}

fn emitters(mesh: &Mesh) -> (Vec<Emitter>, Vec<[u32; 3]>) {
    let (mut all, mut known) = (Vec::new(), HashMap::new());
    let of = |(t, corners): (usize, &[u32; 3])| {
        corners.map(|vertex| {
            let slot = mesh.material(t);
            *known.entry((vertex, slot)).or_insert_with(|| {
                all.push(Emitter { vertex, slot });
                all.len() as u32 - 1
            })
        })
    };
    let corners = mesh.triangles.iter().enumerate().map(of).collect();
    (all, corners)
}

/// The error under three directional lights against paths through the mesh, with views weighted by projected
/// area: the upper bound (two standard errors above the measured error), the measured error, and the noise of
/// the paths. The noise is subtracted from both in squares, since it is independent of the technique.
fn measured(t: &Tables, m: &Material, g: &Geometry, p: &Params, task: &Task) -> Result<[f64; 3], BakeError> {
    let lights = three_directionals();
    let local = LocalLights { directionals: lights.directionals.clone(), points: Vec::new() };
    let lights_of_frame = local.rows(&View::default());
    let rows = t.seen.as_ref().map(|s| shade::Rows::new(s, &lights_of_frame, p)).unwrap_or_default();
    let paths = Paths {
        geometry: g,
        lights: &lights,
        brdf: &*m.brdf,
        events: p.bounces as u32 + 1,
        points: POINTS,
        projected: true,
    };
    let shade = |q: &crate::Points<'_>, out: &mut crate::Radiance<'_>| {
        shade::add(t, &rows, &lights_of_frame, None, q, out);
    };
    let (errors, noise) = paths.errors(SLUG, task, &shade)?;
    let without = |error: f64| (error * error - noise * noise).max(0.0).sqrt();
    Ok([without(errors.all), without(errors.mean), noise])
}

/// The measured error; where points are shaded on their own, that of the reflectance.
pub(super) fn error_of(t: &Tables, m: &Material) -> f64 {
    match t.measured {
        Some([error, ..]) => error,
        None => error(&*m.brdf, &|wi, wo| m.brdf.f_cos(wi, wo), |wi, wo| shade::f_cos(t, wi, wo)),
    }
}

pub(super) fn details(t: &Tables) -> Vec<(&'static str, f64)> {
    let (Some(s), Some([_, mean, noise])) = (&t.seen, t.measured) else { return Vec::new() };
    let met = s.links.iter().filter(|l| l.triangle != Link::NONE).count();
    let above: usize =
        s.frames.iter().map(|f| s.directions.iter().filter(|d| d.dot(f.n) > 0.0).count()).sum();
    vec![
        ("directions", s.directions.len() as f64),
        ("directions that meet surfaces", met as f64 / above.max(1) as f64),
        ("error, mean of the points", mean),
        ("noise of the paths", noise),
    ]
}
