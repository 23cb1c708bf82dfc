//! Techniques for directional and point lights, as requests name them.

use crate::scene::below;
use crate::{Error, Material, Method, Outcome, Session};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use steradian_base::{Certificate, Evidence, ParamValues, Task, Value, split_spec, unknown};
use steradian_brdf::{Brdf, SharedBrdf, spec_without_folders};
use steradian_formats::{Limits, TensorFile, write_tensors_as};
use steradian_relight::btf::Btf;
use steradian_relight::polynomial::Basis;
use steradian_scene::Mesh;
use steradian_scene::surface::{NormalMap, Planes};
use steradian_techniques::local::{Content, Plane};
use steradian_techniques::{AnyLocal, LocalBake, find_local, locals};
use steradian_techniques::{AnyTechnique, Geometry, SavedLocal};

/// A technique for directional and point lights with its parameters.
#[derive(Clone)]
pub struct Local {
    /// The technique.
    pub technique: &'static dyn AnyLocal,
    /// Its parameters.
    pub params: ParamValues,
    /// Contents of the files that its parameters name ([`Session::open_local`]).
    planes: Planes,
    /// The bidirectional texture function that one of them names.
    apparent: Option<Arc<Btf>>,
    /// The bake that a file holds.
    saved: Option<Arc<SavedLocal>>,
    made: Arc<Mutex<Option<Made>>>,
}

/// The last bake, and the inputs that it was made from.
struct Made {
    key: String,
    mesh: Option<Arc<Mesh>>,
    bake: Arc<dyn LocalBake>,
}

impl Local {
    /// Name for exact shading, without a technique.
    pub const EXACT: &'static str = "exact";

    /// Is this the name of a saved bake?
    pub(crate) fn is_file(spec: &str) -> bool {
        Path::new(spec).extension().is_some_and(|e| e.eq_ignore_ascii_case("safetensors"))
    }

    /// `SLUG` or `SLUG:name=value,…`, or a file that `bake --local` wrote; `None` for `exact`.
    pub fn parse(spec: &str) -> Result<Option<Self>, Error> {
        if Self::is_file(spec) {
            let file = SavedLocal::read(Path::new(spec), &Limits::default())?;
            let (technique, params) = (file.technique, file.bake.params());
            let (planes, made, saved) = (Planes::default(), Arc::default(), Some(Arc::new(file)));
            return Ok(Some(Self { technique, params, planes, apparent: None, saved, made }));
        }
        let (slug, body) = split_spec(spec);
        if slug == Self::EXACT && body.is_empty() {
            return Ok(None);
        }
        let technique = find_local(slug).ok_or_else(|| {
            if steradian_techniques::find(slug).is_some() {
                let why = "shades environments: name it with `technique`; local techniques are";
                return Error::usage(format!("{slug} {why} {}", Self::slugs().join(", ")));
            }
            Error::usage(unknown("local technique", slug, &Self::slugs()))
        })?;
        let params = ParamValues::parse(body, technique.params());
        let params = params.map_err(|e| Error::usage(format!("{spec}: {e}")))?;
        let (planes, made) = (Planes::default(), Arc::default());
        Ok(Some(Self { technique, params, planes, apparent: None, saved: None, made }))
    }

    /// Every name that [`Local::parse`] accepts, `exact` first.
    pub fn slugs() -> Vec<&'static str> {
        std::iter::once(Self::EXACT).chain(locals().iter().map(|t| t.card().slug)).collect()
    }

    /// The technique's slug with the parameters that were given.
    pub fn label(&self) -> String {
        let slug = self.technique.card().slug;
        if let Some(name) = self.saved.as_ref().and_then(|s| s.path.file_name()) {
            return format!("{slug} of {}", name.to_string_lossy());
        }
        let body = self.params.body_without_folders(self.technique.params());
        if self.params.0.is_empty() { slug.into() } else { format!("{slug}:{body}") }
    }

    /// Does its preparation for a frame depend on the view?
    pub(crate) fn sees_view(&self) -> bool {
        self.technique.card().needs.view
    }

    /// Does it compute shadows or interreflection of the mesh?
    pub(crate) fn knows_mesh(&self) -> bool {
        self.technique.card().capabilities.self_shadowing && self.technique.needs_sites(&self.params)
    }

    /// Largest distance between vertices of a mesh, relative to the diagonal of the object near it, where
    /// shadows are computed at them.
    pub(crate) fn spacing(&self) -> Option<f32> {
        self.knows_mesh().then_some(1.0 / 12.0)
    }

    /// Does it have normals of its own, which all light is shaded with?
    pub fn has_bumps(&self) -> bool {
        let bumpy = |p: &Plane| matches!(p.content, Content::Heights | Content::Normals);
        match &self.saved {
            Some(file) => file.bake.normals().is_some(),
            None => self.technique.planes().iter().any(|p| bumpy(p) && self.planes.has(p.name)),
        }
    }

    /// Refuses a mesh on which a reflectance that has a direction has none.
    pub(crate) fn check_tangents(&self, brdf: &dyn Brdf, mesh: &Mesh) -> Result<(), Error> {
        let card = self.technique.card();
        if card.needs.tangents && !brdf.is_isotropic() && mesh.tangents.is_empty() && mesh.uvs.is_empty() {
            let (slug, spec) = (card.slug, brdf.spec());
            let why = "which has neither tangents nor texture coordinates";
            return Err(Error::input(format!("{slug}: {spec} has a direction on the mesh, {why}")));
        }
        Ok(())
    }

    /// The files that its parameters name.
    fn files(&self) -> impl Iterator<Item = (&'static Plane, &Path)> {
        let named = self.technique.planes().iter().filter(|_| self.saved.is_none());
        named.filter_map(|p| match self.params.0.get(p.name) {
            Some(Value::File(path)) => Some((p, path.as_path())),
            _ => None,
        })
    }

    /// Names the file of an image, unless its parameters name one already; false where it reads no image of
    /// this name.
    pub(crate) fn name_file(&mut self, name: &str, file: &str) -> bool {
        let reads = self.saved.is_none() && self.technique.planes().iter().any(|p| p.name == name);
        if reads {
            self.params.0.entry(name.into()).or_insert_with(|| Value::File(file.into()));
        }
        reads
    }

    /// All files that it is made of.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.files().map(|(_, file)| file).chain(self.saved.iter().map(|s| s.path.as_path()))
    }

    /// This technique with data per texel that come from no file, under the names of [`AnyLocal::planes`].
    pub fn with_planes(self, planes: Planes) -> Self {
        Self { planes, made: Arc::default(), ..self }
    }

    /// This technique with a bidirectional texture function that comes from no file.
    pub fn with_apparent(self, apparent: Arc<Btf>) -> Self {
        Self { apparent: Some(apparent), made: Arc::default(), ..self }
    }

    /// Does it shade with data per texel, its own or the material's normals?
    pub fn is_textured(&self, normals: bool) -> bool {
        self.saved.as_ref().is_some_and(|s| s.bake.is_textured())
            || self.files().next().is_some()
            || !self.planes.is_empty()
            || self.apparent.is_some()
            || (normals && self.reads_normals())
    }

    /// Are its data per texel the same files that `technique` reads under the same names?
    pub(crate) fn reads_like(&self, technique: &dyn AnyTechnique, params: &ParamValues) -> bool {
        let own: Vec<_> = self.files().map(|(p, path)| (p, path.to_path_buf())).collect();
        let held = self.saved.is_some() || self.apparent.is_some();
        !held && !own.is_empty() && own == files_of(technique, params)
    }

    /// Does it take the material's normal map where it has no file of normals or heights?
    fn reads_normals(&self) -> bool {
        self.technique.planes().iter().any(|p| p.content == Content::Normals)
    }

    /// Refuses a mesh without the texture coordinates that data per texel need; messages call it `name`.
    pub fn check_mesh(&self, mesh: &Mesh, normals: bool, name: &str) -> Result<(), Error> {
        if self.is_textured(normals) && mesh.uvs.len() != mesh.positions.len() {
            let slug = self.technique.card().slug;
            return Err(Error::input(format!("{name}: has no texture coordinates, which {slug} needs")));
        }
        Ok(())
    }

    /// Tabulates a reflectance with the planes of the files, or the normals of the material where there are
    /// none, on the mesh that it needs.
    pub(crate) fn bake(
        &self,
        brdf: &SharedBrdf,
        normals: Option<&NormalMap>,
        geometry: Option<Geometry>,
        task: &Task,
    ) -> Result<Arc<dyn LocalBake>, Error> {
        if let Some(file) = &self.saved {
            let (own, asked) = (file.bake.brdf().spec(), brdf.spec());
            if spec_without_folders(&own) != spec_without_folders(&asked) {
                let name = file.path.display();
                return Err(Error::usage(format!("{name}: was baked of {own}, not {asked}: bake it again")));
            }
            return Ok(file.bake.clone());
        }
        let opened = |p: &Plane| match p.content {
            Content::Bidirectional => self.apparent.is_some(),
            _ => self.planes.has(p.name),
        };
        if let Some((plane, _)) = self.files().find(|f| !opened(f.0)) {
            return Err(Error::failed(format!("the file of '{}' was not opened", plane.name)));
        }
        let normals = normals.filter(|_| self.planes.is_empty() && self.reads_normals());
        let of = normals.map_or(std::ptr::null(), std::ptr::from_ref);
        let slots: Vec<String> =
            geometry.iter().flat_map(|g| g.materials.iter()).map(|m| m.brdf.spec()).collect();
        let key = format!("{} {:?} {of:p} {slots:?}", brdf.spec(), task.tolerance());
        let mesh = geometry.as_ref().map(|g| g.mesh.clone());
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(m) = made.as_ref().filter(|m| m.key == key && m.mesh == mesh) {
            return Ok(m.bake.clone());
        }
        let mut planes = self.planes.clone();
        if let (Some(map), Some(p)) =
            (normals, self.technique.planes().iter().find(|p| p.content == Content::Normals))
        {
            planes = planes.with(p.name, Arc::new(map.mean().clone()));
        }
        let mut material = steradian_techniques::Material::new(brdf.clone()).with_textures(planes);
        if let Some(apparent) = &self.apparent {
            material = material.with_apparent(apparent.clone());
        }
        let bake: Arc<dyn LocalBake> =
            self.technique.bake(&material, geometry.as_ref(), &self.params, task)?.into();
        *made = Some(Made { key, mesh, bake: bake.clone() });
        Ok(bake)
    }
}

impl Session {
    /// A technique for local light with the contents of its parameters' files, which for a scene file must
    /// lie below its `folder`.
    pub fn open_local(&mut self, local: &Local, folder: Option<&Path>) -> Result<Local, Error> {
        if let Some(file) = &local.saved {
            self.note_input(&file.path);
        }
        let files: Vec<(&'static Plane, PathBuf)> = local.files().map(|(p, f)| (p, f.into())).collect();
        let basis = local.technique.basis(&local.params);
        let (planes, apparent) = self.open_planes(&files, basis, folder)?;
        Ok(Local { planes, apparent, made: Arc::default(), ..local.clone() })
    }

    /// A material with the contents of the files that its technique's parameters name, which for a scene file
    /// must lie below its `folder`.
    pub fn open_material(&mut self, m: Material, folder: Option<&Path>) -> Result<Material, Error> {
        let Some(Method::Technique(t)) = m.method else { return Ok(m) };
        let planes = self.technique_planes(t, &m.params, folder)?;
        Ok(Material { planes, ..m })
    }

    /// A material with the contents of the files that parameters of any of these methods name, so that the
    /// methods can be compared.
    pub fn open_compared(
        &mut self,
        m: Material,
        methods: &[Method],
        folder: Option<&Path>,
    ) -> Result<Material, Error> {
        let mut planes = m.planes.clone();
        let mut read: Vec<&str> = Vec::new();
        for method in methods {
            let Method::Technique(t) = method else { continue };
            let one = self.technique_planes(*t, &m.params, folder)?;
            if one.is_empty() {
                continue;
            }
            // Two sets of images are two reflectances, and the reference can represent only one.
            let names: Vec<&str> = t.planes().iter().map(|p| p.name).collect();
            if !read.is_empty() && read != names {
                let why = "its images say other numbers than those of another technique: compare them apart";
                return Err(Error::usage(format!("{}: {why}", t.card().slug)));
            }
            read = names;
            for (name, texture) in one.iter() {
                planes = planes.with(name, texture.clone());
            }
        }
        Ok(Material { planes, ..m })
    }

    /// Contents of the files that a technique's parameters name.
    pub(crate) fn technique_planes(
        &mut self,
        t: &dyn AnyTechnique,
        params: &ParamValues,
        folder: Option<&Path>,
    ) -> Result<Planes, Error> {
        Ok(self.open_planes(&files_of(t, params), Basis::default(), folder)?.0)
    }

    fn open_planes(
        &mut self,
        files: &[(&'static Plane, PathBuf)],
        basis: Basis,
        folder: Option<&Path>,
    ) -> Result<(Planes, Option<Arc<Btf>>), Error> {
        let (mut planes, mut apparent) = (Planes::default(), None);
        for (plane, path) in files {
            let file = match folder {
                Some(folder) => below(folder, &path.to_string_lossy())?,
                None => path.clone(),
            };
            if plane.content == Content::Bidirectional {
                apparent = Some(Arc::new(self.btf(&file)?));
            }
            for (suffix, texture) in self.plane(&file, plane.content, basis)? {
                if let Some(([i, j], x)) = plane.beyond(&texture) {
                    let ([least, most], name) = (plane.range, plane.name);
                    let why = format!("texel ({i}, {j}) has {x}: {name} takes {least} to {most}");
                    return Err(Error::input(format!("{}: {why}", file.display())));
                }
                planes = planes.with(&format!("{}{suffix}", plane.name), texture);
            }
        }
        Ok((planes, apparent))
    }
}

/// The files of data per texel that a technique's parameters name.
fn files_of(t: &dyn AnyTechnique, params: &ParamValues) -> Vec<(&'static Plane, PathBuf)> {
    let named = |p: &'static Plane| {
        let info = t.params().iter().find(|i| i.name == p.name)?;
        match info.check(params.0.get(p.name)?) {
            Ok(Value::File(path)) => Some((p, path)),
            _ => None,
        }
    };
    t.planes().iter().filter_map(named).collect()
}

/// A bake of a technique for directional and point lights that is to be written.
#[derive(Clone)]
pub struct LocalRequest {
    /// Technique and parameters, as [`Local::parse`] takes them.
    pub local: Local,
    /// Spec of the reflectance.
    pub brdf: String,
    /// Largest relative RMS error.
    pub tolerance: Option<f64>,
}

/// A finished bake of a local technique.
pub struct BakedLocal {
    /// The bake.
    pub bake: Arc<dyn LocalBake>,
    /// Spec of the reflectance.
    pub brdf: String,
    /// Seconds.
    pub seconds: f64,
    tensors: TensorFile,
}

impl BakedLocal {
    /// Writes all of it.
    pub fn write(&self, path: &Path, session: &Session) -> Result<u64, Error> {
        session.check()?;
        write_tensors_as(path, &self.tensors, &session.sealed(&self.tensors, BTreeMap::new()))?;
        Ok(std::fs::metadata(path).map_or(0, |m| m.len()))
    }
}

impl Session {
    /// Bakes a technique for directional and point lights, with the contents of its parameters' files.
    pub fn baked_local(&mut self, request: &LocalRequest) -> Result<Outcome<BakedLocal>, Error> {
        let brdf = self.brdf(&request.brdf)?;
        let local = self.open_local(&request.local, None)?;
        if local.technique.needs_sites(&local.params) {
            let slug = local.technique.card().slug;
            return Err(Error::usage(format!("{slug}: has data of a mesh, which are not saved")));
        }
        let start = Instant::now();
        let task = self.task.clone().with_tolerance(request.tolerance);
        let bake = local.bake(&brdf, None, None, &task)?;
        let mut tensors = bake.save()?;
        steradian_techniques::Made::of(&request.brdf, bake.brdf().held(), "", 0.0, 0.0).save(&mut tensors);
        let c = bake.certificate().clone();
        self.note_error(format!("{} {:.3e} ({})", c.metric, c.error, c.known.word()));
        let seconds = start.elapsed().as_secs_f64();
        let done = BakedLocal { bake, brdf: request.brdf.clone(), seconds, tensors };
        Ok(Outcome::new(done, request.tolerance, c.error))
    }
}

impl PartialEq for Local {
    fn eq(&self, other: &Self) -> bool {
        let file = |l: &Self| l.saved.as_ref().map(|s| s.path.clone());
        self.technique.card().slug == other.technique.card().slug
            && self.params == other.params
            && file(self) == file(other)
    }
}

/// Certificate for the sum of two parts of the light: the larger error of both, each relative to its part.
/// (Where both parts are non-negative, the relative error of the sum is at most √2 times that.)
pub(crate) fn joint(distant: Certificate, local: &Certificate) -> Certificate {
    let weaker = |e: Evidence| matches!(e, Evidence::Estimated);
    let known = match (distant.known, local.known) {
        (a, b) if weaker(a) || weaker(b) => Evidence::Estimated,
        (Evidence::Proved, b) => b,
        (a, _) => a,
    };
    let all = Certificate { known, ..distant }.detail("error of local light", local.error);
    if local.error <= all.error {
        return all;
    }
    // The error of local light, the larger one here, is not known by elevation.
    let metric = format!("{}; of local light: {}", all.metric, local.metric);
    Certificate { error: local.error, metric, elevations: Vec::new(), ..all }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::{Points, Request};
    use glam::{DVec3, Vec3};
    use steradian_light::{DirectionalLight, DiskLight, Environment, Lights, PointLight};
    use steradian_sphere::{Frame, Layout, SphereImage};
    use steradian_techniques::direct::Suns;
    use steradian_techniques::shared::trials::specimens;

    fn environment() -> Lights {
        let sky = |d: DVec3| [0.5 + 0.3 * d.y as f32, 0.4 + 0.2 * d.x as f32, 0.6];
        Environment { image: SphereImage::from_fn(Layout::LatLong, 16, 8, sky) }.into()
    }

    fn points() -> Points {
        let n: Vec<DVec3> = (0..40)
            .map(|k| {
                let (y, phi) = (1.0 - (f64::from(k) + 0.5) / 20.0, f64::from(k) * 2.4);
                let r = (1.0 - y * y).sqrt();
                DVec3::new(r * phi.cos(), y, r * phi.sin())
            })
            .collect();
        let wo = n.iter().map(|n| {
            let f = Frame::from_normal(*n);
            (f.n + 0.6 * f.t + 0.3 * f.b).normalize()
        });
        Points { p: Some(n.clone()), ..Points::new(n.clone(), wo.collect()) }
    }

    /// Techniques for directional and point lights, each with one for the other lights, its reflectance, and
    /// whether it shades what the exact reflectance does up to 1e-3.
    fn pairs() -> Vec<(&'static str, &'static str, Local, bool)> {
        let close = [
            ("sh_irradiance", "lambert:albedo=0.7", "vertex_analytic:rate=pixel"),
            ("split_sum", "ggx:alpha=0.3,f0=0.9", "analytic_decomposition"),
            ("banks_env", "banks:n=20", "banks_table"),
            ("sh_irradiance", "lambert:albedo=0.7", "separable_svd"),
            ("sh_irradiance", "lambert:albedo=0.7", "homomorphic:resolution=16"),
        ];
        let parsed = |spec: &str| Local::parse(spec).expect("a local technique").expect("one");
        let mut all: Vec<_> =
            close.into_iter().map(|(t, brdf, local)| (t, brdf, parsed(local), true)).collect();
        for t in locals() {
            let pair = t.card().specimens.iter().find_map(|spec| {
                let brdf = steradian_brdf::parse(spec).expect("a spec");
                let takes = |slug: &&&str| {
                    let other = steradian_techniques::find(slug).expect("a technique");
                    (other.card().materials)(&*brdf).is_ok()
                };
                ["sh_irradiance", "split_sum", "sh_brdf"].iter().find(takes).map(|slug| (*slug, *spec))
            });
            let (technique, spec) = pair.unwrap_or_else(|| panic!("{}: beside none", t.card().slug));
            let planes = t.planes();
            let mut local = parsed(t.card().slug).with_planes(specimens::planes(planes));
            local.params = t.per_point().iter().copied().collect();
            if specimens::is_bidirectional(planes) {
                local = local.with_apparent(specimens::apparent());
            }
            all.push((technique, spec, local, false));
        }
        all
    }

    /// Of each pair of techniques: what all lights give together is what environment and disks give, and what
    /// directional and point lights give, added; and where no texture and no coarse table is between, it is
    /// what exact shading of the latter gives, up to what the tables err by.
    #[test]
    fn no_light_counts_twice_or_gets_lost() {
        let disk = DiskLight {
            direction: DVec3::new(0.3, 0.9, 0.3).normalize(),
            angular_radius: 0.05,
            radiance: [90.0; 3],
        };
        let directional =
            DirectionalLight { direction: DVec3::new(0.8, 0.6, 0.0), irradiance: [1.0, 2.0, 3.0] };
        let point = PointLight { position: Vec3::new(-1.0, 2.0, 1.5), intensity: [9.0, 6.0, 3.0] };
        let far = Lights { disks: vec![disk], ..environment() };
        let near = Lights { directionals: vec![directional], points: vec![point], ..Lights::default() };
        let all =
            Lights { directionals: near.directionals.clone(), points: near.points.clone(), ..far.clone() };
        let points = points();
        let uv = (0..points.n.len()).map(|k| [0.1 + 0.02 * k as f32, 0.5]).collect();
        let points = Points { uv: Some(uv), ..points };
        for (k, (technique, brdf, local, close)) in pairs().into_iter().enumerate() {
            // Where suns go does not depend on the technique for the other lights.
            let all_suns = [Suns::Exact, Suns::Fold];
            for suns in all_suns.into_iter().take(if k == 0 { 2 } else { 1 }) {
                let mut session = Session::new();
                session.suns = suns;
                let mut of = |lights: &Lights, local: Option<Local>| {
                    let brdf = steradian_brdf::parse(brdf).expect("a spec");
                    let method = Method::find(technique).expect("a technique");
                    let request = Request { local, ..Request::new(lights.clone(), brdf, method) };
                    let (answers, _) = session.eval(&request, &points).expect("evaluates").even_if_missed();
                    answers.rows.into_iter().flat_map(|r| r.0).collect::<Vec<f64>>()
                };
                let local = Some(local.clone());
                let together = of(&all, local.clone());
                let (one, other) = (of(&far, local.clone()), of(&near, local.clone()));
                let exact = if close && suns == Suns::Exact { of(&all, None) } else { Vec::new() };
                let energy: f64 = together.iter().map(|x| x * x).sum();
                let off = |f: &dyn Fn(usize) -> f64| {
                    let squares: f64 = together.iter().enumerate().map(|(k, x)| (x - f(k)).powi(2)).sum();
                    (squares / energy).sqrt()
                };
                let label = local.as_ref().map(Local::label).unwrap_or_default();
                let name = format!("{technique} + {label}, {brdf}, {suns:?}");
                assert!(off(&|k| one[k] + other[k]) < 1e-5, "{name}");
                let parts = [off(&|k| one[k]), off(&|k| other[k])];
                assert!(parts.iter().all(|p| *p > 0.01), "{name}: both parts are seen: {parts:?}");
                if !exact.is_empty() {
                    assert!(off(&|k| exact[k]) < 1e-3, "{name}: {:.2e}", off(&|k| exact[k]));
                }
            }
        }
    }

    #[test]
    fn local_techniques_are_named_with_their_parameters() {
        assert!(Local::parse("exact").expect("known").is_none());
        let l = Local::parse("banks-table:resolution=64,coordinate=cosine").expect("known").expect("one");
        assert_eq!(l.label(), "banks_table:resolution=64,coordinate=cosine");
        for (spec, part) in [
            ("banks_tabel", "did you mean"),
            ("shrm", "`technique`"),
            ("banks_table:size=3", "size"),
            ("exact:rate=pixel", "local technique"),
            ("banks_table:resolution=1e9", "resolution"),
        ] {
            let why = Local::parse(spec).err().expect(spec).to_string();
            assert!(why.contains(part), "{spec}: {why}");
        }
    }

    /// Points lie in no triangle, and the reference takes no additional technique.
    #[test]
    fn what_has_no_meaning_is_refused() {
        let near = Lights {
            points: vec![PointLight { position: Vec3::Y, intensity: [1.0; 3] }],
            ..Lights::default()
        };
        let brdf = steradian_brdf::parse("lambert").expect("a spec");
        for (method, local, part) in [
            ("sh_irradiance", "vertex_analytic", "rate=pixel"),
            ("sh_irradiance", "precomputed_visibility", "bounces=0,shadow=none"),
            ("reference", "banks_table", "`local`"),
        ] {
            let method = Method::find(method).expect("known");
            let local = Local::parse(local).expect("known");
            let request = Request { local, ..Request::new(near.clone(), brdf.clone(), method) };
            let why = Session::new().eval(&request, &points()).expect_err("refused").to_string();
            assert!(why.contains(part), "{why}");
        }
    }
}
