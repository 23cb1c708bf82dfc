//! Facts of saved bakes and their tables.

use crate::{Adjust, Error, Local, Session};
use std::collections::BTreeMap;
use std::path::Path;
use steradian_base::{Certificate, ParamValues};
use steradian_formats::{TensorFile, read_ktx2_array, read_tensors};
use steradian_techniques::{Card, IN_FOLDER, Made, SavedLocal};

/// A tensor of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TensorFacts {
    /// Its name.
    pub name: String,
    /// Its shape, slowest dimension first.
    pub shape: Vec<usize>,
    /// Its size in bytes.
    pub bytes: usize,
}

/// Facts of a saved bake.
#[derive(Debug, Clone)]
pub struct BakeFacts {
    /// The technique.
    pub card: &'static Card,
    /// The inputs that it was made from.
    pub made: Made,
    /// All parameters, defaults included.
    pub params: ParamValues,
    /// Bytes that shading reads.
    pub bytes: usize,
    /// The error, and how it is known.
    pub certificate: Certificate,
    /// Tensors in the file.
    pub tensors: Vec<TensorFacts>,
    /// Metadata of the file.
    pub metadata: BTreeMap<String, String>,
}

/// What a saved bake of a technique for directional and point lights is.
#[derive(Debug, Clone)]
pub struct LocalBakeFacts {
    /// The technique.
    pub card: &'static Card,
    /// Spec of the reflectance; files appear without their folders.
    pub brdf: String,
    /// All parameters, defaults included.
    pub params: ParamValues,
    /// Bytes that shading reads.
    pub bytes: usize,
    /// The error, and how it is known.
    pub certificate: Certificate,
    /// What the file holds.
    pub tensors: Vec<TensorFacts>,
    /// What it says of itself.
    pub metadata: BTreeMap<String, String>,
}

/// What an array of images holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ArrayContent {
    /// One table of a bake.
    Table {
        /// The technique's slug.
        technique: String,
        /// The table's name, as in the technique's shader.
        table: String,
    },
    /// Horizons of a height map's texels, in this form.
    Horizons(String),
    /// The file does not say.
    Images,
}

/// Facts of a texture that holds an array of images.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArrayFacts {
    /// Content of the images.
    pub content: ArrayContent,
    /// Texels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Layers.
    pub layers: usize,
    /// Metadata of the file.
    pub metadata: BTreeMap<String, String>,
}

impl ArrayFacts {
    /// Metadata under `steradian.KEY`.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.metadata.get(&format!("steradian.{key}")).map(String::as_str)
    }
}

/// Is this the name of tensors, or a folder that holds a bake?
pub fn is_bake(what: &str) -> bool {
    what.to_lowercase().ends_with(".safetensors") || Path::new(what).join(IN_FOLDER).is_file()
}

/// The tensors of a file.
pub(super) fn tensors(file: &TensorFile) -> Vec<TensorFacts> {
    let facts = |(name, t): (&String, &steradian_formats::Tensor)| TensorFacts {
        name: name.clone(),
        shape: t.shape.clone(),
        bytes: t.data.bytes(),
    };
    file.tensors.iter().map(facts).collect()
}

impl Session {
    /// Facts of a saved bake.
    pub fn inspect_bake(&mut self, path: &Path) -> Result<BakeFacts, Error> {
        let file = self.saved_bake(path, &Adjust::default())?;
        let bake = file.open()?;
        Ok(BakeFacts {
            card: bake.card(),
            params: bake.params(),
            bytes: bake.bytes(),
            certificate: bake.certificate().clone(),
            tensors: tensors(&file.tensors),
            metadata: file.tensors.metadata.clone(),
            made: file.made,
        })
    }

    /// What a saved bake of a technique for directional and point lights is; `None` where `path` is something
    /// else.
    pub fn inspect_local_bake(&mut self, path: &Path) -> Result<Option<LocalBakeFacts>, Error> {
        if !Local::is_file(&path.to_string_lossy()) || !path.is_file() {
            return Ok(None);
        }
        let tensors = read_tensors(path, &self.limits())?;
        if !SavedLocal::is_one(&tensors) {
            return Ok(None);
        }
        let file = SavedLocal::of(path, tensors)?;
        self.note_input(path);
        let tensors = file.tensors.into_iter().map(|(name, shape, bytes)| TensorFacts { name, shape, bytes });
        Ok(Some(LocalBakeFacts {
            card: file.bake.card(),
            brdf: file.brdf,
            params: file.bake.params(),
            bytes: file.bake.bytes(),
            certificate: file.bake.certificate().clone(),
            tensors: tensors.collect(),
            metadata: file.metadata,
        }))
    }

    /// What a texture is that holds a table of a bake, horizons or several images; `None` where it holds
    /// something else, or cannot be read as an array.
    pub fn inspect_array(&mut self, path: &Path) -> Option<ArrayFacts> {
        let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ktx2"));
        if !named || !path.is_file() {
            return None;
        }
        let array = read_ktx2_array(path, &self.limits()).ok()?;
        let said = |key: &str| array.get(key).map(String::from);
        let content = match (said("steradian.technique"), said("steradian.table"), said("steradian.horizons"))
        {
            (Some(technique), Some(table), _) => ArrayContent::Table { technique, table },
            (_, _, Some(numbers)) => ArrayContent::Horizons(numbers),
            _ if array.layers > 1 => ArrayContent::Images,
            _ => return None,
        };
        self.note_input(path);
        let (width, height, layers) = (array.width, array.height, array.layers);
        let metadata = array.metadata.into_iter().collect();
        Some(ArrayFacts { content, width, height, layers, metadata })
    }
}
