//! Bakes as tensors: a head (technique, parameters, certificate) in the metadata, parts as named tensors.

use steradian_base::{Certificate, Elevation, Evidence, ParamInfo, ParamValues, Spread, Value};
pub use steradian_formats::TensorFile;
use steradian_formats::{Tensor, TensorData};

/// Why a saved bake cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PartError {
    /// A tensor or a metadata entry is missing.
    #[error("'{0}' is missing")]
    Missing(String),
    /// The file was written in another version's form.
    #[error("another version of steradian wrote it; bake it again")]
    Version,
    /// A tensor has another type or shape, or an entry another meaning.
    #[error("'{0}' is not what it should be")]
    Unexpected(String),
}

const SLUG: &str = "steradian.technique";
/// Metadata key and version of the file form; a file of another version is refused.
const FORM: (&str, &str) = ("steradian.bake", "2");
const CERTIFICATE: &str = "steradian.certificate.";
const PARAM: &str = "steradian.param.";
/// Keys of the distribution of the error over single points ([`Spread`]); each follows [`CERTIFICATE`].
const SPREAD: [&str; 4] = ["points.median", "points.ninetieth", "points.stops", "points.top_hundredth"];

/// Writes technique, parameters and certificate.
pub fn put_head(t: &mut TensorFile, slug: &str, params: &ParamValues, c: &Certificate) {
    t.metadata.insert(SLUG.into(), slug.into());
    t.metadata.insert(FORM.0.into(), FORM.1.into());
    for (name, value) in &params.0 {
        // A file parameter is saved as the file's name, without its folder.
        let text = match value {
            Value::File(path) => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            other => other.to_string(),
        };
        t.metadata.insert(format!("{PARAM}{name}"), text);
    }
    put_certificate(t, c);
}

/// Writes a certificate in place of the one there.
pub fn put_certificate(t: &mut TensorFile, c: &Certificate) {
    t.metadata.retain(|k, _| !k.starts_with(CERTIFICATE));
    let mut put = |k: &str, v: String| t.metadata.insert(format!("{CERTIFICATE}{k}"), v);
    put("error", c.error.to_string());
    put("known", c.known.word().into());
    put("metric", c.metric.clone());
    c.tolerance.and_then(|x| put("tolerance", x.to_string()));
    c.missing_energy.and_then(|x| put("missing_energy", x.to_string()));
    for (i, e) in c.elevations.iter().enumerate() {
        let [from, to] = e.range;
        let beside = e.beside_suns.map_or("-".to_string(), |x| x.to_string());
        let row = format!("{} {from} {to} {} {beside} {}", e.theta_o, e.error, e.known.word());
        put(&format!("elevation.{i:03}"), row);
    }
    if let Some(s) = c.spread {
        for (name, value) in SPREAD.into_iter().zip([s.median, s.ninetieth, s.stops, s.top_hundredth]) {
            put(name, value.to_string());
        }
    }
    for (i, (name, value)) in c.details.iter().enumerate() {
        put(&format!("detail.{i:03}.{name}"), value.to_string());
    }
}

/// Refuses a file that another technique or another version saved.
pub fn check_slug(t: &TensorFile, slug: &str) -> Result<(), PartError> {
    let form = t.metadata.get(FORM.0).map(String::as_str);
    match t.metadata.get(SLUG) {
        Some(_) if form != Some(FORM.1) => Err(PartError::Version),
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
pub fn params(t: &TensorFile, infos: &[ParamInfo]) -> Result<ParamValues, PartError> {
    let value = |i: &ParamInfo| {
        let key = format!("{PARAM}{}", i.name);
        let text = t.metadata.get(&key).ok_or_else(|| PartError::Missing(key.clone()))?;
        Ok((i.name, i.parse(text).map_err(|_| PartError::Unexpected(key))?))
    };
    infos.iter().map(value).collect()
}

/// The entries whose key starts with `prefix`, in order; keys are returned without the prefix.
fn below<'a>(t: &'a TensorFile, prefix: &'a str) -> impl Iterator<Item = (&'a str, &'a String)> {
    let all = t.metadata.range(prefix.to_string()..).take_while(move |(k, _)| k.starts_with(prefix));
    all.map(move |(k, v)| (&k[prefix.len()..], v))
}

/// A number that may be missing.
fn optional(t: &TensorFile, key: &str) -> Result<Option<f64>, PartError> {
    if t.metadata.contains_key(key) { number(t, key).map(Some) } else { Ok(None) }
}

fn known(word: &str) -> Option<Evidence> {
    [Evidence::Proved, Evidence::Estimated, Evidence::Measured].into_iter().find(|k| k.word() == word)
}

fn elevation(row: &str) -> Option<Elevation> {
    let words: Vec<&str> = row.split(' ').collect();
    let [theta_o, from, to, error, beside, word] = words[..] else { return None };
    let x = |s: &str| s.parse().ok();
    let beside_suns = if beside == "-" { None } else { Some(x(beside)?) };
    let range = [x(from)?, x(to)?];
    Some(Elevation { theta_o: x(theta_o)?, range, error: x(error)?, beside_suns, known: known(word)? })
}

/// The certificate that [`put_certificate`] wrote.
pub fn certificate(t: &TensorFile) -> Result<Certificate, PartError> {
    let key = |name: &str| format!("{CERTIFICATE}{name}");
    let unexpected = |key: String| PartError::Unexpected(key);
    let word = t.metadata.get(&key("known")).ok_or_else(|| PartError::Missing(key("known")))?;
    let known = known(word).ok_or_else(|| unexpected(key("known")))?;
    let mut c = Certificate::new(number(t, &key("error"))?, known);
    if let Some(m) = t.metadata.get(&key("metric")) {
        c.metric.clone_from(m);
    }
    c.tolerance = optional(t, &key("tolerance"))?;
    c.missing_energy = optional(t, &key("missing_energy"))?;
    let prefix = key("elevation.");
    for (i, row) in below(t, &prefix) {
        c.elevations.push(elevation(row).ok_or_else(|| unexpected(format!("{prefix}{i}")))?);
    }
    if t.metadata.contains_key(&key(SPREAD[0])) {
        let figures: Vec<f64> =
            SPREAD.iter().map(|n| number(t, &key(n))).collect::<Result<_, PartError>>()?;
        c.spread = Some(Spread {
            median: figures[0],
            ninetieth: figures[1],
            stops: figures[2],
            top_hundredth: figures[3],
        });
    }
    let prefix = key("detail.");
    for (rest, _) in below(t, &prefix) {
        let name = rest.split_once('.').map_or("", |(_, n)| n);
        c = c.detail(name, number(t, &format!("{prefix}{rest}"))?);
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

/// As [`get_f32`], for a tensor of f64.
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
