//! Radiance at points.

use crate::columns::{optional, optional_unit, unit};
use crate::material::ONE_REFLECTANCE;
use crate::paths;
use crate::report::points_json;
use crate::saved::for_any_mesh;
use crate::transfer::check_reads;
use crate::{Error, Local, Method, Outcome, Session};
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;
use steradian_base::{Certificate, ParamValues, Task};
use steradian_brdf::SharedBrdf;
use steradian_formats::CsvTable;
use steradian_light::{Lights, Probes};
use steradian_reference::path::PathScene;
use steradian_reference::{Lookup, Reference, ReferencePoint};
use steradian_scene::Mesh;
use steradian_scene::shadow::Blocker;
use steradian_scene::surface::Planes;
use steradian_sphere::Frame;
use steradian_techniques::direct::{Direct, Shadows, Suns, split};
use steradian_techniques::local::{self, LocalFrame, LocalLights, LocalShading};
use steradian_techniques::{
    AnyBake, AnyTechnique, Geometry, Material, Points as Batch, PointsBuf, Radiance, SavedBake, Sites, View,
    find,
};
use steradian_transfer::{Saved, Site, points_kind};

/// Tolerance of the reference where the request gives none.
const REFERENCE_TOLERANCE: f64 = 1e-4;

/// Message where a method does not take a separate technique for local light.
const LOCAL_ALONE: &str = "a local technique stands beside a technique: the reference, path and saved bakes have their own \
                           light; leave `local` out, or name a `technique`";

/// Surface points and the directions in which they are seen; all vectors are of one length, and unit.
#[derive(Debug, Clone, Default)]
pub struct Points {
    /// Normals.
    pub n: Vec<DVec3>,
    /// Directions to the viewer.
    pub wo: Vec<DVec3>,
    /// Tangents, orthogonal to the normals.
    pub t: Vec<DVec3>,
    /// Positions, metres, which point lights and meshes need.
    pub p: Option<Vec<DVec3>>,
    /// Texture coordinates, which techniques with data per texel need; u grows along the tangents.
    pub uv: Option<Vec<[f32; 2]>>,
}

/// Evaluation of radiance at points.
#[derive(Clone)]
pub struct Request {
    /// The lights.
    pub lights: Lights,
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// Technique, or the reference.
    pub method: Method,
    /// Parameters of the technique.
    pub params: ParamValues,
    /// The technique for directional and point lights; `None` shades them exactly.
    pub local: Option<Local>,
    /// Largest relative error: of each point by the reference (1e-4 by default), in the RMS over normals and
    /// views by a technique.
    pub tolerance: Option<f64>,
    /// Interpolation of texels by the reference; techniques have their own.
    pub lookup: Option<Lookup>,
    /// For techniques that bake on a mesh.
    pub mesh: Option<Arc<Mesh>>,
    /// Transfer of the mesh at these points, in place of rays ([`Session::transfer_at`]).
    pub transfer: Option<Arc<Saved>>,
    /// Light that varies over space, in place of `lights`.
    pub probes: Option<Arc<Probes>>,
    /// Contents of the files that `params` name ([`Session::planes`]).
    pub planes: Planes,
}

impl Request {
    /// `brdf` under `lights` by `method`, with everything else as usual.
    pub fn new(lights: Lights, brdf: SharedBrdf, method: Method) -> Self {
        Self {
            lights,
            brdf,
            method,
            params: ParamValues::default(),
            local: None,
            tolerance: None,
            lookup: None,
            mesh: None,
            transfer: None,
            probes: None,
            planes: Planes::default(),
        }
    }
}

/// Radiance at points.
#[derive(Debug, Clone)]
pub struct Answers {
    /// Radiance and relative error of each point.
    pub rows: Vec<([f64; 3], f64)>,
    /// The error that a tolerance speaks of: the largest of the points for the reference, the RMS over
    /// normals and views for a technique.
    pub error: f64,
    /// The technique's certificate.
    pub certificate: Option<Certificate>,
}

impl Points {
    /// Points of normals and views, with any tangents.
    pub fn new(n: Vec<DVec3>, wo: Vec<DVec3>) -> Self {
        let t = n.iter().map(|n| Frame::from_normal(*n).t).collect();
        Self { n, wo, t, p: None, uv: None }
    }

    /// Points of a table: nx,ny,nz and vx,vy,vz, and where there are such columns tx,ty,tz, px,py,pz and u,v.
    pub fn of_table(table: &CsvTable) -> Result<Self, Error> {
        let n = unit(table, ["nx", "ny", "nz"])?;
        let wo = unit(table, ["vx", "vy", "vz"])?;
        let t = match optional_unit(table, ["tx", "ty", "tz"])? {
            Some(t) => n.iter().zip(t).map(|(n, t)| Frame::from_normal_tangent(*n, t).t).collect(),
            None => n.iter().map(|n| Frame::from_normal(*n).t).collect(),
        };
        let uv = match table.column("u").or(table.column("v")) {
            Some(_) => Some(table.vectors(["u", "v"])?.into_iter().map(|uv| uv.map(|x| x as f32)).collect()),
            None => None,
        };
        Ok(Self { n, wo, t, p: optional(table, ["px", "py", "pz"])?, uv })
    }

    /// The points with these indices.
    pub(crate) fn some(&self, which: impl Iterator<Item = usize> + Clone) -> Self {
        let of = |v: &[DVec3]| which.clone().map(|i| v[i]).collect();
        Self {
            n: of(&self.n),
            wo: of(&self.wo),
            t: of(&self.t),
            p: self.p.as_deref().map(of),
            uv: self.uv.as_ref().map(|uv| which.clone().map(|i| uv[i]).collect()),
        }
    }
}

impl Answers {
    /// The first point whose answer is not finite.
    pub fn not_finite(&self) -> Option<usize> {
        self.rows.iter().position(|(rgb, err)| err.is_nan() || !rgb.iter().all(|x| x.is_finite()))
    }

    /// Adds the columns r, g, b and err to the table of the points.
    pub fn add_columns(&self, table: &mut CsvTable) {
        for (c, name) in ["r", "g", "b"].into_iter().enumerate() {
            table.set_column(name, self.rows.iter().map(|a| a.0[c]));
        }
        table.set_column("err", self.rows.iter().map(|a| a.1));
    }

    /// As JSON: the points with their radiance, or only their number.
    pub fn document(&self, radiance: bool) -> Value {
        let points = match radiance {
            true => self.rows.iter().map(|(rgb, err)| json!({"rgb": rgb, "err": err})).collect(),
            false => json!(self.rows.len()),
        };
        let certificate = self.certificate.as_ref().map(|c| -> Value {
            json!({"error": c.error, "known": c.known.word(), "metric": c.metric, "points": points_json(c)})
        });
        let worst = self.rows.iter().map(|a| a.1).fold(0.0, f64::max);
        json!({"points": points, "max_err": worst, "certificate": certificate})
    }
}

impl Request {
    /// Does it shade with data per texel?
    pub fn is_textured(&self) -> bool {
        !self.planes.is_empty() || self.local.as_ref().is_some_and(|l| l.is_textured(false))
    }
}

impl Session {
    /// Reads the files that a request's parameters name.
    pub fn planes(&mut self, request: &Request) -> Result<Planes, Error> {
        match &request.method {
            Method::Technique(t) => self.technique_planes(*t, &request.params, None),
            _ => Ok(Planes::default()),
        }
    }

    /// Transfer of a request's mesh at `points` from a file, for the technique that is asked for.
    pub fn transfer_at(&mut self, path: &Path, r: &Request, points: &Points) -> Result<Arc<Saved>, Error> {
        let (Method::Technique(technique), Some(mesh), Some(p)) = (&r.method, &r.mesh, &points.p) else {
            let why = "transfer of a file belongs to a technique, a mesh and points with positions";
            return Err(Error::usage(format!("{why}: name a technique and the mesh, and add px,py,pz")));
        };
        check_reads(*technique, &r.params)?;
        let site = |(p, n): (&DVec3, &DVec3)| Site { p: p.as_vec3(), n: n.as_vec3() };
        let sites: Vec<Site> = p.iter().zip(&points.n).map(site).collect();
        self.transfer_of(path, mesh, &points_kind(&sites))
    }

    /// Radiance that leaves `points` towards their viewers.
    pub fn eval(&mut self, request: &Request, points: &Points) -> Result<Outcome<Answers>, Error> {
        let answers = match &request.probes {
            Some(field) => self.eval_in_field(field, request, points)?,
            None => self.radiance_at(request, points)?,
        };
        let worst = answers.rows.iter().map(|a| a.1).fold(0.0, f64::max);
        self.note_error(format!("relative error at most {worst:.3e}"));
        let error = answers.error;
        Ok(Outcome::new(answers, request.tolerance, error))
    }

    /// Radiance at points under the request's lights.
    pub(crate) fn radiance_at(&self, request: &Request, points: &Points) -> Result<Answers, Error> {
        // All lights are checked here, since techniques check only those that they bake.
        request.lights.check().map_err(Error::input)?;
        Ok(match &request.method {
            Method::Path | Method::File(_) if request.probes.is_some() => {
                let slug = request.method.slug();
                return Err(Error::usage(format!("{slug} has its own light: leave `probes` out")));
            }
            Method::Reference | Method::Path | Method::File(_) if request.local.is_some() => {
                return Err(Error::usage(LOCAL_ALONE));
            }
            Method::Reference => reference(request, points, self)?,
            Method::Path => paths::points(request, points, self.paths, self)?,
            _ if request.lookup.is_some() => {
                return Err(Error::usage(
                    "`lookup` belongs to `technique` reference; techniques fix their own lookup",
                ));
            }
            Method::Technique(t) => {
                let answers = baked(*t, request, points, self)?;
                if t.needs_sites(&request.params) {
                    self.tell_dark(&answers, points);
                }
                answers
            }
            Method::File(file) => saved(file, points)?,
        })
    }
}

impl Session {
    /// Tells of points that face their viewer and get nothing of the light that techniques with sites let
    /// through.
    fn tell_dark(&self, answers: &Answers, q: &Points) {
        let dark = |i: &usize| answers.rows[*i].0 == [0.0; 3] && q.n[*i].dot(q.wo[*i]) > 0.0;
        let mut all = (0..answers.rows.len()).filter(dark);
        if let Some(first) = all.next() {
            let (n, of) = (1 + all.count(), answers.rows.len());
            self.warn(
                "points",
                format_args!(
                    "{n} of {of} get no light, the first is point {first}: do they lie inside the solid?"
                ),
            );
        }
    }
}

fn reference(r: &Request, q: &Points, session: &Session) -> Result<Answers, Error> {
    if !r.params.0.is_empty() {
        return Err(Error::usage("the reference takes no `param`"));
    }
    let reference = Reference::new(&r.lights, r.lookup.unwrap_or(Lookup::Constant), &session.task)?;
    let points: Vec<ReferencePoint> = (0..q.n.len())
        .map(|i| ReferencePoint {
            frame: Frame { n: q.n[i], t: q.t[i], b: q.n[i].cross(q.t[i]) },
            wo: q.wo[i],
            position: q.p.as_ref().map(|p| p[i]),
        })
        .collect();
    let tolerance = r.tolerance.unwrap_or(REFERENCE_TOLERANCE);
    let estimates = reference.radiance_batch(&*r.brdf, &points, tolerance, &session.task)?;
    let rows: Vec<_> = estimates.into_iter().map(|e| (e.rgb, e.error)).collect();
    let error = rows.iter().map(|a| a.1).fold(0.0, f64::max);
    Ok(Answers { rows, error, certificate: None })
}

/// Bakes, then shades.
fn baked(
    technique: &'static dyn AnyTechnique,
    r: &Request,
    q: &Points,
    session: &Session,
) -> Result<Answers, Error> {
    let geometry = geometry(technique, r, q)?;
    let task = session.task.clone().with_tolerance(r.tolerance);
    let textured = !r.planes.is_empty();
    if textured && q.uv.is_none() {
        return Err(Error::input(no_place(technique.card().slug)));
    }
    let suns = if textured { Suns::Fold } else { session.suns };
    let (baked, direct, lights) = match &r.local {
        Some(_) => local::split(&r.lights, suns),
        None => {
            let (baked, direct) = split(&r.lights, suns);
            (baked, direct, LocalLights::default())
        }
    };
    if textured && !direct.is_empty() {
        return Err(Error::usage(format!("{}: {ONE_REFLECTANCE}", technique.card().slug)));
    }
    let material = Material::new(r.brdf.clone()).with_textures(r.planes.clone());
    let mut bake = technique.bake(&baked, &material, geometry.as_ref(), &r.params, &task)?;
    let shadows = match &r.mesh {
        Some(mesh)
            if session.shadows.under(technique, &r.params) && !(direct.is_empty() && lights.is_empty()) =>
        {
            Some(session.shadows.blocker(mesh, &direct, &lights, task.max_memory())?)
        }
        _ => None,
    };
    let local = match r.local.as_ref().filter(|_| !lights.is_empty()) {
        Some(local) => Some(local_shading(local, (r, q), &lights, &task)?),
        None => None,
    };
    let (shadows, local) = (shadows.as_deref(), local.as_deref());
    let beside = OtherLights { brdf: &r.brdf, lights: &direct, local, shadows };
    Ok(answers(&mut *bake, &View::default(), Some(beside), q))
}

/// Points lack texture coordinates.
fn no_place(slug: &str) -> String {
    format!("{slug} has data per texel: the points need texture coordinates (columns u,v)")
}

/// Shading of local light at points, which lie in no triangles.
fn local_shading(
    local: &Local,
    (r, q): (&Request, &Points),
    lights: &LocalLights,
    task: &Task,
) -> Result<Box<dyn LocalShading>, Error> {
    if local.technique.needs_sites(&local.params) {
        let slug = local.technique.card().slug;
        let why = "interpolates between the corners of triangles, and points have none";
        let words = |(name, x): &(&str, f64)| {
            let info = local.technique.params().iter().find(|i| i.name == *name)?;
            Some(format!("{name}={}", info.check(&(*x).into()).ok()?))
        };
        let instead = local.technique.per_point().iter().filter_map(words).collect::<Vec<_>>().join(",");
        return Err(Error::usage(format!("{slug} {why}: use {slug}:{instead}")));
    }
    if local.is_textured(false) && q.uv.is_none() {
        return Err(Error::input(no_place(local.technique.card().slug)));
    }
    let bake = local.bake(&r.brdf, None, None, task)?;
    let frame = LocalFrame { lights, view: &View::default(), mesh: None, shadowed: false };
    Ok(bake.lit(&frame)?)
}

/// Shades by a bake from a file.
fn saved(file: &SavedBake, q: &Points) -> Result<Answers, Error> {
    for_any_mesh(file)?;
    let mut bake = file.open()?;
    let view = View { light_rotation: file.turn, ..View::default() };
    Ok(answers(&mut *bake, &view, None, q))
}

/// Lights that are shaded in addition to a bake: exactly, or by a local technique.
#[derive(Clone, Copy)]
struct OtherLights<'a> {
    brdf: &'a SharedBrdf,
    lights: &'a Direct,
    /// A separate technique for directional and point lights.
    local: Option<&'a dyn LocalShading>,
    shadows: Option<&'a dyn Blocker>,
}

fn answers(bake: &mut dyn AnyBake, view: &View, direct: Option<OtherLights<'_>>, q: &Points) -> Answers {
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.n.len()]);
    // A bake has the frame of the default view already; data of a view that no point has are not made.
    if *view != View::default() {
        bake.frame(view);
    }
    for (view, points) in batches(bake, view, q) {
        if bake.card().needs.view {
            bake.frame(&view);
        }
        let part = shade(bake, direct, q, &points);
        for (k, i) in points.into_iter().enumerate() {
            (0..3).for_each(|c| rgb[c][i] = part[c][k]);
        }
    }
    let lit = direct.is_some_and(|d| !d.lights.is_empty());
    let c = bake.certificate().clone();
    let c = if lit { c.beside_exact_lights() } else { c };
    let c = match direct.and_then(|d| d.local) {
        Some(local) => crate::local::joint(c, local.certificate()),
        None => c,
    };
    let error = |i: usize| c.at(q.n[i].dot(q.wo[i]).clamp(-1.0, 1.0).acos()).unwrap_or(c.error);
    let row = |i: usize| (std::array::from_fn(|k| shortest(rgb[k][i])), error(i));
    Answers { rows: (0..q.n.len()).map(row).collect(), error: c.error, certificate: Some(c) }
}

/// The double with the fewest digits that is this float: 0.1 for 0.1f32.
pub fn shortest(v: f32) -> f64 {
    v.to_string().parse().unwrap_or(f64::from(v))
}

/// The points that are shaded at once: all, or for techniques that prepare a frame those of one direction of
/// view.
fn batches(bake: &dyn AnyBake, view: &View, q: &Points) -> Vec<(View, Vec<usize>)> {
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
    /// Metres: the directions to the viewer from points a metre apart differ by 1e-6 radians.
    const FAR_METRES: f64 = 1e6;
    View { eye: (FAR_METRES * wo).as_vec3(), forward: -wo.as_vec3(), ..*view }
}

fn shade(bake: &dyn AnyBake, direct: Option<OtherLights<'_>>, q: &Points, points: &[usize]) -> [Vec<f32>; 3] {
    let mut buf = PointsBuf::with_capacity(points.len());
    for &i in points {
        let p = q.p.as_ref().map_or(Vec3::ZERO, |p| p[i].as_vec3());
        buf.push(q.n[i].as_vec3(), q.t[i].as_vec3(), q.wo[i].as_vec3(), p);
    }
    let mut all: Batch<'_> = buf.as_points();
    let uv = [0, 1]
        .map(|k| q.uv.iter().flat_map(|uv| points.iter().map(move |i| uv[*i][k])).collect::<Vec<f32>>());
    all.uv = uv.each_ref().map(Vec::as_slice);
    // Every point is its own site.
    let sites: Vec<u32> = points.iter().map(|&i| i as u32).collect();
    let weights = vec![0.0f32; points.len()];
    let sited = find(bake.card().slug).is_some_and(|t| t.needs_sites(&bake.params()));
    if sited {
        all.site.index = [&sites, &sites, &sites];
        all.site.weight = [&weights, &weights];
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
    bake.shade(&all, &mut Radiance::of(&mut rgb));
    if let Some(d) = direct {
        let shadows = d.shadows.map(|by| Shadows { by, offset: PathScene::OFFSET, reference: false });
        d.lights.add_behind(shadows, &**d.brdf, &all, &mut Radiance::of(&mut rgb));
        if let Some(local) = d.local {
            local.add(shadows, &all, &mut Radiance::of(&mut rgb));
        }
    }
    rgb
}

fn geometry(technique: &dyn AnyTechnique, r: &Request, q: &Points) -> Result<Option<Geometry>, Error> {
    let (card, sited) = (technique.card(), technique.needs_sites(&r.params));
    match (&r.mesh, &q.p) {
        (None, _) if sited => Err(Error::usage(format!("{} bakes on a mesh: give `mesh`", card.slug))),
        (Some(_), None) if sited => {
            Err(Error::input("the points need positions (columns px,py,pz) with `mesh`"))
        }
        (Some(mesh), Some(p)) if sited => {
            let sites = Sites::Points {
                p: p.iter().map(|v| v.as_vec3()).collect(),
                n: q.n.iter().map(|v| v.as_vec3()).collect(),
            };
            Ok(Some(Geometry { transfer: r.transfer.clone(), ..Geometry::new(mesh.clone(), sites) }))
        }
        _ => Ok(None),
    }
}
