//! Tensors with names and metadata: the safetensors format (Hugging Face, 0.4). Written here, so that the
//! same tensors always give the same bytes; read through the crate `safetensors`, which checks shapes and
//! offsets.

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
    /// 8-bit whole numbers.
    I8(Vec<i8>),
}

/// TensorNumbers of a tensor of floats in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TensorNumbers {
    /// 32-bit floats.
    #[default]
    F32,
    /// 16-bit floats.
    F16,
    /// Whole numbers, 127 for 1: of floats from −1 to 1.
    I8,
}

impl TensorData {
    /// Number of elements.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::F16(v) => v.len(),
            Self::F64(v) => v.len(),
            Self::U32(v) => v.len(),
            Self::I8(v) => v.len(),
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
            Self::I8(v) => v.iter().map(|&x| x.into()).collect(),
        }
    }

    /// The elements as f64, converted where they are something else.
    pub fn to_f64(&self) -> Cow<'_, [f64]> {
        match self {
            Self::F32(v) => v.iter().map(|&x| x.into()).collect(),
            Self::F16(v) => v.iter().map(|x| x.to_f64()).collect(),
            Self::F64(v) => Cow::Borrowed(v),
            Self::U32(v) => v.iter().map(|&x| x.into()).collect(),
            Self::I8(v) => v.iter().map(|&x| x.into()).collect(),
        }
    }

    /// The elements as 16-bit floats; those beyond 65504 become infinite.
    pub fn halved(&self) -> Self {
        match self {
            Self::F16(v) => Self::F16(v.clone()),
            other => Self::F16(other.to_f64().iter().map(|&x| f16::from_f64(x)).collect()),
        }
    }

    /// `v` as numbers of a kind.
    fn of(v: Vec<f32>, numbers: TensorNumbers) -> Self {
        match numbers {
            TensorNumbers::F32 => Self::F32(v),
            TensorNumbers::F16 => Self::F16(v.iter().map(|&x| f16::from_f32(x)).collect()),
            TensorNumbers::I8 => Self::I8(v.iter().map(|x| (127.0 * x).round() as i8).collect()),
        }
    }

    /// The format's name and bytes per element.
    fn dtype(&self) -> (&'static str, usize) {
        match self {
            Self::F32(_) => ("F32", 4),
            Self::F16(_) => ("F16", 2),
            Self::F64(_) => ("F64", 8),
            Self::U32(_) => ("U32", 4),
            Self::I8(_) => ("I8", 1),
        }
    }

    fn write(&self, w: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::F32(v) => put(v, |x| x.to_le_bytes(), w),
            Self::F16(v) => put(v, |x| x.to_le_bytes(), w),
            Self::F64(v) => put(v, |x| x.to_le_bytes(), w),
            Self::U32(v) => put(v, |x| x.to_le_bytes(), w),
            Self::I8(v) => put(v, |x| x.to_le_bytes(), w),
        }
    }

    /// Are all elements finite?
    pub fn is_finite(&self) -> bool {
        match self {
            Self::F32(v) => v.iter().all(|x| x.is_finite()),
            Self::F16(v) => v.iter().all(|x| x.is_finite()),
            Self::F64(v) => v.iter().all(|x| x.is_finite()),
            Self::U32(_) | Self::I8(_) => true,
        }
    }

    fn read(dtype: Dtype, bytes: &[u8]) -> Option<Self> {
        Some(match dtype {
            Dtype::F32 => Self::F32(elements(bytes, f32::from_le_bytes)),
            Dtype::F16 => Self::F16(elements(bytes, f16::from_le_bytes)),
            Dtype::F64 => Self::F64(elements(bytes, f64::from_le_bytes)),
            Dtype::U32 => Self::U32(elements(bytes, u32::from_le_bytes)),
            Dtype::I8 => Self::I8(elements(bytes, i8::from_le_bytes)),
            _ => return None,
        })
    }
}

/// Writes elements, many at a time.
fn put<const N: usize, T: Copy>(v: &[T], bytes: impl Fn(T) -> [u8; N], w: &mut dyn Write) -> io::Result<()> {
    const TOGETHER: usize = 4096;
    let mut buffer = vec![[0; N]; TOGETHER.min(v.len())];
    for v in v.chunks(TOGETHER) {
        buffer.iter_mut().zip(v).for_each(|(b, x)| *b = bytes(*x));
        w.write_all(buffer[..v.len()].as_flattened())?;
    }
    Ok(())
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

    /// The elements as 8-bit whole numbers, and by what those of each place in the last index are multiplied:
    /// a 127th of the largest magnitude there. Elements that are not finite become 0.
    pub fn scaled_bytes(&self) -> (Self, Self) {
        let v = self.data.to_f32();
        let last = self.shape.last().copied().unwrap_or(1).max(1);
        let largest = |i: usize| {
            let finite = v.iter().skip(i).step_by(last).map(|x| x.abs()).filter(|x| x.is_finite());
            finite.fold(0.0f32, f32::max)
        };
        let scale: Vec<f32> = (0..last).map(|i| largest(i) / 127.0).collect();
        let whole = |(x, s): (&f32, &f32)| if *s > 0.0 { (x / s).round() as i8 } else { 0 };
        let bytes = v.iter().zip(scale.iter().cycle()).map(whole).collect();
        (Self { shape: self.shape.clone(), data: TensorData::I8(bytes) }, Self::f32([last], scale))
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

    /// Writes the file's bytes: the header's length, the header as JSON padded to 8 bytes, the elements.
    /// Wider elements come first, so that each tensor is aligned.
    pub fn encode(&self, w: &mut dyn Write) -> io::Result<()> {
        self.encode_as(&self.metadata, w)
    }

    /// [`TensorFile::encode`] with other metadata.
    pub fn encode_as(&self, metadata: &BTreeMap<String, String>, w: &mut dyn Write) -> io::Result<()> {
        self.encode_with(metadata, None, w)
    }

    fn encode_with(
        &self,
        metadata: &BTreeMap<String, String>,
        made: Option<TensorParts<'_>>,
        w: &mut dyn Write,
    ) -> io::Result<()> {
        let wrong =
            |name: &str| Err(io::Error::other(format!("tensor '{name}' does not have its shape's size")));
        let mut order: Vec<(&str, &[usize], Elements<'_>)> = Vec::new();
        for (name, t) in &self.tensors {
            if product(&t.shape) != Some(t.data.len()) {
                return wrong(name);
            }
            order.push((name, &t.shape, Elements::Held(&t.data)));
        }
        if let Some(made) = made {
            order.push((made.name, made.shape, Elements::Made(made.numbers, made.parts)));
            order.sort_by_key(|(name, ..)| *name);
        }
        order.sort_by_key(|(.., elements)| std::cmp::Reverse(elements.dtype().1));
        let mut header = serde_json::Map::new();
        if !metadata.is_empty() {
            header.insert("__metadata__".into(), serde_json::json!(metadata));
        }
        let mut at = 0usize;
        for (name, shape, elements) in &order {
            let (dtype, bytes) = elements.dtype();
            let end = product(shape).and_then(|n| n.checked_mul(bytes)).and_then(|n| n.checked_add(at));
            let (Some(end), false) = (end, *name == "__metadata__" || header.contains_key(*name)) else {
                return wrong(name);
            };
            let entry = serde_json::json!({"dtype": dtype, "shape": shape, "data_offsets": [at, end]});
            header.insert((*name).into(), entry);
            at = end;
        }
        let mut text = serde_json::Value::Object(header).to_string().into_bytes();
        text.resize(text.len().next_multiple_of(8), b' ');
        w.write_all(&(text.len() as u64).to_le_bytes())?;
        w.write_all(&text)?;
        for (name, shape, elements) in order {
            match elements {
                Elements::Held(data) => data.write(w)?,
                Elements::Made(numbers, parts) => {
                    let mut count = 0;
                    for part in parts {
                        let part = TensorData::of(part?, numbers);
                        count += part.len();
                        part.write(w)?;
                    }
                    if product(shape) != Some(count) {
                        return wrong(name);
                    }
                }
            }
        }
        Ok(())
    }
}

/// A tensor of floats that is made while it is written, one part after the other, and never held whole.
pub struct TensorParts<'a> {
    /// Its name.
    pub name: &'a str,
    /// Length of each index.
    pub shape: &'a [usize],
    /// Its numbers in the file.
    pub numbers: TensorNumbers,
    /// Runs of elements, together as many as the product of the shape; an error ends the writing.
    pub parts: &'a mut dyn Iterator<Item = io::Result<Vec<f32>>>,
}

/// Elements in memory, or still to be made.
enum Elements<'a> {
    Held(&'a TensorData),
    Made(TensorNumbers, &'a mut dyn Iterator<Item = io::Result<Vec<f32>>>),
}

impl Elements<'_> {
    /// The format's name and bytes per element.
    fn dtype(&self) -> (&'static str, usize) {
        match self {
            Self::Held(data) => data.dtype(),
            Self::Made(TensorNumbers::F32, _) => ("F32", 4),
            Self::Made(TensorNumbers::F16, _) => ("F16", 2),
            Self::Made(TensorNumbers::I8, _) => ("I8", 1),
        }
    }
}

/// The number of elements of a shape; `None` beyond what can be counted.
fn product(shape: &[usize]) -> Option<usize> {
    shape.iter().try_fold(1usize, |n, &k| n.checked_mul(k))
}

/// Bytes of a header: tens of thousands of tensors.
const MAX_HEADER: u64 = 4 << 20;

/// Writes `file` to `path`, whole or not at all.
pub fn write_tensors(path: &Path, file: &TensorFile) -> Result<(), FormatError> {
    write_tensors_as(path, file, &file.metadata)
}

/// [`write_tensors`] with other metadata.
pub fn write_tensors_as(
    path: &Path,
    file: &TensorFile,
    metadata: &BTreeMap<String, String>,
) -> Result<(), FormatError> {
    write_atomic(path, |w| file.encode_as(metadata, w))
}

/// Writes `file` and a tensor that is made meanwhile to `path`, whole or not at all: the same bytes as if it
/// had been among the others.
pub fn write_tensors_with(path: &Path, file: &TensorFile, made: TensorParts<'_>) -> Result<(), FormatError> {
    write_atomic(path, |w| file.encode_with(&file.metadata, Some(made), w))
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
        f.tensors.insert("g".into(), Tensor { shape: vec![3], data: TensorData::I8(vec![-128, 0, 127]) });
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
    fn a_tensor_in_parts_is_as_one_in_memory() {
        let d = tempfile::tempdir().unwrap();
        let (whole, parts) = (d.path().join("a"), d.path().join("b"));
        let mut values: Vec<f32> = (0..12).map(|k| 0.1 * k as f32).collect();
        values[11] = -1.0;
        for numbers in [TensorNumbers::F32, TensorNumbers::F16, TensorNumbers::I8] {
            let mut f = sample();
            let write = |runs: usize, f: &TensorFile| {
                let mut made = values.chunks(5).take(runs).map(|v| Ok(v.to_vec()));
                let made = TensorParts { name: "bb", shape: &[4, 3], numbers, parts: &mut made };
                write_tensors_with(&parts, f, made)
            };
            write(3, &f).unwrap();
            // Too few elements: nothing is written.
            let before = std::fs::read(&parts).unwrap();
            assert!(write(2, &f).unwrap_err().to_string().contains("'bb'"));
            assert_eq!(std::fs::read(&parts).unwrap(), before);
            let data = match numbers {
                TensorNumbers::F32 => TensorData::F32(values.clone()),
                TensorNumbers::F16 => TensorData::F32(values.clone()).halved(),
                TensorNumbers::I8 => TensorData::I8(vec![0, 13, 25, 38, 51, 64, 76, 89, 102, 114, 127, -127]),
            };
            f.tensors.insert("bb".into(), Tensor { shape: vec![4, 3], data });
            write_tensors(&whole, &f).unwrap();
            assert_eq!(std::fs::read(&whole).unwrap(), before);
            // A name of its own.
            assert!(write(3, &f).is_err());
        }
    }

    #[test]
    fn conversions() {
        let f = sample();
        assert_eq!(*f.tensors["c"].data.to_f32(), [0.5; 3]);
        assert_eq!(*f.tensors["d"].data.to_f64(), [7.0]);
        let halves = f.tensors["a"].data.halved();
        assert_eq!((halves.bytes(), &halves.to_f32()[..5]), (12, &[1., 2., 3., -4., 5.][..]));
        assert!(f.require("x").unwrap_err().contains("a, b, c, d, e, g"));
        let (whole, scale) = Tensor::f32([2, 2], vec![0.5, 0.0, -2.0, f32::NAN]).scaled_bytes();
        assert_eq!((&whole.data, whole.shape), (&TensorData::I8(vec![32, 0, -127, 0]), vec![2, 2]));
        assert_eq!(scale, Tensor::f32([2], vec![2.0 / 127.0, 0.0]));
    }
}
