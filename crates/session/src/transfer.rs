//! Transfer: a mesh, and the visibility and light transport of each of its sites.

use crate::columns::unit;
use crate::inputs::{check_shape, is_shape};
use crate::{Error, Outcome, Session};
use glam::DVec3;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use steradian_base::ParamValues;
use steradian_engines::{VertexNumbers, glb};
use steradian_formats::{
    CsvTable, Tensor, TensorFile, TensorNumbers, TensorParts, read_tensors, write_atomic, write_tensors,
    write_tensors_with,
};
use steradian_scene::Mesh;
use steradian_techniques::AnyTechnique;
use steradian_transfer::{
    BLOCK, Saved, Scene, Settings, Site, Store, TransferError, key, mesh_digest, points_kind, scale_of,
    transfer,
};

/// The places that get transfer.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// Every vertex.
    Vertices,
    /// Every texel of an atlas: width and height.
    Texels(usize, usize),
    /// Given points.
    Points(Vec<Site>),
}

/// Request for a computation of transfer.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// A built-in shape or a mesh file.
    pub mesh: String,
    /// Where.
    pub places: Places,
    /// Quantities and accuracy; its albedo is replaced by that of the slots.
    pub settings: Settings,
    /// Albedo of the surfaces that reflect, which the mean of a base-colour texture multiplies; `None` takes
    /// the base colours of the mesh's file.
    pub albedo: Option<[f64; 3]>,
    /// Is visibility also projected by least squares over the hemisphere?
    pub hemisphere: bool,
    /// Was a tolerance given? Only then does exceeding it count as a miss.
    pub asked: bool,
    /// Output file; finished blocks are kept next to it until it is written.
    pub output: Option<PathBuf>,
}

/// Transfer, and the inputs that it was made from.
pub struct Done {
    /// The data.
    pub saved: Saved,
    /// The mesh.
    pub mesh: Mesh,
    /// The sites.
    pub sites: Vec<Site>,
    /// Seconds that it took.
    pub seconds: f64,
    /// Blocks that an interrupted computation had left.
    pub resumed: usize,
    store: Option<Store>,
}

impl Places {
    /// The points of a table with the columns px,py,pz and nx,ny,nz.
    pub fn of_table(table: &CsvTable) -> Result<Self, Error> {
        let n = unit(table, ["nx", "ny", "nz"])?;
        let p = table.vectors(["px", "py", "pz"])?;
        let site = |(p, n): ([f64; 3], DVec3)| Site { p: p.map(|x| x as f32).into(), n: n.as_vec3() };
        Ok(Self::Points(p.into_iter().zip(n).map(site).collect()))
    }
}

impl Done {
    /// Adds ao, t0 …, v0 … and, where present, h0 … to the table of the points; for interreflection in colour
    /// t is tr0 …, tg0 …, tb0 ….
    pub fn add_columns(&self, table: &mut CsvTable) {
        let x = &self.saved.transfer;
        let (sites, n) = (0..x.len(), x.bands.pow(2));
        table.set_column("ao", x.ao.iter().map(|a| f64::from(*a)));
        for c in 0..x.channels {
            let name = if x.channels == 1 { "t" } else { ["tr", "tg", "tb"][c] };
            for i in 0..n {
                table.set_column(&format!("{name}{i}"), sites.clone().map(|k| f64::from(x.vector(k, c)[i])));
            }
        }
        for i in 0..n {
            table.set_column(&format!("v{i}"), sites.clone().map(|k| f64::from(x.visibility(k)[i])));
        }
        for (i, h) in self.saved.hemisphere.iter().flat_map(|h| (0..n).map(move |i| (i, h))) {
            table.set_column(&format!("h{i}"), sites.clone().map(|k| f64::from(h[k * n + i])));
        }
    }

    /// Report as JSON.
    pub fn document(&self) -> Value {
        let x = &self.saved.transfer;
        let [t, v] = x.worst_error();
        json!({
            "sites": x.len(),
            "places": self.saved.sites,
            "bands": x.bands,
            "channels": x.channels,
            "bounces": x.bounces,
            "mesh_digest": self.saved.mesh,
            "rays": x.rays,
            "enclosed": x.enclosed.len(),
            "error_t": t,
            "error_v": v,
            "resumed_blocks": self.resumed,
            "seconds": self.seconds,
        })
    }
}

impl From<TransferError> for Error {
    fn from(e: TransferError) -> Self {
        match e {
            TransferError::Cancelled(c) => c.into(),
            e => Self::Transfer(e),
        }
    }
}

impl Session {
    /// Light transport at the places of a mesh.
    pub fn transfer(&mut self, request: &Request) -> Result<Outcome<Done>, Error> {
        let start = Instant::now();
        let (mesh, albedo) = self.reflecting(request)?;
        let settings = Settings { albedo, ..request.settings.clone() };
        let scene = Scene::new(&mesh).map_err(|e| Error::input(format!("{}: {e}", request.mesh)))?;
        let (sites, kind) = places(&request.places, &mesh, &request.mesh, self)?;
        self.check()?;
        let store = match &request.output {
            Some(path) => Some(Store::open(path, &key(&scene, &sites, &settings))?),
            None => None,
        };
        let resumed = store.as_ref().map_or(0, Store::found);
        if resumed > 0 {
            self.say(format_args!("goes on after {resumed} of {} blocks", sites.len().div_ceil(BLOCK)));
        }
        let result = transfer(&scene, &sites, &settings, store.as_ref(), &self.task)?;
        self.tell_enclosed(&result.enclosed, sites.len(), &request.mesh);
        let [t, v] = result.worst_error();
        self.note_error(format!("coefficients of t {t:.1e} and of v {v:.1e} (estimated)"));
        let reached = t.max(0.2 * v);
        let asked = (request.asked && settings.rays.is_none()).then_some(settings.tolerance);
        let mut saved = Saved::new(result, &mesh, kind, &settings);
        if request.hemisphere {
            saved.project_on_hemispheres(&sites, &self.task)?;
        }
        let seconds = start.elapsed().as_secs_f64();
        drop(scene);
        Ok(Outcome::new(Done { saved, mesh, sites, seconds, resumed, store }, asked, reached))
    }

    fn tell_enclosed(&self, enclosed: &[u32], sites: usize, mesh: &str) {
        if let Some(first) = enclosed.first() {
            let n = enclosed.len();
            let what = format!(
                "{n} of {sites} sites see nothing, the first is site {first}: they lie inside the solid, and theirs is zero"
            );
            self.warn(mesh, what);
        }
    }

    /// Writes transfer in numbers of `bits` (8, 16, 32): to a .glb file as attributes of the mesh's vertices,
    /// to any other as tensors with their provenance, of whole numbers with scales for 8 and of halves for
    /// 16. Removes the data kept for resuming after an interruption.
    pub fn write_transfer(&mut self, done: Done, bits: u32, path: &Path) -> Result<(), Error> {
        self.spares(path)?;
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb")) {
            let numbers = VertexNumbers::of_bits(bits)
                .ok_or_else(|| Error::usage(format!("numbers have 8, 16 or 32 bits, not {bits}")))?;
            let bytes = glb(&done.mesh, &done.saved.transfer, numbers);
            let bytes = bytes.map_err(|e| Error::usage(e.to_string()))?;
            write_atomic(path, |w| w.write_all(&bytes))?;
            return self.finish_transfer(done);
        }
        let numbers = match bits {
            8 => TensorNumbers::I8,
            16 => TensorNumbers::F16,
            32 => TensorNumbers::F32,
            _ => return Err(Error::usage(format!("numbers have 8, 16 or 32 bits, not {bits}"))),
        };
        let mut file = match numbers {
            TensorNumbers::I8 => done.saved.tensors_of_bytes(),
            _ => done.saved.tensors(),
        };
        file.metadata.extend(self.provenance_pairs());
        if numbers == TensorNumbers::F16 {
            file.tensors.values_mut().for_each(|t| t.data = t.data.halved());
        }
        let (sites, n) = (done.sites.len(), done.saved.transfer.bands.pow(2));
        if done.saved.transfer.wide > done.saved.transfer.bands {
            // The matrices would take more memory than everything else, and are therefore written in parts.
            if numbers == TensorNumbers::I8 {
                // |∫ V Y_i Y_j dw| ≤ 1.
                file.tensors.insert(scale_of("m"), Tensor::f32([n], vec![1.0 / 127.0; n]));
            }
            self.task.begin("matrices", sites as u64);
            let mut parts = done.saved.matrices(&done.sites).map(|m| {
                self.task.check().map_err(std::io::Error::other)?;
                self.task.advance((m.len() / (n * n)) as u64);
                Ok(m)
            });
            let made = TensorParts { name: "m", shape: &[sites, n, n], numbers, parts: &mut parts };
            let written = write_tensors_with(path, &file, made);
            self.task.end();
            // An interruption is not reported as an error of the file.
            self.check()?;
            written?;
        } else {
            write_tensors(path, &file)?;
        }
        self.finish_transfer(done)
    }

    /// Removes the data kept for resuming after an interruption, once the result is saved.
    pub fn finish_transfer(&self, done: Done) -> Result<(), Error> {
        done.store.map_or(Ok(()), |s| Ok(s.finish()?))
    }

    /// Transfer from a file; `None` where it holds something else.
    pub fn saved_transfer(&mut self, path: &Path) -> Result<Option<(Saved, TensorFile)>, Error> {
        let file = read_tensors(path, &self.limits())?;
        if !Saved::is_one(&file) {
            return Ok(None);
        }
        self.note_input(path);
        let saved = Saved::read(&file).map_err(|e| Error::input(format!("{}: {e}", path.display())))?;
        Ok(Some((saved, file)))
    }

    /// Transfer of `mesh` from a file, at sites of a kind ([`Saved::sites`]); that of another mesh or of
    /// other sites is refused.
    pub fn transfer_of(&mut self, path: &Path, mesh: &Mesh, kind: &str) -> Result<Arc<Saved>, Error> {
        let Some((saved, _)) = self.saved_transfer(path)? else {
            return Err(Error::input(format!(
                "{}: holds no transfer: steradian transfer writes it",
                path.display()
            )));
        };
        check_fits(&saved, mesh, 1, path)?;
        if saved.sites != kind {
            let why = format!("holds transfer of {}, not of {kind}", saved.sites);
            return Err(Error::input(format!("{}: {why}", path.display())));
        }
        Ok(Arc::new(saved))
    }

    /// The mesh, and the albedo of each of its slots.
    fn reflecting(&mut self, request: &Request) -> Result<(Mesh, Vec<[f64; 3]>), Error> {
        let spec = &request.mesh;
        check_shape(spec)?;
        if !is_shape(spec) {
            let loaded = steradian_scene::load(Path::new(spec), &self.limits())?;
            let bad: usize = loaded.reports.iter().map(|r| r.repaired_normals).sum();
            if bad > 0 {
                return Err(Error::input(format!(
                    "{spec}: {bad} normals are zero or not finite: mend them, or write the file without normals"
                )));
            }
        }
        let model = self.model(spec)?;
        let mean = |m: &steradian_render::FileMaterial| {
            m.base_colour.as_ref().map_or([1.0; 3], |t| t.mean().map(|x| f64::from(x).clamp(0.0, 1.0)))
        };
        let base: Vec<[f64; 3]> = model.materials.iter().map(mean).collect();
        let albedo = match request.albedo {
            Some(a) if base.is_empty() => vec![a],
            Some(a) => base.iter().map(|b| [0, 1, 2].map(|c| a[c] * b[c])).collect(),
            None if request.settings.bounces <= 1 => vec![[0.0; 3]],
            None if base.is_empty() => {
                return Err(Error::usage(format!("{spec} has no base colours: say `albedo` with `bounces`")));
            }
            None => base,
        };
        Ok((model.mesh, albedo))
    }
}

fn places(places: &Places, mesh: &Mesh, name: &str, session: &Session) -> Result<(Vec<Site>, String), Error> {
    Ok(match places {
        Places::Vertices => (Site::vertices(mesh), "vertices".into()),
        Places::Points(sites) => (sites.clone(), points_kind(sites)),
        Places::Texels(w, h) => {
            if mesh.uvs.is_empty() {
                return Err(Error::input(format!("{name}: has no texture coordinates for an atlas")));
            }
            let (sites, atlas) = Site::texels(mesh, *w, *h);
            if !atlas.is_whole() {
                return Err(Error::input(format!(
                    "{name}: no atlas of {w} x {h}: {} texels are in more than one triangle, {} triangles have none, {:.1} % \
                     of the surface",
                    atlas.overlapping,
                    atlas.missing,
                    100.0 * atlas.missing_area
                )));
            }
            if atlas.missing > 0 {
                session.say(format_args!(
                    "{name}: {} triangles are smaller than a texel, and have the one about their middle",
                    atlas.missing
                ));
            }
            (sites, format!("texels {w}x{h}"))
        }
    })
}

/// Does a technique with these parameters take transfer of a file?
pub(crate) fn check_reads(technique: &dyn AnyTechnique, params: &ParamValues) -> Result<(), Error> {
    if technique.reads_transfer(params) {
        return Ok(());
    }
    let with = |t: &&&dyn AnyTechnique| t.reads_transfer(&ParamValues::default());
    let others: Vec<&str> =
        steradian_techniques::registry().iter().filter(with).map(|t| t.card().slug).collect();
    let slug = technique.card().slug;
    let why = format!("{slug} takes no transfer of a file with these parameters");
    Err(Error::usage(format!("{why}: leave it out, or choose {}", others.join(", "))))
}

/// Is a saved transfer that of this mesh, with so many bands?
pub fn check_fits(saved: &Saved, mesh: &Mesh, bands: usize, name: &Path) -> Result<(), Error> {
    saved.fits(mesh, bands).map_err(|e| Error::input(format!("{}: {e}", name.display())))
}

/// The beginning of a mesh's digest, for reports.
pub fn short_digest(mesh: &Mesh) -> String {
    mesh_digest(mesh).chars().take(12).collect()
}
