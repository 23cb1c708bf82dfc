//! Output of a bake: tensors, one texture, or a folder with everything that an engine needs.

use super::tables::Map;
use super::{Accuracy, Baked};

use crate::destinations::Destinations;
use crate::{Error, Session};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use steradian_formats::{
    FormatError, Supercompression, TensorFile, TexelFormat, TextureArray, write_atomic, write_dir_atomic,
    write_ktx2_array, write_tensors, write_tensors_as,
};
use steradian_techniques::gpu::{self, Uniform, Value as Number};
use steradian_techniques::tensors::put_f32;
use steradian_techniques::{DIGEST, GpuTechnique, IN_FOLDER};

/// Kind of output that a file name implies.
#[derive(Debug, Clone)]
pub enum Output {
    /// The complete bake.
    Tensors(PathBuf),
    /// The only table of a technique.
    Texture(PathBuf),
    /// All of it.
    Folder(PathBuf),
}

/// A file that was written.
#[derive(Debug, Clone)]
pub struct Written {
    /// Name of the file, without folders.
    pub name: String,
    /// Its size.
    pub bytes: u64,
    /// For a texture: its format, and the relative RMS error that the format adds.
    pub texels: Option<(TexelFormat, f64)>,
}

/// Metadata of a file: keys and values.
type Pairs = BTreeMap<String, String>;

impl Output {
    /// Chooses the form by the extension; a destination that cannot be written is refused here.
    pub fn of(path: &Path) -> Result<Self, Error> {
        let mut places = Destinations::default();
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            _ if path.is_dir() => places.folder(path, false).map(|()| Self::Folder(path.into())),
            Some("safetensors") => places.file("`output`", path).map(|()| Self::Tensors(path.into())),
            Some("ktx2") => places.file("`output`", path).map(|()| Self::Texture(path.into())),
            None => places.folder(path, false).map(|()| Self::Folder(path.into())),
            Some(e) => Err(Error::usage(format!(
                "{}: cannot write '.{e}' files; use .safetensors, .ktx2, or a folder's name",
                path.display()
            ))),
        }
    }

    /// Writes the bake; existing files stay intact until everything is ready.
    pub fn write(
        &self,
        done: &Baked,
        tensors: &TensorFile,
        session: &Session,
    ) -> Result<Vec<Written>, Error> {
        let mut outcome = Pairs::new();
        if let Some((asked, _)) = done.reached() {
            let energy = matches!(done.accuracy, Accuracy::Energy(_));
            let key = if energy { "steradian.energy_epsilon" } else { "steradian.tolerance" };
            let met = if done.missed() { "missed" } else { "met" };
            outcome.insert(key.into(), asked.to_string());
            outcome.insert("steradian.tolerance.outcome".into(), met.into());
        }
        let head = session.sealed(tensors, outcome);
        match self {
            Self::Tensors(path) => {
                write_tensors_as(path, tensors, &head)?;
                Ok(vec![Written::of(path, None)])
            }
            Self::Texture(path) => {
                let map = only(&done.bake.gpu(), path)?;
                Ok(vec![texture(path, map, &head)?])
            }
            Self::Folder(path) => {
                let tables = done.bake.gpu().tables;
                session.spares_in(path, |file| {
                    let named = |name: &str| file == Path::new(name);
                    let others = [IN_FOLDER, "buffers.safetensors", "shade.wgsl", "technique.json"];
                    others.into_iter().any(named) || tables.iter().any(|t| named(&format!("{}.ktx2", t.name)))
                })?;
                folder(path, done, tensors, &head)
            }
        }
    }
}

impl Written {
    fn of(path: &Path, texels: Option<(TexelFormat, f64)>) -> Self {
        let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        Self { name, bytes: std::fs::metadata(path).map_or(0, |m| m.len()), texels }
    }
}

/// The map of a technique that has one.
fn only(technique: &GpuTechnique, path: &Path) -> Result<Map, Error> {
    match technique.tables.as_slice() {
        _ if !technique.buffers.is_empty() => Err(Error::usage(format!(
            "{}: {} has data that are no textures: give a folder, or use .safetensors",
            path.display(),
            technique.slug
        ))),
        [table] => Ok(Map::of(table)),
        [] => Err(Error::usage(format!(
            "{}: {} has no tables, only numbers: use .safetensors",
            path.display(),
            technique.slug
        ))),
        many => {
            let names: Vec<&str> = many.iter().map(|t| t.name).collect();
            Err(Error::usage(format!(
                "{}: {} has the tables {}: give a folder for one file each, or use .safetensors",
                path.display(),
                technique.slug,
                names.join(", ")
            )))
        }
    }
}

fn texture(path: &Path, map: Map, head: &Pairs) -> Result<Written, FormatError> {
    let Map { name, shape, array, format, error } = map;
    let mut metadata = head.clone();
    metadata.remove(DIGEST);
    let own = [("table", name.to_string()), ("table.shape", shape), ("table.rounding", error.to_string())];
    metadata.extend(own.map(|(k, v)| (format!("steradian.{k}"), v)));
    let metadata = metadata.into_iter().collect();
    write_ktx2_array(path, TextureArray { metadata, ..array }, format, Supercompression::None)?;
    Ok(Written::of(path, Some((format, error))))
}

fn folder(path: &Path, done: &Baked, tensors: &TensorFile, head: &Pairs) -> Result<Vec<Written>, Error> {
    let technique = done.bake.gpu();
    let mut written = Vec::new();
    write_dir_atomic(path, |to| {
        let file = to.join(IN_FOLDER);
        write_tensors_as(&file, tensors, head)?;
        written.push(Written::of(&file, None));
        let maps: Vec<Map> = technique.tables.iter().map(Map::of).collect();
        let rows: Vec<Value> = maps.iter().map(row).collect();
        for map in maps {
            let file = to.join(format!("{}.ktx2", map.name));
            written.push(texture(&file, map, head)?);
        }
        if !technique.buffers.is_empty() {
            let file = to.join("buffers.safetensors");
            write_tensors(&file, &buffers(&technique, head))?;
            written.push(Written::of(&file, None));
        }
        let mut text = |name: &str, text: &str| {
            let file = to.join(name);
            write_atomic(&file, |w| w.write_all(text.as_bytes()))?;
            written.push(Written::of(&file, None));
            Ok::<_, FormatError>(())
        };
        text("shade.wgsl", &gpu::library(&technique))?;
        text("technique.json", &numbers(&technique, rows, head))
    })?;
    Ok(written)
}

/// A table in `technique.json`.
fn row(m: &Map) -> Value {
    json!({
        "name": m.name,
        "file": format!("{}.ktx2", m.name),
        "shape": m.shape,
        "width": m.array.width,
        "height": m.array.height,
        "layers": m.array.layers,
        "format": m.format.name(),
        "rounding": m.error,
        "bytes": m.bytes(),
    })
}

/// Data per site: a row each.
fn buffers(technique: &GpuTechnique, head: &Pairs) -> TensorFile {
    let mut t = TensorFile { metadata: head.clone(), ..TensorFile::default() };
    for b in &technique.buffers {
        let rows = b.data.len() / b.stride.max(1);
        put_f32(
            &mut t,
            b.name.into(),
            vec![rows, b.stride],
            (0..b.data.len()).map(|k| b.data.at(k)).collect(),
        );
    }
    t
}

/// `technique.json`: the bindings of `shade.wgsl`, in order, and the head of the bake.
fn numbers(technique: &GpuTechnique, tables: Vec<Value>, head: &Pairs) -> String {
    let offsets = technique.uniform_offsets();
    let uniform = |(u, offset): (&Uniform, u64)| {
        let value = match u.value {
            Number::F32(v) => json!(v),
            Number::Vec4(v) => json!(v),
            Number::Mat3(v) => json!(v),
            Number::Mat4(v) => json!(v),
        };
        json!({"name": u.name, "type": u.value.wgsl(), "offset": offset, "value": value})
    };
    let uniforms: Vec<Value> = technique.uniforms.iter().zip(offsets).map(uniform).collect();
    let head: serde_json::Map<String, Value> = head.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
    let document = json!({
        "technique": technique.slug,
        "tables": tables,
        "uniforms": uniforms,
        "buffers": technique.buffers.iter().map(|b| json!({"name": b.name, "stride": b.stride})).collect::<Vec<_>>(),
        "metadata": head,
    });
    // Values made of plain data always serialise.
    let mut text = serde_json::to_string_pretty(&document).unwrap_or_default();
    text.push('\n');
    text
}
