//! Transfer as named tensors with metadata.

use crate::{Products, Recovery, Settings, Site, Transfer, TransferError};
use std::path::Path;
use steradian_base::{Input, Task};
use steradian_formats::{Tensor, TensorData, TensorFile};
use steradian_parallel::prelude::*;
use steradian_scene::Mesh;

/// Why tensors are no transfer, or not that of a mesh.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FileError {
    /// Tensors of something else.
    #[error("holds no transfer: steradian transfer writes one")]
    NoTransfer,
    /// An entry or a tensor is missing or damaged.
    #[error("damaged transfer: '{0}' is missing or not what it should be")]
    Damaged(String),
    /// It was made of another mesh.
    #[error("transfer of another mesh: its digest is {file}…, that of this mesh {mesh}…")]
    OtherMesh {
        /// The beginning of the file's digest.
        file: String,
        /// The beginning of the mesh's.
        mesh: String,
    },
    /// It has too few bands.
    #[error("transfer of {file} bands, where {asked} are asked for")]
    Bands {
        /// Bands of the file.
        file: usize,
        /// Bands of the request.
        asked: usize,
    },
}

/// Metadata key and version of the file form.
const FORM: (&str, &str) = ("steradian.transfer", "1");
/// Metadata key of the number of rays per site, where that was set.
const RAYS: &str = "steradian.rays";

/// Transfer with a record of its inputs, as a file holds it.
///
/// Tensors: `t` (sites, channels, bands²), `v` (sites, wide²), `ao` (sites), `bent` (sites, 3), `error`
/// (sites, 2), and optionally `h` (sites, bands²), visibility by least squares over the hemisphere, and `m`
/// (sites, bands², bands²), the matrices of glossy transfer ([`Saved::matrices`]). A tensor of 8-bit whole
/// numbers has its scale beside it: a number times the element of `NAME.scale` at its place in the last index
/// is the value ([`Saved::tensors_of_bytes`]).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Saved {
    /// The data.
    pub transfer: Transfer,
    /// Sites, bands² coefficients of the function that is nearest to V over the hemisphere above a site
    /// ([`Saved::project_on_hemispheres`]).
    pub hemisphere: Option<Vec<f32>>,
    /// Digest of the mesh ([`mesh_digest`]).
    pub mesh: String,
    /// Kind of the sites: `vertices`, `texels WxH` or `points DIGEST` ([`points_kind`]).
    pub sites: String,
    /// Tolerance of t; 0 where a number of rays was set instead.
    pub tolerance: f64,
    /// Number of rays per site, where set instead of a tolerance.
    pub rays: Option<u32>,
    /// Distance that rays start off the surface.
    pub offset: f32,
    /// Albedo of each material slot.
    pub albedo: Vec<[f64; 3]>,
}

impl Saved {
    /// Transfer of `mesh`.
    pub fn new(transfer: Transfer, mesh: &Mesh, sites: String, settings: &Settings) -> Self {
        Self {
            transfer,
            hemisphere: None,
            mesh: mesh_digest(mesh),
            sites,
            tolerance: settings.rays.map_or(settings.tolerance, |_| 0.0),
            rays: settings.rays,
            offset: settings.offset,
            albedo: settings.albedo.clone(),
        }
    }

    /// Projects visibility by least squares: [`Recovery::over_hemisphere`], damped by the tolerance, 1e-3 at
    /// least. `sites` are those of the transfer.
    ///
    /// # Errors
    /// If the task was cancelled.
    pub fn project_on_hemispheres(&mut self, sites: &[Site], task: &Task) -> Result<(), TransferError> {
        let x = &self.transfer;
        let n = x.bands * x.bands;
        let recovery = Recovery::over_hemisphere(x.bands, self.tolerance.max(1e-3));
        let mut out = vec![0.0; n * sites.len()];
        task.begin("hemispheres", sites.len() as u64);
        let one = |(k, (to, site)): (usize, (&mut [f32], &Site))| {
            task.check()?;
            if !site.is_absent() {
                let c = recovery.visibility(site.n.as_dvec3().normalize(), &x.visibility(k)[..n]);
                to.iter_mut().zip(c).for_each(|(to, c)| *to = c as f32);
            }
            task.advance(1);
            Ok(())
        };
        let done = out.par_chunks_mut(n).zip(sites).enumerate().try_for_each(one);
        task.end();
        self.hemisphere = Some(out);
        done
    }

    /// The matrices of glossy transfer at `sites`, those of the transfer, whose visibility has 2·bands − 1
    /// bands: bands⁴ numbers a site, made for some sites at a time.
    pub fn matrices(&self, sites: &[Site]) -> impl Iterator<Item = Vec<f32>> {
        // 1 MiB at a time of the most bands, 8.
        const SITES: usize = 64;
        let products = Products::new(self.transfer.bands);
        sites.chunks(SITES).enumerate().map(move |(k, sites)| {
            let one = |(i, site): (usize, &Site)| {
                let m = products.transfer(site.n.as_dvec3(), self.transfer.visibility(k * SITES + i));
                m.into_iter().map(|m| m as f32).collect::<Vec<f32>>()
            };
            sites.par_iter().enumerate().flat_map_iter(one).collect()
        })
    }

    /// The transfer as tensors, without matrices.
    pub fn tensors(&self) -> TensorFile {
        let mut file = TensorFile::default();
        let x = &self.transfer;
        let (sites, n) = (x.len(), x.bands * x.bands);
        let mut put = |name: &str, tensor: Tensor| file.tensors.insert(name.into(), tensor);
        put("t", Tensor::f32([sites, x.channels, n], x.t.clone()));
        if let Some(direct) = &x.direct {
            put("direct", Tensor::f32([sites, n], direct.clone()));
        }
        put("v", Tensor::f32([sites, x.wide * x.wide], x.v.clone()));
        put("ao", Tensor::f32([sites], x.ao.clone()));
        put("bent", Tensor::f32([sites, 3], (0..sites).flat_map(|k| x.bent_normal(k)).collect()));
        put("error", Tensor::f32([sites, 2], x.error.concat()));
        if let Some(h) = &self.hemisphere {
            put("h", Tensor::f32([sites, n], h.clone()));
        }
        file.metadata = self.metadata().into();
        if let Some(rays) = self.rays {
            file.metadata.insert(RAYS.into(), rays.to_string());
        }
        file
    }

    /// [`Saved::tensors`] in 8-bit whole numbers with scales; ambient occlusion, bent normals and errors, few
    /// numbers, become 16-bit floats.
    pub fn tensors_of_bytes(&self) -> TensorFile {
        let mut file = self.tensors();
        for name in ["t", "direct", "v", "h"] {
            if let Some(tensor) = file.tensors.get_mut(name) {
                let (bytes, scale) = tensor.scaled_bytes();
                *tensor = bytes;
                file.tensors.insert(scale_of(name), scale);
            }
        }
        for name in ["ao", "bent", "error"] {
            file.tensors.entry(name.into()).and_modify(|t| t.data = t.data.halved());
        }
        file
    }

    fn metadata(&self) -> [(String, String); 11] {
        let x = &self.transfer;
        let albedo = |a: &[f64; 3]| format!("{}/{}/{}", a[0], a[1], a[2]);
        [
            (FORM.0, FORM.1.into()),
            ("steradian.mesh", self.mesh.clone()),
            ("steradian.sites", self.sites.clone()),
            ("steradian.bands", x.bands.to_string()),
            ("steradian.wide", x.wide.to_string()),
            ("steradian.bounces", x.bounces.to_string()),
            ("steradian.albedo", self.albedo.iter().map(albedo).collect::<Vec<_>>().join(" ")),
            ("steradian.tolerance", self.tolerance.to_string()),
            ("steradian.offset", self.offset.to_string()),
            ("steradian.enclosed", x.enclosed.len().to_string()),
            (
                "steradian.basis",
                "real orthonormal SH over world axes, index l²+l+m, Y(1,-1) = 0.488603 y; t = ∫V(n·w)Y without albedo or 1/π, v = ∫VY over n·w > 0".into(),
            ),
        ]
        .map(|(k, v)| (k.into(), v))
    }

    /// Is this a file of transfer?
    pub fn is_one(file: &TensorFile) -> bool {
        file.metadata.get(FORM.0).is_some_and(|f| f == FORM.1)
    }

    /// Reads what [`Saved::tensors`] returns.
    pub fn read(file: &TensorFile) -> Result<Self, FileError> {
        if !Self::is_one(file) {
            return Err(FileError::NoTransfer);
        }
        let damaged = |name: &str| FileError::Damaged(name.into());
        let text = |key: &str| file.metadata.get(key).ok_or_else(|| damaged(key));
        let number =
            |key: &str| text(key)?.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| damaged(key));
        let count = |key: &str| {
            text(key)?.parse::<usize>().ok().filter(|n| (1..=64).contains(n)).ok_or_else(|| damaged(key))
        };
        let (bands, wide) = (count("steradian.bands")?, count("steradian.wide")?);
        let tensor = |name: &str| file.tensors.get(name).ok_or_else(|| damaged(name));
        let sites = *tensor("t")?.shape.first().ok_or_else(|| damaged("t"))?;
        let channels =
            *tensor("t")?.shape.get(1).filter(|c| matches!(c, 1 | 3)).ok_or_else(|| damaged("t"))?;
        let values = |name: &str, shape: &[usize]| {
            let t = tensor(name)?;
            let mut v = t.data.to_f32().into_owned();
            if matches!(t.data, TensorData::I8(_)) {
                let scale = tensor(&scale_of(name))?;
                if scale.data.is_empty() || Some(&scale.data.len()) != t.shape.last() {
                    return Err(damaged(&scale_of(name)));
                }
                v.iter_mut().zip(scale.data.to_f32().iter().cycle()).for_each(|(v, s)| *v *= s);
            }
            let fits = t.shape == shape
                && v.len() == shape.iter().product::<usize>()
                && v.iter().all(|x| x.is_finite());
            if fits { Ok(v) } else { Err(damaged(name)) }
        };
        let error = values("error", &[sites, 2])?;
        let albedo = |a: &str| -> Option<[f64; 3]> {
            let v: Vec<f64> = a.split('/').map_while(|x| x.parse().ok()).collect();
            v.try_into().ok()
        };
        Ok(Self {
            transfer: Transfer {
                bands,
                wide,
                channels,
                bounces: text("steradian.bounces")?.parse().map_err(|_| damaged("steradian.bounces"))?,
                t: values("t", &[sites, channels, bands * bands])?,
                direct: match file.tensors.contains_key("direct") {
                    true => Some(values("direct", &[sites, bands * bands])?),
                    false => None,
                },
                v: values("v", &[sites, wide * wide])?,
                ao: values("ao", &[sites])?,
                error: error.as_chunks::<2>().0.to_vec(),
                enclosed: Vec::new(),
                rays: 0,
            },
            hemisphere: match file.tensors.contains_key("h") {
                true => Some(values("h", &[sites, bands * bands])?),
                false => None,
            },
            mesh: text("steradian.mesh")?.clone(),
            sites: text("steradian.sites")?.clone(),
            tolerance: number("steradian.tolerance")?,
            rays: file.metadata.get(RAYS).and_then(|r| r.parse().ok()),
            offset: number("steradian.offset")? as f32,
            albedo: text("steradian.albedo")?
                .split(' ')
                .map(|a| albedo(a).ok_or_else(|| damaged("steradian.albedo")))
                .collect::<Result<_, _>>()?,
        })
    }

    /// Is it the transfer of this mesh, with at least so many bands?
    ///
    /// # Errors
    /// If it is of another mesh, or has fewer bands.
    pub fn fits(&self, mesh: &Mesh, bands: usize) -> Result<(), FileError> {
        let digest = mesh_digest(mesh);
        if digest != self.mesh {
            let short = |d: &str| d.chars().take(12).collect();
            return Err(FileError::OtherMesh { file: short(&self.mesh), mesh: short(&digest) });
        }
        if self.transfer.bands < bands {
            return Err(FileError::Bands { file: self.transfer.bands, asked: bands });
        }
        Ok(())
    }
}

/// Name of the scale of a tensor of 8-bit whole numbers.
pub fn scale_of(name: &str) -> String {
    format!("{name}.scale")
}

/// Kind of given points in [`Saved::sites`], with the beginning of the SHA-256 of their positions and
/// normals.
pub fn points_kind(sites: &[Site]) -> String {
    let bytes: Vec<u8> = sites
        .iter()
        .flat_map(|s| [s.p, s.n])
        .flat_map(|v| v.to_array())
        .flat_map(|x| (x + 0.0).to_le_bytes())
        .collect();
    format!("points {}", &Input::of(Path::new(""), &bytes).sha256[..16])
}

/// SHA-256, in hexadecimal, of the data that visibility depends on: positions, normals and triangles.
pub fn mesh_digest(mesh: &Mesh) -> String {
    let mut bytes = Vec::with_capacity(24 * mesh.positions.len() + 16 * mesh.triangles.len());
    for v in mesh.positions.iter().chain(&mesh.normals) {
        v.to_array().iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    mesh.triangles.iter().flatten().for_each(|i| bytes.extend(i.to_le_bytes()));
    Input::of(Path::new(""), &bytes).sha256
}
