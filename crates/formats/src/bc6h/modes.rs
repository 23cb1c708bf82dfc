//! The fourteen ways in which a block spends its 128 bits, the shapes of two subsets, and how endpoints
//! become values (Khronos Data Format Specification 1.3, section 20.2; Microsoft, *BC6H format*).

use std::sync::LazyLock;

/// Red, green, blue of an endpoint.
pub(super) type Rgb = [i32; 3];

/// The endpoints of both subsets: first and last of subset 0, first and last of subset 1.
pub(super) type Endpoints = [Rgb; 4];

/// One mode.
pub(super) struct Mode {
    /// What the first bits say.
    pub code: u32,
    /// How many they are: 2 or 5.
    pub code_bits: u32,
    /// 1 or 2.
    pub subsets: usize,
    /// Bits of an endpoint; with deltas those of the first.
    pub precision: u32,
    /// Bits of the other endpoints' signed differences from the first, by channel.
    pub delta: Option<[u32; 3]>,
    /// Where each bit after the code goes: endpoint, channel, bit.
    pub bits: Vec<(u8, u8, u8)>,
}

/// Code and its bits, subsets, precision, deltas, and the bits in their order in the block, lowest first:
/// `r1[4:0]` is bits 0 to 4 of the red of endpoint 1, `r0[10:11]` bit 11 and then bit 10.
type Row = (u32, u32, usize, u32, Option<[u32; 3]>, &'static str);

/// In the specification's order.
const ROWS: [Row; 14] = [
    (
        0,
        2,
        2,
        10,
        Some([5, 5, 5]),
        "g2[4] b2[4] b3[4] r0[9:0] g0[9:0] b0[9:0] r1[4:0] g3[4] g2[3:0] g1[4:0] b3[0] \
        g3[3:0] b1[4:0] b3[1] b2[3:0] r2[4:0] b3[2] r3[4:0] b3[3]",
    ),
    (
        1,
        2,
        2,
        7,
        Some([6, 6, 6]),
        "g2[5] g3[4] g3[5] r0[6:0] b3[0] b3[1] b2[4] g0[6:0] b2[5] b3[2] g2[4] b0[6:0] \
        b3[3] b3[5] b3[4] r1[5:0] g2[3:0] g1[5:0] g3[3:0] b1[5:0] b2[3:0] r2[5:0] r3[5:0]",
    ),
    (
        2,
        5,
        2,
        11,
        Some([5, 4, 4]),
        "r0[9:0] g0[9:0] b0[9:0] r1[4:0] r0[10] g2[3:0] g1[3:0] g0[10] b3[0] g3[3:0] \
        b1[3:0] b0[10] b3[1] b2[3:0] r2[4:0] b3[2] r3[4:0] b3[3]",
    ),
    (
        6,
        5,
        2,
        11,
        Some([4, 5, 4]),
        "r0[9:0] g0[9:0] b0[9:0] r1[3:0] r0[10] g3[4] g2[3:0] g1[4:0] g0[10] g3[3:0] \
        b1[3:0] b0[10] b3[1] b2[3:0] r2[3:0] b3[0] b3[2] r3[3:0] g2[4] b3[3]",
    ),
    (
        10,
        5,
        2,
        11,
        Some([4, 4, 5]),
        "r0[9:0] g0[9:0] b0[9:0] r1[3:0] r0[10] b2[4] g2[3:0] g1[3:0] g0[10] b3[0] \
        g3[3:0] b1[4:0] b0[10] b2[3:0] r2[3:0] b3[1] b3[2] r3[3:0] b3[4] b3[3]",
    ),
    (
        14,
        5,
        2,
        9,
        Some([5, 5, 5]),
        "r0[8:0] b2[4] g0[8:0] g2[4] b0[8:0] b3[4] r1[4:0] g3[4] g2[3:0] g1[4:0] b3[0] \
        g3[3:0] b1[4:0] b3[1] b2[3:0] r2[4:0] b3[2] r3[4:0] b3[3]",
    ),
    (
        18,
        5,
        2,
        8,
        Some([6, 5, 5]),
        "r0[7:0] g3[4] b2[4] g0[7:0] b3[2] g2[4] b0[7:0] b3[3] b3[4] r1[5:0] g2[3:0] \
        g1[4:0] b3[0] g3[3:0] b1[4:0] b3[1] b2[3:0] r2[5:0] r3[5:0]",
    ),
    (
        22,
        5,
        2,
        8,
        Some([5, 6, 5]),
        "r0[7:0] b3[0] b2[4] g0[7:0] g2[5] g2[4] b0[7:0] g3[5] b3[4] r1[4:0] g3[4] \
        g2[3:0] g1[5:0] g3[3:0] b1[4:0] b3[1] b2[3:0] r2[4:0] b3[2] r3[4:0] b3[3]",
    ),
    (
        26,
        5,
        2,
        8,
        Some([5, 5, 6]),
        "r0[7:0] b3[1] b2[4] g0[7:0] b2[5] g2[4] b0[7:0] b3[5] b3[4] r1[4:0] g3[4] \
        g2[3:0] g1[4:0] b3[0] g3[3:0] b1[5:0] b2[3:0] r2[4:0] b3[2] r3[4:0] b3[3]",
    ),
    (
        30,
        5,
        2,
        6,
        None,
        "r0[5:0] g3[4] b3[0] b3[1] b2[4] g0[5:0] g2[5] b2[5] b3[2] g2[4] b0[5:0] g3[5] b3[3] b3[5] \
        b3[4] r1[5:0] g2[3:0] g1[5:0] g3[3:0] b1[5:0] b2[3:0] r2[5:0] r3[5:0]",
    ),
    (3, 5, 1, 10, None, "r0[9:0] g0[9:0] b0[9:0] r1[9:0] g1[9:0] b1[9:0]"),
    (7, 5, 1, 11, Some([9, 9, 9]), "r0[9:0] g0[9:0] b0[9:0] r1[8:0] r0[10] g1[8:0] g0[10] b1[8:0] b0[10]"),
    (
        11,
        5,
        1,
        12,
        Some([8, 8, 8]),
        "r0[9:0] g0[9:0] b0[9:0] r1[7:0] r0[10:11] g1[7:0] g0[10:11] b1[7:0] b0[10:11]",
    ),
    (
        15,
        5,
        1,
        16,
        Some([4, 4, 4]),
        "r0[9:0] g0[9:0] b0[9:0] r1[3:0] r0[10:15] g1[3:0] g0[10:15] b1[3:0] b0[10:15]",
    ),
];

/// The modes, those of two subsets first.
pub(super) static MODES: LazyLock<Vec<Mode>> = LazyLock::new(|| {
    let mode = |(code, code_bits, subsets, precision, delta, layout): Row| {
        let bits = layout.split_whitespace().flat_map(run).collect();
        Mode { code, code_bits, subsets, precision, delta, bits }
    };
    ROWS.into_iter().map(mode).collect()
});

/// The bits of `r1[4:0]`, lowest in the block first.
fn run(token: &str) -> Vec<(u8, u8, u8)> {
    let name = token.as_bytes();
    let channel = b"rgb".iter().position(|c| *c == name[0]).unwrap_or(0) as u8;
    let endpoint = name[1] - b'0';
    let number = |t: &str| t.parse::<u8>().unwrap_or(0);
    let (first, last) = token[3..token.len() - 1].split_once(':').map_or_else(
        || (number(&token[3..token.len() - 1]), number(&token[3..token.len() - 1])),
        |(last, first)| (number(first), number(last)),
    );
    let all: Vec<u8> = if first <= last { (first..=last).collect() } else { (last..=first).rev().collect() };
    all.into_iter().map(|bit| (endpoint, channel, bit)).collect()
}

/// Texels of subset 1, bit i for texel i, row by row.
pub(super) const SHAPES: [u16; 32] = [
    0xcccc, 0x8888, 0xeeee, 0xecc8, 0xc880, 0xfeec, 0xfec8, 0xec80, 0xc800, 0xffec, 0xfe80, 0xe800, 0xffe8,
    0xff00, 0xfff0, 0xf000, 0xf710, 0x008e, 0x7100, 0x08ce, 0x008c, 0x7310, 0x3100, 0x8cce, 0x088c, 0x3110,
    0x6666, 0x366c, 0x17e8, 0x0ff0, 0x718e, 0x399c,
];

/// The texel of subset 1 whose index has one bit less.
pub(super) const ANCHORS: [usize; 32] = [
    15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 2, 8, 2, 2, 8, 8, 15, 2, 8, 2, 2, 8,
    8, 2, 2,
];

/// Sixty-fourths of the last endpoint, by index of four bits.
pub(super) const WEIGHTS16: [i32; 16] = [0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64];

/// The eight weights of two subsets, with eight that are not used.
pub(super) const PADDED: [i32; 16] = [0, 9, 18, 27, 37, 46, 55, 64, 0, 0, 0, 0, 0, 0, 0, 0];

/// Sixty-fourths of the last endpoint, by index.
pub(super) fn weights(subsets: usize) -> &'static [i32] {
    if subsets == 2 { &PADDED[..8] } else { &WEIGHTS16 }
}

/// Bits of an index.
pub(super) fn index_bits(subsets: usize) -> u32 {
    if subsets == 2 { 3 } else { 4 }
}

/// A stored endpoint on the scale of interpolation: 0 … 65535, or −32767 … 32767.
pub(super) fn unquantise(q: i32, precision: u32, signed: bool) -> i32 {
    if signed {
        let s = q.abs();
        let v = match s {
            _ if precision >= 16 => s.min(0x7fff),
            0 => 0,
            s if s >= (1 << (precision - 1)) - 1 => 0x7fff,
            s => ((s << 15) + 0x4000) >> (precision - 1),
        };
        return v * q.signum();
    }
    match q {
        q if precision >= 15 => q,
        0 => 0,
        q if q == (1 << precision) - 1 => 0xffff,
        q => ((q << 16) + 0x8000) >> precision,
    }
}

/// Between two endpoints.
pub(super) fn interpolate(a: i32, b: i32, weight: i32) -> i32 {
    (a * (64 - weight) + b * weight + 32) >> 6
}

/// A value on the scale of interpolation as the bits of a half, negative ones as the negative of their
/// magnitude's.
pub(super) fn finish(v: i32, signed: bool) -> i32 {
    // All ones for negative values: no branch.
    let sign = v >> 31;
    let magnitude = (v ^ sign) - sign;
    let h = (31 * magnitude) >> if signed { 5 } else { 6 };
    (h ^ sign) - sign
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mode_spends_its_bits_once() {
        for (i, m) in MODES.iter().enumerate() {
            let end = if m.subsets == 2 { 77 } else { 65 };
            assert_eq!(m.code_bits as usize + m.bits.len(), end, "mode {i}");
            let mut seen = m.bits.clone();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), m.bits.len(), "mode {i}");
            for e in 0..2 * m.subsets {
                for c in 0..3 {
                    let n = m.bits.iter().filter(|b| (b.0 as usize, b.1 as usize) == (e, c)).count() as u32;
                    assert_eq!(n, m.delta.filter(|_| e > 0).map_or(m.precision, |d| d[c]), "mode {i}");
                }
            }
        }
        assert_eq!(run("r0[10:11]"), [(0, 0, 11), (0, 0, 10)]);
    }

    #[test]
    fn the_anchor_lies_in_its_subset() {
        for (shape, anchor) in SHAPES.iter().zip(ANCHORS) {
            assert_eq!((shape & 1, shape >> anchor & 1), (0, 1));
        }
    }

    #[test]
    fn the_ends_of_the_scale() {
        assert_eq!(finish(unquantise(1023, 10, false), false), 0x7bff);
        assert_eq!(finish(unquantise(-511, 10, true), true), -0x7bff);
        assert_eq!(finish(unquantise(0, 6, false), false), 0);
        assert_eq!(interpolate(-3, -3, 30), -3);
    }
}
