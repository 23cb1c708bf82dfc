//! Measured isotropic reflectance as MERL stores it: `.binary`, after Matusik, Pfister, Brand & McMillan
//! 2003, "A Data-Driven Reflectance Model". Little-endian: three `i32` dimensions, 90, 90 and 180, then red,
//! green and blue, each 90·90·180 `f64` with the last dimension fastest. Plain data: what the indices and the
//! numbers mean is the reader's.

use crate::atomic::write_atomic;
use crate::image::not_empty;
use crate::{FormatError, Limits};
use std::io::Write;
use std::path::Path;

/// The dimensions that every such file has.
pub const MERL_DIMENSIONS: [usize; 3] = [90, 90, 180];
/// Cells of one channel.
pub const MERL_CELLS: usize = MERL_DIMENSIONS[0] * MERL_DIMENSIONS[1] * MERL_DIMENSIONS[2];
/// Bytes of the whole file.
pub const MERL_BYTES: u64 = 12 + 8 * 3 * MERL_CELLS as u64;

/// The numbers of a `.binary` file as they stand in it: red, green, blue, [`MERL_CELLS`] each.
#[derive(Debug, Clone, PartialEq)]
pub struct MerlTable {
    /// Red, green, blue.
    pub channels: [Vec<f64>; 3],
}

/// Decodes a `.binary` file that lies in memory; `name` is for messages. Every number is finite.
pub fn decode_merl(name: &Path, bytes: &[u8], limits: &Limits) -> Result<MerlTable, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    not_empty(name, bytes)?;
    let (head, body) =
        bytes.split_first_chunk::<12>().ok_or_else(|| invalid("is cut in its header".into()))?;
    let dimension = |i: usize| i32::from_le_bytes([0, 1, 2, 3].map(|k| head[4 * i + k]));
    let found = [0, 1, 2].map(dimension);
    if found != MERL_DIMENSIONS.map(|d| d as i32) {
        let [a, b, c] = found;
        return Err(invalid(format!("its dimensions are {a} x {b} x {c}, not 90 x 90 x 180 as MERL's are")));
    }
    if bytes.len() as u64 != MERL_BYTES {
        return Err(invalid(format!("has {} bytes instead of {MERL_BYTES}", bytes.len())));
    }
    limits.memory(name, u128::from(MERL_BYTES), bytes.len() as u64)?;
    let (numbers, _) = body.as_chunks::<8>();
    let channel = |c: usize| -> Vec<f64> {
        numbers[c * MERL_CELLS..(c + 1) * MERL_CELLS].iter().map(|b| f64::from_le_bytes(*b)).collect()
    };
    let table = MerlTable { channels: [channel(0), channel(1), channel(2)] };
    for (c, colour) in table.channels.iter().zip(["red", "green", "blue"]) {
        if let Some(i) = c.iter().position(|v| !v.is_finite()) {
            return Err(invalid(format!("cell {i} of {colour} is {}", c[i])));
        }
    }
    Ok(table)
}

/// Writes a `.binary` file.
pub fn write_merl(path: &Path, table: &MerlTable) -> Result<(), FormatError> {
    let fits = table.channels.iter().all(|c| c.len() == MERL_CELLS && c.iter().all(|v| v.is_finite()));
    if !fits {
        let why = format!("a MERL table holds {MERL_CELLS} finite numbers per channel");
        return Err(FormatError::Unwritable { path: path.into(), why });
    }
    write_atomic(path, |w: &mut dyn Write| {
        MERL_DIMENSIONS.iter().try_for_each(|d| w.write_all(&(*d as i32).to_le_bytes()))?;
        table.channels.iter().flatten().try_for_each(|v| w.write_all(&v.to_le_bytes()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::Mutator;

    fn table() -> MerlTable {
        let channel = |c: usize| (0..MERL_CELLS).map(|i| (i % 1013) as f64 - 5.0 + c as f64).collect();
        MerlTable { channels: [channel(0), channel(1), channel(2)] }
    }

    #[test]
    fn what_is_written_is_read_and_damage_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.binary");
        let table = table();
        write_merl(&path, &table).expect("written");
        let bytes = std::fs::read(&path).expect("readable");
        assert_eq!(bytes.len() as u64, MERL_BYTES);
        let read = |bytes: &[u8]| decode_merl(&path, bytes, &Limits::default());
        assert!(read(&bytes).expect("valid") == table);
        let refused = |bytes: &[u8], part: &str| {
            let e = read(bytes).expect_err(part);
            assert!(e.to_string().contains(part) && e.exit_code() == 3, "{e}");
        };
        refused(&[], "empty");
        refused(&bytes[..7], "cut in its header");
        refused(&bytes[..bytes.len() - 1], "34992011 bytes instead of 34992012");
        refused(&[&bytes[..], &[0]].concat(), "34992013 bytes");
        let mut other = bytes.clone();
        other[0] = 91;
        refused(&other, "91 x 90 x 180");
        let mut nan = bytes.clone();
        nan[12 + 8 * MERL_CELLS..][..8].copy_from_slice(&f64::NAN.to_le_bytes());
        refused(&nan, "cell 0 of green is NaN");
        let few = Limits { max_memory: 1 << 20, ..Limits::default() };
        assert!(decode_merl(&path, &bytes, &few).is_err());
        // Headers in every kind of damage: an answer, and never a panic.
        let mut damage = Mutator::new(15);
        for _ in 0..1000 {
            let _ = read(&damage.damage(&bytes[..64], &bytes[..64]));
        }
    }

    #[test]
    fn tables_of_other_shapes_are_not_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut short = table();
        short.channels[1].pop();
        let e = write_merl(&folder.path().join("b.binary"), &short).expect_err("refused");
        assert!(e.exit_code() == 1 && e.to_string().contains("1458000"), "{e}");
    }
}
