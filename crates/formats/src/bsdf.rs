//! Named arrays as the material database of EPFL's Realistic Graphics Lab stores them: `.bsdf`, the container
//! `tensor_file` of Dupuy & Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and
//! Rendering". Little-endian and unpadded: 12 bytes `tensor_file\0`, version 1.0, u32 number of fields; per
//! field u16 length of its name, name, u16 number of dimensions, u8 type, u64 offset in the file, u64 per
//! dimension. Plain data, as [`Tensor`]s.

use crate::image::not_empty;
use crate::{FormatError, Limits, Tensor, TensorData};
use half::f16;
use std::collections::BTreeMap;
use std::path::Path;

const MAGIC: &[u8; 12] = b"tensor_file\0";
/// More than any such file has.
const MAX_FIELDS: u32 = 256;
const MAX_DIMENSIONS: u16 = 8;

/// Decodes a `.bsdf` file that lies in memory; `name` is for messages. Unsigned integers of up to 32 bits
/// become [`TensorData::U32`], other integers [`TensorData::F64`]. Floats that are not finite pass.
pub fn decode_bsdf(
    name: &Path,
    bytes: &[u8],
    limits: &Limits,
) -> Result<BTreeMap<String, Tensor>, FormatError> {
    not_empty(name, bytes)?;
    let invalid = |why: String| FormatError::invalid(name, why);
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err(invalid("does not begin with tensor_file as a .bsdf of the RGL database does".into()));
    };
    let mut head = Head { rest };
    let cut = || invalid("is cut in its list of fields".into());
    let version = head.take::<2>().ok_or_else(cut)?;
    if version[0] != 1 {
        return Err(invalid(format!("is of version {}.{}; 1.0 is read", version[0], version[1])));
    }
    let count = head.take().map(u32::from_le_bytes).ok_or_else(cut)?;
    if count > MAX_FIELDS {
        return Err(invalid(format!("claims {count} fields; at most {MAX_FIELDS} are read")));
    }
    let mut fields = Vec::new();
    for _ in 0..count {
        fields.push(head.field().ok_or_else(cut)?);
    }
    let mut all = BTreeMap::new();
    let (mut taken, mut decoded) = (0u128, 0u128);
    for field in fields {
        let fault = |what: String| invalid(format!("field '{}' {what}", field.name));
        let kind = Kind::of(field.kind).ok_or_else(|| fault(format!("is of unknown type {}", field.kind)))?;
        if field.shape.len() > usize::from(MAX_DIMENSIONS) {
            return Err(fault(format!("has {} dimensions", field.shape.len())));
        }
        let product = field.shape.iter().try_fold(1u64, |n, d| n.checked_mul(*d));
        let length = product.and_then(|n| n.checked_mul(kind.bytes() as u64));
        let end = length.and_then(|n| n.checked_add(field.offset)).filter(|end| *end <= bytes.len() as u64);
        let (Some(n), Some(end)) = (product, end) else {
            return Err(fault("reaches beyond the end of the file: it is cut or damaged".into()));
        };
        // Fields that share bytes would make a small file large.
        taken += u128::from(end - field.offset);
        decoded += u128::from(n) * 8;
        if taken > bytes.len() as u128 {
            return Err(fault("overlaps another".into()));
        }
        limits.memory(name, decoded, bytes.len() as u64)?;
        let data = kind.read(&bytes[field.offset as usize..end as usize]);
        let shape = field.shape.iter().map(|d| *d as usize).collect();
        if all.insert(field.name.clone(), Tensor { shape, data }).is_some() {
            return Err(fault("is there twice".into()));
        }
    }
    Ok(all)
}

struct Field {
    name: String,
    kind: u8,
    offset: u64,
    shape: Vec<u64>,
}

struct Head<'a> {
    rest: &'a [u8],
}

impl Head<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*first)
    }

    fn field(&mut self) -> Option<Field> {
        let length = usize::from(self.take().map(u16::from_le_bytes)?);
        let (name, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        let dimensions = self.take().map(u16::from_le_bytes)?;
        let [kind] = self.take()?;
        let offset = self.take().map(u64::from_le_bytes)?;
        let shape = (0..dimensions).map(|_| self.take().map(u64::from_le_bytes)).collect::<Option<_>>()?;
        // Messages that quote a damaged name stay one line.
        let name = String::from_utf8_lossy(name).escape_debug().to_string();
        Some(Field { name, kind, offset, shape })
    }
}

/// The types of elements, by their numbers in the file.
#[derive(Clone, Copy)]
enum Kind {
    U8 = 1,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    F64,
}

impl Kind {
    fn of(number: u8) -> Option<Self> {
        use Kind::*;
        [U8, I8, U16, I16, U32, I32, U64, I64, F16, F32, F64].into_iter().find(|k| *k as u8 == number)
    }

    fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    fn read(self, bytes: &[u8]) -> TensorData {
        match self {
            Self::U8 => TensorData::U32(bytes.iter().map(|b| u32::from(*b)).collect()),
            Self::I8 => TensorData::F64(bytes.iter().map(|b| f64::from(*b as i8)).collect()),
            Self::U16 => TensorData::U32(each(bytes, |b| u32::from(u16::from_le_bytes(b)))),
            Self::I16 => TensorData::F64(each(bytes, |b| f64::from(i16::from_le_bytes(b)))),
            Self::U32 => TensorData::U32(each(bytes, u32::from_le_bytes)),
            Self::I32 => TensorData::F64(each(bytes, |b| f64::from(i32::from_le_bytes(b)))),
            Self::U64 => TensorData::F64(each(bytes, |b| u64::from_le_bytes(b) as f64)),
            Self::I64 => TensorData::F64(each(bytes, |b| i64::from_le_bytes(b) as f64)),
            Self::F16 => TensorData::F16(each(bytes, f16::from_le_bytes)),
            Self::F32 => TensorData::F32(each(bytes, f32::from_le_bytes)),
            Self::F64 => TensorData::F64(each(bytes, f64::from_le_bytes)),
        }
    }
}

fn each<const N: usize, T>(bytes: &[u8], read: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|b| read(*b)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::Mutator;

    type Given<'a> = (&'a str, u8, &'a [u64], Vec<u8>);

    fn file(fields: &[Given<'_>]) -> Vec<u8> {
        let head: usize = fields.iter().map(|f| 2 + f.0.len() + 2 + 1 + 8 + 8 * f.2.len()).sum();
        let mut out = [&MAGIC[..], &[1, 0], &(fields.len() as u32).to_le_bytes()].concat();
        let mut at = (out.len() + head) as u64;
        for (name, kind, shape, data) in fields {
            out.extend((name.len() as u16).to_le_bytes());
            out.extend(name.as_bytes());
            out.extend((shape.len() as u16).to_le_bytes());
            out.push(*kind);
            out.extend(at.to_le_bytes());
            shape.iter().for_each(|d| out.extend(d.to_le_bytes()));
            at += data.len() as u64;
        }
        fields.iter().for_each(|f| out.extend(&f.3));
        out
    }

    fn read(bytes: &[u8]) -> Result<BTreeMap<String, Tensor>, String> {
        decode_bsdf(Path::new("a.bsdf"), bytes, &Limits::default()).map_err(|e| e.to_string())
    }

    #[test]
    fn types_and_shapes() {
        let floats: Vec<u8> = [1.5f32, -2.0, f32::NAN, 4.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let bytes = file(&[
            ("a", 10, &[2, 2], floats),
            ("text", 1, &[3], b"RGL".to_vec()),
            ("i", 6, &[1], (-7i32).to_le_bytes().to_vec()),
            ("h", 9, &[1], f16::from_f32(0.5).to_le_bytes().to_vec()),
        ]);
        let all = read(&bytes).expect("valid");
        assert_eq!((all["a"].shape.as_slice(), all["a"].data.to_f64()[1]), ([2, 2].as_slice(), -2.0));
        assert_eq!(all["text"].data, TensorData::U32(b"RGL".map(u32::from).to_vec()));
        assert_eq!((all["i"].data.to_f64()[0], all["h"].data.to_f64()[0]), (-7.0, 0.5));
        for n in 0..bytes.len() {
            assert!(read(&bytes[..n]).is_err(), "cut after {n} bytes");
        }
        let mut damage = Mutator::new(7);
        for _ in 0..20_000 {
            let _ = read(&damage.damage(&bytes, &bytes));
        }
    }

    #[test]
    fn faults_are_named() {
        let one = |name, kind, shape: &[u64]| read(&file(&[(name, kind, shape, vec![0; 8])])).unwrap_err();
        assert!(one("a", 12, &[8]).ends_with("field 'a' is of unknown type 12"));
        assert!(one("a", 10, &[3]).contains("beyond the end"));
        assert!(one("a", 10, &[u64::MAX, u64::MAX]).contains("beyond the end"));
        assert!(one("a", 1, &[1; 9]).contains("9 dimensions"));
        let twice = file(&[("a", 1, &[1], vec![0]), ("a", 1, &[1], vec![0])]);
        assert!(read(&twice).unwrap_err().contains("twice"));
        assert!(read(b"tensor").unwrap_err().contains("does not begin with"));
        let mut two = file(&[]);
        two[12] = 2;
        assert!(read(&two).unwrap_err().contains("version 2.0"));
    }
}
