//! Bakes as tensors: a head (room, parameters, certificate) in the metadata, parts as named tensors.

use steradian_base::{Certificate, Known, ParamInfo, ParamValues, Spread};
pub use steradian_formats::TensorFile;
use steradian_formats::{Tensor, TensorData};

/// What is wrong with a saved bake.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PartError {
    /// A tensor or a metadata entry is missing.
    #[error("'{0}' is missing")]
    Missing(String),
    /// A tensor has another type or shape, or an entry another meaning.
    #[error("'{0}' is not what it should be")]
    Unexpected(String),
}

const SLUG: &str = "steradian.technique";
const CERTIFICATE: &str = "steradian.certificate.";
const PARAM: &str = "steradian.param.";
/// What single points err by; before them [`CERTIFICATE`].
const SPREAD: [&str; 4] = ["points.median", "points.ninetieth", "points.stops", "points.top_hundredth"];

/// Writes room, parameters and certificate.
pub(crate) fn put_head(t: &mut TensorFile, slug: &str, params: &ParamValues, c: &Certificate) {
    let mut put = |k: String, v: String| t.metadata.insert(k, v);
    put(SLUG.into(), slug.into());
    for (name, value) in &params.0 {
        put(format!("{PARAM}{name}"), value.to_string());
    }
    put(format!("{CERTIFICATE}error"), c.error.to_string());
    put(format!("{CERTIFICATE}known"), c.known.word().into());
    put(format!("{CERTIFICATE}metric"), c.metric.clone());
    if let Some(s) = c.spread {
        for (name, value) in SPREAD.into_iter().zip([s.median, s.ninetieth, s.stops, s.top_hundredth]) {
            put(format!("{CERTIFICATE}{name}"), value.to_string());
        }
    }
    for (i, (name, value)) in c.details.iter().enumerate() {
        put(format!("{CERTIFICATE}detail.{i:03}.{name}"), value.to_string());
    }
}

/// Refuses a file that another room saved.
pub(crate) fn check_slug(t: &TensorFile, slug: &str) -> Result<(), PartError> {
    match t.metadata.get(SLUG) {
        Some(s) if s == slug => Ok(()),
        Some(_) => Err(PartError::Unexpected(SLUG.into())),
        None => Err(PartError::Missing(SLUG.into())),
    }
}

fn number(t: &TensorFile, key: &str) -> Result<f64, PartError> {
    let text = t.metadata.get(key).ok_or_else(|| PartError::Missing(key.into()))?;
    text.parse().map_err(|_| PartError::Unexpected(key.into()))
}

/// The parameters that [`put_head`] wrote.
pub(crate) fn params(t: &TensorFile, infos: &[ParamInfo]) -> Result<ParamValues, PartError> {
    let value = |i: &ParamInfo| Ok((i.name.to_string(), number(t, &format!("{PARAM}{}", i.name))?));
    Ok(ParamValues(infos.iter().map(value).collect::<Result<_, PartError>>()?))
}

/// The certificate that [`put_head`] wrote.
pub(crate) fn certificate(t: &TensorFile) -> Result<Certificate, PartError> {
    let key = format!("{CERTIFICATE}known");
    let word = t.metadata.get(&key).ok_or_else(|| PartError::Missing(key.clone()))?;
    let known = [Known::Proved, Known::Estimated, Known::Measured].into_iter().find(|k| k.word() == word);
    let mut c = Certificate::new(
        number(t, &format!("{CERTIFICATE}error"))?,
        known.ok_or(PartError::Unexpected(key))?,
    );
    if let Some(m) = t.metadata.get(&format!("{CERTIFICATE}metric")) {
        c.metric.clone_from(m);
    }
    if t.metadata.contains_key(&format!("{CERTIFICATE}{}", SPREAD[0])) {
        let figures: Vec<f64> =
            SPREAD.iter().map(|n| number(t, &format!("{CERTIFICATE}{n}"))).collect::<Result<_, _>>()?;
        c.spread = Some(Spread {
            median: figures[0],
            ninetieth: figures[1],
            stops: figures[2],
            top_hundredth: figures[3],
        });
    }
    let prefix = format!("{CERTIFICATE}detail.");
    for (key, _) in t.metadata.range(prefix.clone()..).take_while(|(k, _)| k.starts_with(&prefix)) {
        let name = key[prefix.len()..].split_once('.').map_or("", |(_, n)| n);
        c = c.detail(name, number(t, key)?);
    }
    Ok(c)
}

/// Adds a tensor of f32.
pub fn put_f32(t: &mut TensorFile, name: String, shape: Vec<usize>, data: Vec<f32>) {
    t.tensors.insert(name, Tensor::f32(shape, data));
}

/// Adds a tensor of f64.
pub fn put_f64(t: &mut TensorFile, name: String, shape: Vec<usize>, data: Vec<f64>) {
    t.tensors.insert(name, Tensor::f64(shape, data));
}

/// A tensor of f32, or of halves, whose shape has `rank` dimensions and as many elements as it says.
pub fn get_f32(t: &TensorFile, name: &str, rank: usize) -> Result<(Vec<usize>, Vec<f32>), PartError> {
    let x = t.tensors.get(name).ok_or_else(|| PartError::Missing(name.into()))?;
    match &x.data {
        d @ (TensorData::F32(_) | TensorData::F16(_)) if sound(&x.shape, rank, d.len()) => {
            Ok((x.shape.clone(), d.to_f32().into_owned()))
        }
        _ => Err(PartError::Unexpected(name.into())),
    }
}

/// As [`get_f32`], of f64.
pub fn get_f64(t: &TensorFile, name: &str, rank: usize) -> Result<(Vec<usize>, Vec<f64>), PartError> {
    let x = t.tensors.get(name).ok_or_else(|| PartError::Missing(name.into()))?;
    match &x.data {
        TensorData::F64(v) if sound(&x.shape, rank, v.len()) => Ok((x.shape.clone(), v.clone())),
        _ => Err(PartError::Unexpected(name.into())),
    }
}

fn sound(shape: &[usize], rank: usize, len: usize) -> bool {
    shape.len() == rank && shape.iter().try_fold(1usize, |a, b| a.checked_mul(*b)) == Some(len)
}
