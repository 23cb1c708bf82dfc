//! Tensors with names and metadata: the safetensors format (Hugging Face, 0.4). Written here, so that the same
//! tensors always give the same bytes; read through the crate `safetensors`, which checks shapes and offsets.

use crate::atomic::write_atomic;
use crate::image::{not_empty, read_bytes};
use crate::{FormatError, Limits};
use half::f16;
use safetensors::{Dtype, SafeTensors};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

/// The elements of a tensor, last index fastest.
#[derive(Debug, Clone, PartialEq)]
pub enum TensorData {
    /// 32-bit floats.
    F32(Vec<f32>),
    /// 16-bit floats.
    F16(Vec<f16>),
    /// 64-bit floats.
    F64(Vec<f64>),
    /// Unsigned integers.
    U32(Vec<u32>),
}

impl TensorData {
    /// Number of elements.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::F16(v) => v.len(),
            Self::F64(v) => v.len(),
            Self::U32(v) => v.len(),
        }
    }

    /// Has it no elements?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes in memory and in the file.
    pub fn bytes(&self) -> usize {
        self.len() * self.dtype().1
    }

    /// The elements as f32, converted where they are something else.
    pub fn to_f32(&self) -> Cow<'_, [f32]> {
        match self {
            Self::F32(v) => Cow::Borrowed(v),
            Self::F16(v) => v.iter().map(|x| x.to_f32()).collect(),
            Self::F64(v) => v.iter().map(|&x| x as f32).collect(),
            Self::U32(v) => v.iter().map(|&x| x as f32).collect(),
        }
    }

    /// The elements as f64, converted where they are something else.
    pub fn to_f64(&self) -> Cow<'_, [f64]> {
        match self {
            Self::F32(v) => v.iter().map(|&x| x.into()).collect(),
            Self::F16(v) => v.iter().map(|x| x.to_f64()).collect(),
            Self::F64(v) => Cow::Borrowed(v),
            Self::U32(v) => v.iter().map(|&x| x.into()).collect(),
        }
    }

    /// The elements as 16-bit floats; those beyond 65504 become infinite.
    pub fn halved(&self) -> Self {
        match self {
            Self::F16(v) => Self::F16(v.clone()),
            other => Self::F16(other.to_f64().iter().map(|&x| f16::from_f64(x)).collect()),
        }
    }

    /// The format's name and bytes per element.
    fn dtype(&self) -> (&'static str, usize) {
        match self {
            Self::F32(_) => ("F32", 4),
            Self::F16(_) => ("F16", 2),
            Self::F64(_) => ("F64", 8),
            Self::U32(_) => ("U32", 4),
        }
    }

    fn write(&self, w: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::F32(v) => v.iter().try_for_each(|x| w.write_all(&x.to_le_bytes())),
            Self::F16(v) => v.iter().try_for_each(|x| w.write_all(&x.to_le_bytes())),
            Self::F64(v) => v.iter().try_for_each(|x| w.write_all(&x.to_le_bytes())),
            Self::U32(v) => v.iter().try_for_each(|x| w.write_all(&x.to_le_bytes())),
        }
    }

    fn read(dtype: Dtype, bytes: &[u8]) -> Option<Self> {
        Some(match dtype {
            Dtype::F32 => Self::F32(elements(bytes, f32::from_le_bytes)),
            Dtype::F16 => Self::F16(elements(bytes, f16::from_le_bytes)),
            Dtype::F64 => Self::F64(elements(bytes, f64::from_le_bytes)),
            Dtype::U32 => Self::U32(elements(bytes, u32::from_le_bytes)),
            _ => return None,
        })
    }
}

fn elements<const N: usize, T>(bytes: &[u8], read: fn([u8; N]) -> T) -> Vec<T> {
    let (whole, _) = bytes.as_chunks::<N>();
    whole.iter().map(|b| read(*b)).collect()
}

/// An array with a shape, outermost first.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    /// Length of each index.
    pub shape: Vec<usize>,
    /// The elements: as many as the product of the shape.
    pub data: TensorData,
}

impl Tensor {
    /// A tensor of f32. The shape's product must be the number of elements; [`write_tensors`] refuses others.
    pub fn f32(shape: impl Into<Vec<usize>>, data: Vec<f32>) -> Self {
        Self { shape: shape.into(), data: TensorData::F32(data) }
    }

    /// A tensor of f64, as [`Tensor::f32`].
    pub fn f64(shape: impl Into<Vec<usize>>, data: Vec<f64>) -> Self {
        Self { shape: shape.into(), data: TensorData::F64(data) }
    }
}

/// Tensors by name, and metadata as text.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TensorFile {
    /// The tensors.
    pub tensors: BTreeMap<String, Tensor>,
    /// Provenance, conventions, parameters.
    pub metadata: BTreeMap<String, String>,
}

impl TensorFile {
    /// The tensor `name`, or a message that says what there is.
    pub fn require(&self, name: &str) -> Result<&Tensor, String> {
        self.tensors.get(name).ok_or_else(|| {
            let names: Vec<_> = self.tensors.keys().map(String::as_str).collect();
            format!("there is no tensor '{name}'; there is {}", names.join(", "))
        })
    }

    /// Bytes of all elements.
    pub fn bytes(&self) -> usize {
        self.tensors.values().map(|t| t.data.bytes()).sum()
    }

    /// Writes the file's bytes: the header's length, the header as JSON padded to 8 bytes, the elements. Wider
    /// elements come first, so that each tensor is aligned.
    pub fn encode(&self, w: &mut dyn Write) -> io::Result<()> {
        let mut order: Vec<(&String, &Tensor)> = self.tensors.iter().collect();
        order.sort_by_key(|(_, t)| std::cmp::Reverse(t.data.dtype().1));
        let mut header = serde_json::Map::new();
        if !self.metadata.is_empty() {
            header.insert("__metadata__".into(), serde_json::json!(self.metadata));
        }
        let mut at = 0;
        for (name, tensor) in &order {
            let fits =
                tensor.shape.iter().try_fold(1usize, |n, &k| n.checked_mul(k)) == Some(tensor.data.len());
            if !fits || name.as_str() == "__metadata__" {
                return Err(io::Error::other(format!("tensor '{name}' does not have its shape's size")));
            }
            let end = at + tensor.data.bytes();
            let entry = serde_json::json!({
                "dtype": tensor.data.dtype().0, "shape": tensor.shape, "data_offsets": [at, end]
            });
            header.insert((*name).clone(), entry);
            at = end;
        }
        let mut text = serde_json::Value::Object(header).to_string().into_bytes();
        text.resize(text.len().next_multiple_of(8), b' ');
        w.write_all(&(text.len() as u64).to_le_bytes())?;
        w.write_all(&text)?;
        order.iter().try_for_each(|(_, t)| t.data.write(w))
    }
}

/// Bytes of a header: tens of thousands of tensors.
const MAX_HEADER: u64 = 4 << 20;

/// Writes `file` to `path`, whole or not at all.
pub fn write_tensors(path: &Path, file: &TensorFile) -> Result<(), FormatError> {
    write_atomic(path, |w| file.encode(w))
}

/// Reads the tensors in `path`.
pub fn read_tensors(path: &Path, limits: &Limits) -> Result<TensorFile, FormatError> {
    decode_tensors(path, &read_bytes(path, limits)?, limits)
}

/// Decodes tensors that lie in memory; `name` is for messages.
pub fn decode_tensors(name: &Path, bytes: &[u8], limits: &Limits) -> Result<TensorFile, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    not_empty(name, bytes)?;
    limits.memory(name, 2 * bytes.len() as u128, bytes.len() as u64)?;
    // The library takes headers of 100 MB, of which it makes ten times as much.
    if bytes.first_chunk().is_some_and(|n| u64::from_le_bytes(*n) > MAX_HEADER) {
        return Err(invalid(format!("its header is longer than {} MiB, or damaged", MAX_HEADER >> 20)));
    }
    let damaged = |e: safetensors::SafeTensorError| {
        invalid(format!("not a safetensors file, or a damaged one: {e}").replace(['\n', '\r'], " "))
    };
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(damaged)?;
    let views = SafeTensors::deserialize(bytes).map_err(damaged)?;
    let mut file = TensorFile::default();
    file.metadata.extend(header.metadata().iter().flatten().map(|(k, v)| (k.clone(), v.clone())));
    for (tensor, view) in views.tensors() {
        let data = TensorData::read(view.dtype(), view.data()).ok_or_else(|| {
            invalid(format!("tensor '{tensor}' holds {:?}, which is not read", view.dtype()))
        })?;
        file.tensors.insert(tensor, Tensor { shape: view.shape().into(), data });
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> TensorFile {
        let mut f = TensorFile::default();
        f.tensors.insert("a".into(), Tensor::f32([2, 3], vec![1., 2., 3., -4., 5., f32::MIN_POSITIVE]));
        f.tensors.insert("b".into(), Tensor::f64([2], vec![0.1, -1e300]));
        let half = TensorData::F16(vec![f16::from_f32(0.5); 3]);
        f.tensors.insert("c".into(), Tensor { shape: vec![3, 1], data: half });
        f.tensors.insert("d".into(), Tensor { shape: vec![], data: TensorData::U32(vec![7]) });
        f.tensors.insert("e".into(), Tensor::f32([0, 4], vec![]));
        f.metadata.insert("steradian.version".into(), "ε \"quoted\"".into());
        f.metadata.insert("basis".into(), "real SH".into());
        f
    }

    fn bytes(f: &TensorFile) -> Vec<u8> {
        let mut b = Vec::new();
        f.encode(&mut b).unwrap();
        b
    }

    #[test]
    fn tensors_come_back_and_bytes_are_the_same_each_time() {
        let b = bytes(&sample());
        assert_eq!(b, bytes(&sample()));
        assert_eq!(decode_tensors(Path::new("t"), &b, &Limits::default()).unwrap(), sample());
    }

    #[test]
    fn a_wrong_shape_is_refused() {
        let mut f = sample();
        f.tensors.insert("a".into(), Tensor::f32([2, 2], vec![1.0]));
        assert!(f.encode(&mut Vec::new()).unwrap_err().to_string().contains("'a'"));
    }

    #[test]
    fn conversions() {
        let f = sample();
        assert_eq!(*f.tensors["c"].data.to_f32(), [0.5; 3]);
        assert_eq!(*f.tensors["d"].data.to_f64(), [7.0]);
        let halves = f.tensors["a"].data.halved();
        assert_eq!((halves.bytes(), &halves.to_f32()[..5]), (12, &[1., 2., 3., -4., 5.][..]));
        assert!(f.require("x").unwrap_err().contains("a, b, c, d, e"));
    }
}
