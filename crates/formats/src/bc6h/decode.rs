//! Blocks to texels.

use super::modes::{
    ANCHORS, Endpoints, MODES, Mode, SHAPES, finish, index_bits, interpolate, unquantise, weights,
};

/// The sixteen colours of a block as bits of halves; black for the four reserved codes.
pub(super) fn block(block: u128, signed: bool) -> [[u16; 3]; 16] {
    let mut out = [[0; 3]; 16];
    let Some((mode, q)) = endpoints(block, signed) else { return out };
    let ends = q.map(|e| e.map(|q| unquantise(q, mode.precision, signed)));
    let two = mode.subsets == 2;
    let shape = if two { (block >> 77 & 31) as usize } else { 0 };
    let mut rest = block >> if two { 82 } else { 65 };
    for (i, texel) in out.iter_mut().enumerate() {
        let subset = if two { usize::from(SHAPES[shape] >> i & 1) } else { 0 };
        let anchor = i == 0 || (two && i == ANCHORS[shape]);
        let bits = index_bits(mode.subsets) - u32::from(anchor);
        let index = rest & ((1 << bits) - 1);
        rest >>= bits;
        let w = weights(mode.subsets)[index as usize];
        for (c, out) in texel.iter_mut().enumerate() {
            let v = interpolate(ends[2 * subset][c], ends[2 * subset + 1][c], w);
            let h = finish(v, signed);
            *out = h.unsigned_abs() as u16 | if h < 0 { 0x8000 } else { 0 };
        }
    }
    out
}

/// The mode and the endpoints, differences resolved.
fn endpoints(block: u128, signed: bool) -> Option<(&'static Mode, Endpoints)> {
    let low = block as u32;
    let mode = MODES.iter().find(|m| low & ((1 << m.code_bits) - 1) == m.code)?;
    let mut e = Endpoints::default();
    for (at, &(endpoint, channel, bit)) in mode.bits.iter().enumerate() {
        e[endpoint as usize][channel as usize] |=
            ((block >> (mode.code_bits as usize + at) & 1) as i32) << bit;
    }
    let p = mode.precision;
    if signed {
        e[0] = e[0].map(|q| extend(q, p));
    }
    let first = e[0];
    for q in &mut e[1..2 * mode.subsets] {
        for (c, q) in q.iter_mut().enumerate() {
            if let Some(d) = mode.delta {
                *q = (first[c] + extend(*q, d[c])) & ((1 << p) - 1);
            }
            if signed {
                *q = extend(*q, p);
            }
        }
    }
    Some((mode, e))
}

/// The lowest `bits` bits as a signed number.
fn extend(q: i32, bits: u32) -> i32 {
    q << (32 - bits) >> (32 - bits)
}
