//! Files of many materials, one row of little-endian 32-bit floats each: tabulated factors (Bagher, Snyder &
//! Nowrouzezahrai 2016) and networks (Sztrajman, Rainer, Ritschel & Weyrich 2021).

use crate::image::not_empty;
use crate::{FormatError, Limits};
use std::path::Path;

/// Materials of a table of factors.
pub const NPF_ROWS: usize = 256;
/// Columns of three channels of each.
pub const NPF_COLUMNS: usize = 512;
/// Bytes of such a table.
pub const NPF_BYTES: u64 = (4 * 3 * NPF_ROWS * NPF_COLUMNS) as u64;
/// Numbers of a network.
pub const NBRDF_NUMBERS: usize = 675;

/// The columns of material `row` of a table of factors that lies in memory; `name` is for messages. Every
/// number of them is finite; those of other materials are not looked at.
pub fn decode_npf(
    name: &Path,
    bytes: &[u8],
    row: usize,
    limits: &Limits,
) -> Result<Vec<[f32; 3]>, FormatError> {
    not_empty(name, bytes)?;
    if bytes.len() as u64 != NPF_BYTES {
        let why = format!("has {} bytes instead of the {NPF_BYTES} of tabulated factors", bytes.len());
        return Err(FormatError::invalid(name, why));
    }
    limits.memory(name, 12 * NPF_COLUMNS as u128, NPF_BYTES)?;
    let numbers = numbers(name, bytes, row, 3 * NPF_COLUMNS)?;
    Ok(numbers.as_chunks::<3>().0.to_vec())
}

/// The numbers of material `row` of a file of networks that lies in memory.
pub fn decode_nbrdf(name: &Path, bytes: &[u8], row: usize, limits: &Limits) -> Result<Vec<f32>, FormatError> {
    not_empty(name, bytes)?;
    if !bytes.len().is_multiple_of(4 * NBRDF_NUMBERS) {
        let n = bytes.len();
        let why = format!("has {n} bytes, which are not {NBRDF_NUMBERS} 32-bit floats for each material");
        return Err(FormatError::invalid(name, why));
    }
    limits.memory(name, 4 * NBRDF_NUMBERS as u128, bytes.len() as u64)?;
    numbers(name, bytes, row, NBRDF_NUMBERS)
}

/// Row `row` of as many numbers.
fn numbers(name: &Path, bytes: &[u8], row: usize, count: usize) -> Result<Vec<f32>, FormatError> {
    let Some(part) = bytes.chunks_exact(4 * count).nth(row) else {
        let why = format!("holds {} materials; its list names more than {row}", bytes.len() / (4 * count));
        return Err(FormatError::invalid(name, why));
    };
    let numbers: Vec<f32> = part.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    match numbers.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(FormatError::invalid(name, format!("number {i} of material {row} is {}", numbers[i]))),
        None => Ok(numbers),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_by_their_length() {
        let (name, limits) = (Path::new("a.bin"), Limits::default());
        let mut bytes: Vec<u8> = (0..2 * NBRDF_NUMBERS).flat_map(|i| (i as f32).to_le_bytes()).collect();
        let second = decode_nbrdf(name, &bytes, 1, &limits).expect("valid");
        assert_eq!((second.len(), second[3]), (NBRDF_NUMBERS, (NBRDF_NUMBERS + 3) as f32));
        bytes[12..16].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(decode_nbrdf(name, &bytes, 1, &limits).is_ok(), "another material's");
        for (bytes, row, why) in [
            (&bytes[..], 0, "number 3 of material 0 is NaN"),
            (&bytes[..], 2, "holds 2 materials; its list names more than 2"),
            (&bytes[1..], 0, "has 5399 bytes"),
            (&[][..], 0, "empty"),
        ] {
            let e = decode_nbrdf(name, bytes, row, &limits).expect_err(why);
            assert!(e.to_string().contains(why), "{e}");
        }
        let mut table = vec![0; NPF_BYTES as usize];
        table[12 * NPF_COLUMNS + 4..][..4].copy_from_slice(&2f32.to_le_bytes());
        assert_eq!(decode_npf(name, &table, 1, &limits).expect("valid")[0], [0.0, 2.0, 0.0]);
        assert!(decode_npf(name, &table, NPF_ROWS, &limits).is_err());
        assert!(decode_npf(name, &table[4..], 0, &limits).is_err());
    }
}
