//! Saved bakes: tensors, a record of the inputs that they were made from, and a digest by which damage is
//! found.

use crate::{AnyBake, AnyLocal, AnyTechnique, BakeError, LocalBake, tensors};
use glam::Mat3;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_base::{Hash, Input, without_folders};
use steradian_brdf::{Files, SharedBrdf, parse_with, spec_without_folders};
use steradian_formats::{FormatError, Limits, Tensor, TensorFile, read_tensors};
use steradian_light::sky;
use steradian_scene::Mesh;
use steradian_transfer::mesh_digest;

/// The reason why a file is not a bake that can be used.
#[derive(Debug, thiserror::Error)]
pub enum SavedError {
    /// The file itself.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// It is no saved bake, is of an unknown technique, or is damaged.
    #[error("{}: {why}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// The fault, and what to do.
        why: String,
    },
    /// Its technique cannot load it.
    #[error("{}: {source}", path.display())]
    Bake {
        /// The file.
        path: PathBuf,
        /// Why.
        source: BakeError,
    },
}

/// The complete bake in a folder of outputs.
pub const IN_FOLDER: &str = "bake.safetensors";

const TECHNIQUE: &str = "steradian.technique";
/// Key of the digest by which damage is found.
pub const DIGEST: &str = "steradian.digest";
const INPUT: &str = "steradian.input.";
const BRDF: &str = "steradian.brdf";
const ENVIRONMENT: &str = "steradian.environment";
const ROTATE: &str = "steradian.environment.rotate";
const EXPOSURE: &str = "steradian.environment.light_exposure";
const MESH: &str = "steradian.mesh";
const VERTICES: &str = "steradian.mesh.vertices";

/// The mesh whose vertices a bake has data for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BakedMesh {
    /// Digest of the mesh ([`steradian_transfer::mesh_digest`]).
    pub digest: String,
    /// Number of vertices of the mesh.
    pub vertices: usize,
}

impl BakedMesh {
    /// The record of a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        Self { digest: mesh_digest(mesh), vertices: mesh.positions.len() }
    }

    /// Is it the mesh that `mesh` begins with? Other meshes, such as a ground, may follow it.
    pub fn begins(&self, mesh: &Mesh) -> bool {
        let n = self.vertices;
        if mesh.positions.len() < n || mesh.normals.len() < n {
            return false;
        }
        let own = |t: &&[u32; 3]| t.iter().all(|i| (*i as usize) < n);
        let first = Mesh {
            positions: mesh.positions[..n].to_vec(),
            normals: mesh.normals[..n].to_vec(),
            triangles: mesh.triangles.iter().filter(own).copied().collect(),
            ..Mesh::default()
        };
        Self::of(&first) == *self
    }
}

/// The inputs of a bake, as its file records them; file names are without folders.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Made {
    /// Spec of the reflectance.
    pub brdf: String,
    /// Name of the light's file, or the sky's spec.
    pub environment: String,
    /// Rotation of the light about +Y, degrees.
    pub rotate: f64,
    /// Exposure value by which it was scaled.
    pub exposure: f64,
    /// Contents of the files that the reflectance's spec names ([`steradian_brdf::Brdf::held`]).
    pub held: Option<Vec<f64>>,
    /// The mesh, of a technique that bakes on one.
    pub mesh: Option<BakedMesh>,
}

impl Made {
    /// A record of these inputs.
    pub fn of(brdf: &str, held: Option<Vec<f64>>, environment: &str, rotate: f64, exposure: f64) -> Self {
        Self {
            brdf: spec_without_folders(brdf),
            held,
            environment: name_of_light(environment),
            rotate,
            exposure,
            mesh: None,
        }
    }

    /// Writes it into a bake.
    pub fn save(&self, to: &mut TensorFile) {
        to.metadata.extend(self.pairs());
        if let Some(m) = &self.mesh {
            to.metadata.insert(MESH.into(), m.digest.clone());
            to.metadata.insert(VERTICES.into(), m.vertices.to_string());
        }
        if let Some(held) = &self.held {
            to.tensors.insert(BRDF.into(), Tensor::f64([held.len()], held.clone()));
        }
    }

    /// For a file's metadata.
    fn pairs(&self) -> [(String, String); 4] {
        [
            (BRDF, self.brdf.clone()),
            (ENVIRONMENT, self.environment.clone()),
            (ROTATE, self.rotate.to_string()),
            (EXPOSURE, self.exposure.to_string()),
        ]
        .map(|(k, v)| (k.into(), v))
    }

    fn read(from: &TensorFile) -> Self {
        let text = |key: &str| from.metadata.get(key).cloned().unwrap_or_default();
        let number = |key: &str| text(key).parse().ok().filter(|v: &f64| v.is_finite()).unwrap_or(0.0);
        Self {
            brdf: text(BRDF),
            environment: text(ENVIRONMENT),
            rotate: number(ROTATE),
            exposure: number(EXPOSURE),
            mesh: text(VERTICES).parse().ok().map(|vertices| BakedMesh { digest: text(MESH), vertices }),
            held: from.tensors.get(BRDF).map(|t| t.data.to_f64().into_owned()),
        }
    }
}

/// A saved bake that was checked: it opens.
pub struct SavedBake {
    /// The file.
    pub path: PathBuf,
    /// Its technique.
    pub technique: &'static dyn AnyTechnique,
    /// The inputs that it was made from.
    pub made: Made,
    /// Rotation of its light where it is used; the identity when it is read.
    pub turn: Mat3,
    /// All of it.
    pub tensors: TensorFile,
}

impl SavedBake {
    /// Reads `path`, a `.safetensors` file or a folder that holds one. It opens no other file.
    pub fn read(path: &Path, limits: &Limits) -> Result<Self, SavedError> {
        let path = if path.is_dir() { path.join(IN_FOLDER) } else { path.into() };
        let bad = |why: &str| SavedError::Invalid { path: path.clone(), why: why.into() };
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ktx2")) {
            return Err(bad("a texture holds a bake's maps only: `bake` takes a .safetensors file"));
        }
        let tensors = read_tensors(&path, limits).map_err(|e| match e {
            FormatError::Invalid { .. } if !is_named_so(&path) => {
                bad("is no bake: `bake` takes a .safetensors file of steradian bake, or the folder of one")
            }
            e => e.into(),
        })?;
        let Some(slug) = tensors.metadata.get(TECHNIQUE) else {
            return Err(bad("holds tensors but no bake: steradian bake writes one"));
        };
        if crate::find_local(slug).is_some() {
            return Err(bad(&format!(
                "a bake of {slug}, for directional and point lights: `local` takes it"
            )));
        }
        let Some(technique) = crate::find(slug) else {
            return Err(bad(&format!("a bake of '{slug}', which this version does not know")));
        };
        if !is_whole(&tensors) {
            return Err(bad("damaged: it is not what was written; bake it again"));
        }
        if let Some(name) = not_finite(&tensors) {
            return Err(bad(&format!("tensor '{name}' has values that are not finite; bake it again")));
        }
        let made = Made::read(&tensors);
        let file = Self { path, technique, made, turn: Mat3::IDENTITY, tensors };
        file.open()?;
        Ok(file)
    }

    /// [`AnyTechnique::needs_view`] with the parameters that it was baked with.
    pub fn needs_view(&self) -> bool {
        let params = tensors::params(&self.tensors, self.technique.params());
        params.map_or(self.technique.card().needs.view, |p| self.technique.needs_view(&p))
    }

    /// The bake.
    pub fn open(&self) -> Result<Box<dyn AnyBake>, SavedError> {
        let path = self.path.clone();
        self.technique.load(&self.tensors).map_err(|e| match e {
            // Parameters out of range came from the file, not from a user.
            BakeError::Param(_) => SavedError::Invalid { path, why: format!("damaged: {e}") },
            source => SavedError::Bake { path, source },
        })
    }

    /// The reflectance that the file names; `None` where that needs files that it does not keep: it opens
    /// none.
    pub fn brdf(&self) -> Option<SharedBrdf> {
        let files = self.made.held.as_deref().map_or(Files::None, Files::Held);
        parse_with(&self.made.brdf, files).ok()
    }

    /// File name without folders.
    pub fn name(&self) -> String {
        self.path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
    }

    /// Does `spec`, in canonical form, differ from the reflectance that was baked?
    pub fn is_of_another_brdf(&self, spec: &str) -> bool {
        self.brdf().is_some_and(|b| spec_without_folders(&b.spec()) != spec_without_folders(spec))
    }

    /// Is `spec` the light of this bake: the sky of the same spec, or a file with the same content?
    pub fn was_made_of(&self, spec: &str) -> bool {
        if sky::is_name(spec) {
            return name_of_light(spec) == self.made.environment;
        }
        let digest =
            |path: &str| Input::of_file(Path::new(path)).ok().map(|i| format!("sha256:{}", i.sha256));
        let files: Option<Vec<String>> =
            if Path::new(spec).exists() { vec![spec] } else { spec.split(',').collect() }
                .into_iter()
                .map(digest)
                .collect();
        match files {
            Some(digests) => same_files(&self.tensors.metadata, &self.made.environment, &digests),
            // A spec that names no single file (a pattern of names) is compared by name.
            None => name_of_light(spec) == self.made.environment,
        }
    }
}

/// A saved bake of a technique for directional and point lights.
pub struct SavedLocal {
    /// The file.
    pub path: PathBuf,
    /// Its technique.
    pub technique: &'static dyn AnyLocal,
    /// The bake.
    pub bake: Arc<dyn LocalBake>,
    /// Spec of the reflectance that it was made of; files appear without their folders.
    pub brdf: String,
    /// What it says of itself.
    pub metadata: BTreeMap<String, String>,
    /// Name, shape and bytes of each of its tensors.
    pub tensors: Vec<(String, Vec<usize>, usize)>,
}

impl SavedLocal {
    /// Do tensors say that they are a bake of such a technique?
    pub fn is_one(tensors: &TensorFile) -> bool {
        let slug = tensors.metadata.get(TECHNIQUE);
        slug.is_some_and(|s| crate::find(s).is_none() && crate::find_local(s).is_some())
    }

    /// Reads `path`, a `.safetensors` file. It opens no other file.
    pub fn read(path: &Path, limits: &Limits) -> Result<Self, SavedError> {
        Self::of(path, read_tensors(path, limits)?)
    }

    /// Of the tensors of the file `path`.
    pub fn of(path: &Path, tensors: TensorFile) -> Result<Self, SavedError> {
        let bad = |why: String| SavedError::Invalid { path: path.into(), why };
        let Some(slug) = tensors.metadata.get(TECHNIQUE) else {
            return Err(bad("holds tensors but no bake: a bake with `local` writes one".into()));
        };
        let Some(technique) = crate::find_local(slug) else {
            return Err(bad(format!(
                "a bake of '{slug}', which is no technique for directional and point lights"
            )));
        };
        if !is_whole(&tensors) {
            return Err(bad("damaged: it is not what was written; bake it again".into()));
        }
        if let Some(name) = not_finite(&tensors) {
            return Err(bad(format!("tensor '{name}' has values that are not finite; bake it again")));
        }
        let made = Made::read(&tensors);
        let files = made.held.as_deref().map_or(Files::None, Files::Held);
        let brdf = parse_with(&made.brdf, files).map_err(|e| bad(format!("damaged: {e}")))?;
        let bake = technique.load(&tensors, brdf).map_err(|e| match e {
            BakeError::Param(_) => bad(format!("damaged: {e}")),
            source => SavedError::Bake { path: path.into(), source },
        })?;
        let facts = tensors.tensors.iter();
        let facts = facts.map(|(name, t)| (name.clone(), t.shape.clone(), t.data.bytes()));
        Ok(Self {
            path: path.into(),
            technique,
            bake: bake.into(),
            brdf: made.brdf.clone(),
            tensors: facts.collect(),
            metadata: tensors.metadata,
        })
    }
}

/// Do the files that `environment` names have these digests, in this order? They may have been renamed since.
fn same_files(metadata: &BTreeMap<String, String>, environment: &str, digests: &[String]) -> bool {
    let of = |name: &str| metadata.get(&format!("{INPUT}{name}"));
    let whole = of(environment).map(|d| vec![d]);
    let recorded = whole.or_else(|| environment.split(',').map(of).collect());
    recorded.is_some_and(|r| r.len() == digests.len() && r.into_iter().eq(digests))
}

/// A light's spec without folders; several files are separated by commas.
fn name_of_light(spec: &str) -> String {
    if sky::is_name(spec) || Path::new(spec).exists() {
        return without_folders(spec);
    }
    spec.split(',').map(without_folders).collect::<Vec<_>>().join(",")
}

/// Adds the digest by which damage is found to the metadata that the tensors are written with.
pub fn seal(tensors: &TensorFile, metadata: &mut BTreeMap<String, String>) {
    metadata.remove(DIGEST);
    let digest = digest(tensors, metadata);
    metadata.insert(DIGEST.into(), digest);
}

/// Is the file undamaged? Files that record their inputs carry a digest; a bare [`AnyBake::save`] has
/// neither.
fn is_whole(t: &TensorFile) -> bool {
    match t.metadata.get(DIGEST) {
        Some(d) => {
            let mut rest = t.metadata.clone();
            rest.remove(DIGEST);
            *d == digest(t, &rest)
        }
        None => ![BRDF, ENVIRONMENT, ROTATE, EXPOSURE].iter().any(|k| t.metadata.contains_key(*k)),
    }
}

fn is_named_so(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("safetensors"))
}

/// Digest of the tensors and of all other metadata.
fn digest(t: &TensorFile, metadata: &BTreeMap<String, String>) -> String {
    let mut hash = Hash::default();
    // Tensors whose shapes do not fit are refused when they are written.
    let _ = t.encode_as(metadata, &mut hash);
    format!("sha256:{}", hash.hex())
}

/// The first tensor that holds NaN or infinity.
pub fn not_finite(t: &TensorFile) -> Option<&str> {
    t.tensors.iter().find(|(_, x)| !x.data.is_finite()).map(|(name, _)| name.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sealed(t: &mut TensorFile) {
        let mut metadata = t.metadata.clone();
        seal(t, &mut metadata);
        t.metadata = metadata;
    }

    #[test]
    fn a_seal_breaks_with_one_bit() {
        let mut t = TensorFile::default();
        t.tensors.insert("a".into(), Tensor::f32([2], vec![1.0, 2.0]));
        sealed(&mut t);
        assert!(is_whole(&t));
        t.metadata.insert("other".into(), "text".into());
        assert!(!is_whole(&t));
        sealed(&mut t);
        assert!(is_whole(&t));
        t.tensors.insert("a".into(), Tensor::f32([2], vec![1.0, 2.0000002]));
        assert!(!is_whole(&t));
        assert_eq!(not_finite(&t), None);
        t.tensors.insert("b".into(), Tensor::f64([1], vec![f64::NAN]));
        assert_eq!(not_finite(&t), Some("b"));
    }

    #[test]
    fn a_file_that_says_what_it_was_made_of_has_a_digest() {
        let mut t = TensorFile::default();
        assert!(is_whole(&t), "a library's");
        t.metadata.extend(Made::default().pairs());
        assert!(!is_whole(&t));
        sealed(&mut t);
        assert!(is_whole(&t));
        let seal = t.metadata.remove(DIGEST).unwrap();
        t.metadata.insert("steradian.digesu".into(), seal);
        assert!(!is_whole(&t));
    }

    #[test]
    fn lights_are_known_by_the_content_and_the_order_of_their_files() {
        let input = |name: &str, digest: &str| (format!("{INPUT}{name}"), digest.to_string());
        let metadata = [input("front.hdr", "1"), input("back.hdr", "2"), input("a,b.hdr", "3")].into();
        let same = |environment: &str, digests: &[&str]| {
            same_files(&metadata, environment, &digests.iter().map(|d| d.to_string()).collect::<Vec<_>>())
        };
        assert!(same("front.hdr,back.hdr", &["1", "2"]) && same("a,b.hdr", &["3"]));
        assert!(!same("front.hdr,back.hdr", &["2", "1"]) && !same("front.hdr,back.hdr", &["1"]));
        assert!(!same("front.hdr", &["2"]) && !same("none.hdr", &["1"]));
    }

    #[test]
    fn what_it_was_made_of_names_no_folders() {
        let made = Made::of("merl:/a/b.binary", Some(vec![0.5]), "/lights/beach.hdr", 30.0, 0.0);
        assert_eq!((made.brdf.as_str(), made.environment.as_str()), ("merl:b.binary", "beach.hdr"));
        let mut t = TensorFile::default();
        made.save(&mut t);
        assert_eq!(Made::read(&t), made);
        let halves = Made::of("lambert", None, "/lights/front.hdr,/lights/back.hdr", 30.0, 0.0);
        assert_eq!(halves.environment, "front.hdr,back.hdr");
        let triple = Made::of("ggx:alpha=0.2,f0=1/0.8/0.3", None, "sky:elevation=30", 30.0, 0.0);
        assert_eq!(triple.brdf, "ggx:alpha=0.2,f0=1/0.8/0.3");
    }
}
