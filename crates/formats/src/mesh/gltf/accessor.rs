//! Accessors: typed numbers in buffer views, with sparse replacements (glTF 2.0, section 3.6.2).

use super::buffers::Buffers;
use super::json::{Accessor, Sparse};

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

fn component_size(kind: u32) -> Result<usize, String> {
    match kind {
        BYTE | UNSIGNED_BYTE => Ok(1),
        SHORT | UNSIGNED_SHORT => Ok(2),
        UNSIGNED_INT | FLOAT => Ok(4),
        _ => Err(format!("unknown component type {kind}")),
    }
}

fn component_count(a: &Accessor) -> Result<usize, String> {
    match a.r#type.as_str() {
        "SCALAR" => Ok(1),
        "VEC2" => Ok(2),
        "VEC3" => Ok(3),
        "VEC4" => Ok(4),
        other => Err(format!("unexpected accessor type {other:?}")),
    }
}

/// The vectors of an accessor as floats: integers as they are, or normalised where it says so. Of longer
/// vectors the first `N` components, of shorter ones the rest is 1 (an opaque colour).
pub fn vectors<const N: usize>(a: &Accessor, buffers: &Buffers) -> Result<Vec<[f32; N]>, String> {
    let components = component_count(a)?;
    let size = component_size(a.componentType)?;
    let decode = |bytes: &[u8]| {
        let mut v = [1.0; N];
        for (out, raw) in v.iter_mut().zip(bytes.chunks_exact(size)) {
            *out = number(raw, a.componentType, a.normalized);
        }
        v
    };
    read(a, buffers, size * components, [0.0; N], decode)
}

/// The unsigned integers of an accessor of indices.
pub fn indices(a: &Accessor, buffers: &Buffers) -> Result<Vec<u32>, String> {
    if component_count(a)? != 1 {
        return Err("indices must be scalars".into());
    }
    read(a, buffers, index_size(a.componentType)?, 0, index)
}

fn index_size(kind: u32) -> Result<usize, String> {
    match kind {
        UNSIGNED_BYTE => Ok(1),
        UNSIGNED_SHORT => Ok(2),
        UNSIGNED_INT => Ok(4),
        _ => Err(format!("component type {kind} is none for indices")),
    }
}

/// All elements of `size` bytes, `zero` where there is no buffer view, then the sparse ones. The caller has
/// announced the memory of `a.count` elements.
fn read<T: Clone>(
    a: &Accessor,
    buffers: &Buffers,
    size: usize,
    zero: T,
    decode: impl Fn(&[u8]) -> T,
) -> Result<Vec<T>, String> {
    let mut out = match a.bufferView {
        Some(view) => {
            let (bytes, stride) = buffers.view(view)?;
            elements(bytes, a.byteOffset, stride, size, a.count)?.map(&decode).collect()
        }
        None => vec![zero; usize::try_from(a.count).map_err(|e| e.to_string())?],
    };
    if let Some(sparse) = &a.sparse {
        replace(&mut out, sparse, buffers, size, decode)?;
    }
    Ok(out)
}

fn replace<T>(
    out: &mut [T],
    sparse: &Sparse,
    buffers: &Buffers,
    size: usize,
    decode: impl Fn(&[u8]) -> T,
) -> Result<(), String> {
    let (places, values) = (&sparse.indices, &sparse.values);
    let place_size = index_size(places.componentType)?;
    let place_bytes = buffers.view(places.bufferView)?.0;
    let value_bytes = buffers.view(values.bufferView)?.0;
    let at = elements(place_bytes, places.byteOffset, 0, place_size, sparse.count)?.map(index);
    let new = elements(value_bytes, values.byteOffset, 0, size, sparse.count)?.map(decode);
    for (i, value) in at.zip(new) {
        let slot = out.get_mut(i as usize).ok_or_else(|| format!("sparse index {i} is out of range"))?;
        *slot = value;
    }
    Ok(())
}

/// `count` slices of `size` bytes, `stride` apart (0: tight), checked against the end.
fn elements(
    bytes: &[u8],
    offset: u64,
    stride: u64,
    size: usize,
    count: u64,
) -> Result<impl Iterator<Item = &[u8]>, String> {
    let step = if stride == 0 { size as u64 } else { stride };
    if step < size as u64 {
        return Err(format!("a stride of {step} bytes for elements of {size}"));
    }
    let end = count
        .saturating_sub(1)
        .checked_mul(step)
        .and_then(|n| n.checked_add(offset))
        .and_then(|n| n.checked_add(if count == 0 { 0 } else { size as u64 }));
    if end.is_none_or(|end| end > bytes.len() as u64) {
        return Err(format!("{count} elements reach beyond their buffer view of {} bytes", bytes.len()));
    }
    let rest = bytes.get(offset as usize..).unwrap_or_default();
    Ok(rest.chunks(step as usize).take(count as usize).map(move |c| &c[..size]))
}

fn index(bytes: &[u8]) -> u32 {
    let mut raw = [0; 4];
    raw[..bytes.len()].copy_from_slice(bytes);
    u32::from_le_bytes(raw)
}

/// One component (normalised integers: glTF 2.0, section 3.11).
fn number(raw: &[u8], kind: u32, normalized: bool) -> f32 {
    let bits = index(raw);
    let (value, largest) = match kind {
        BYTE => (f32::from(bits as u8 as i8), 127.0),
        UNSIGNED_BYTE => (f32::from(bits as u8), 255.0),
        SHORT => (f32::from(bits as u16 as i16), 32767.0),
        UNSIGNED_SHORT => (f32::from(bits as u16), 65535.0),
        UNSIGNED_INT => (bits as f32, 4294967295.0),
        _ => return f32::from_bits(bits),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_normalised_as_the_specification_says() {
        assert_eq!(number(&[0x80], BYTE, true), -1.0);
        assert_eq!(number(&[0x81], BYTE, true), -1.0);
        assert_eq!(number(&[0x7f], BYTE, true), 1.0);
        assert_eq!(number(&[0xff], UNSIGNED_BYTE, true), 1.0);
        assert_eq!(number(&[0xff, 0xff], UNSIGNED_SHORT, false), 65535.0);
        assert_eq!(number(&[0xff, 0xff], SHORT, false), -1.0);
        assert_eq!(number(&1.5f32.to_le_bytes(), FLOAT, true), 1.5);
    }

    #[test]
    fn elements_stay_inside_their_view() {
        let bytes = [0u8; 10];
        let count = |o, st, si, c| elements(&bytes, o, st, si, c).map(|e| e.count());
        assert_eq!(count(0, 0, 2, 5), Ok(5));
        assert_eq!(count(1, 4, 3, 2), Ok(2));
        // The last element of an interleaved view need not fill its stride.
        assert_eq!(count(0, 4, 2, 3), Ok(3));
        assert!(count(11, 0, 2, 0).is_err());
        for (o, st, si, c) in
            [(0, 0, 2, 6), (10, 0, 1, 1), (0, 1, 2, 2), (0, 0, 4, 1 << 62), (u64::MAX, 0, 1, 2)]
        {
            assert!(count(o, st, si, c).is_err());
        }
    }
}
