//! Measured anisotropic reflectance as MERL stores it (`.binary` too): Ngan, Durand & Matusik 2005,
//! "Experimental Analysis of BRDF Models". Little-endian: sixteen `i32`, of which the first four are
//! dimensions (90, 180, 45 and 45 or the same the other way round) and the eleventh is the number of
//! channels, 3; then each channel's numbers as `f32`, laid out [θ_i][θ_o][φ_d][φ_i]. Plain data.

use crate::image::not_empty;
use crate::{FormatError, Limits};
use std::path::Path;

/// Bytes before the numbers.
const HEAD: usize = 64;
/// Of any dimension.
const MOST: usize = 1024;

/// The numbers of such a file as they stand in it.
#[derive(Debug, Clone, PartialEq)]
pub struct MerlAnisotropic {
    /// θ_i, θ_o, φ_d, φ_i: slowest first.
    pub dimensions: [usize; 4],
    /// Red, green, blue.
    pub channels: [Vec<f32>; 3],
}

/// Decodes such a file that lies in memory; `name` is for messages. Every number is finite.
///
/// The order of the four dimensions in the head is not documented: the two that are equal are taken to be the
/// polar angles, and of the other two the larger one the difference of the azimuths, as 45, 45, 180 and 90
/// are in the published files.
pub fn decode_merl_anisotropic(
    name: &Path,
    bytes: &[u8],
    limits: &Limits,
) -> Result<MerlAnisotropic, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    not_empty(name, bytes)?;
    let (head, body) = bytes
        .split_first_chunk::<HEAD>()
        .ok_or_else(|| invalid("is cut in its header of 64 bytes".into()))?;
    let head: Vec<i32> = head.as_chunks::<4>().0.iter().map(|b| i32::from_le_bytes(*b)).collect();
    if head[10] != 3 {
        return Err(invalid(format!("its header says {} channels instead of 3", head[10])));
    }
    let dimensions = ordered([head[0], head[1], head[2], head[3]]).ok_or_else(|| {
        let shown = head[..4].iter().map(i32::to_string).collect::<Vec<_>>().join(" x ");
        invalid(format!("its dimensions are {shown}, not 45 x 45 x 180 x 90 or the like"))
    })?;
    let cells = dimensions.iter().map(|d| *d as u128).product::<u128>();
    let wanted = 12 * cells;
    if body.len() as u128 != wanted {
        return Err(invalid(format!("has {} bytes of numbers instead of {wanted}", body.len())));
    }
    limits.memory(name, wanted, bytes.len() as u64)?;
    let numbers: Vec<f32> = body.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    if let Some(i) = numbers.iter().position(|v| !v.is_finite()) {
        return Err(invalid(format!("number {i} is {}", numbers[i])));
    }
    let cells = cells as usize;
    let channels = [0, 1, 2].map(|c| numbers[c * cells..(c + 1) * cells].to_vec());
    Ok(MerlAnisotropic { dimensions, channels })
}

/// [θ_i, θ_o, φ_d, φ_i] of the header's four numbers.
fn ordered(head: [i32; 4]) -> Option<[usize; 4]> {
    let mut sizes = Vec::with_capacity(4);
    for d in head {
        sizes.push(usize::try_from(d).ok().filter(|d| (2..=MOST).contains(d))?);
    }
    sizes.sort_unstable();
    // Two are equal; the others are φ_i and φ_d.
    let twin = (0..3).find(|i| sizes[*i] == sizes[i + 1])?;
    let polar = sizes[twin];
    sizes.drain(twin..twin + 2);
    Some([polar, polar, sizes[1], sizes[0]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::Mutator;

    fn file(head: [i32; 4], channels: i32, numbers: usize) -> Vec<u8> {
        let mut all = [0; 16];
        all[..4].copy_from_slice(&head);
        all[10] = channels;
        let numbers = (0..numbers).flat_map(|i| (i as f32).to_le_bytes());
        all.iter().flat_map(|v| v.to_le_bytes()).chain(numbers).collect()
    }

    fn read(bytes: &[u8]) -> Result<MerlAnisotropic, String> {
        decode_merl_anisotropic(Path::new("a.binary"), bytes, &Limits::default()).map_err(|e| e.to_string())
    }

    #[test]
    fn dimensions_in_either_order() {
        for head in [[2, 2, 6, 4], [4, 6, 2, 2]] {
            let whole = file(head, 3, 3 * 96);
            let table = read(&whole).expect("valid");
            assert_eq!((table.dimensions, table.channels[2][0]), ([2, 2, 6, 4], 192.0));
            for n in 0..whole.len() {
                assert!(read(&whole[..n]).is_err(), "cut after {n} bytes");
            }
        }
        assert!(read(&file([2, 3, 6, 4], 3, 432)).unwrap_err().contains("2 x 3 x 6 x 4"));
        assert!(read(&file([-2, -2, 6, 4], 3, 288)).unwrap_err().contains("-2 x -2"));
        assert!(read(&file([1024, 1024, 1023, 1000], 3, 9)).unwrap_err().contains("instead of 12"));
        assert!(read(&file([2, 2, 6, 4], 1, 96)).unwrap_err().contains("1 channels"));
        let mut nan = file([2, 2, 6, 4], 3, 288);
        nan[HEAD + 4..HEAD + 8].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(read(&nan).unwrap_err().ends_with("number 1 is NaN"));
        let mut damage = Mutator::new(9);
        let whole = file([2, 2, 6, 4], 3, 288);
        for _ in 0..5000 {
            let _ = read(&damage.damage(&whole, &whole));
        }
    }
}
