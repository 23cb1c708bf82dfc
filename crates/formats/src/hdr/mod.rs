//! Radiance pictures (`.hdr`, `.pic`): Ward, *Real Pixels*, Graphics Gems II (1991), and Radiance's `color.c`
//! and `resolu.c`.
//!
//! - Pixels decode as (m + 0.5)·2^(e − 136), e = 0 as zero.
//! - Radiance = pixel / Π EXPOSURE / Π COLORCORR; the lines accumulate.
//!   A line of zeros, which some programs write where they know nothing, is ignored.
//! - `32-bit_rle_xyze` holds CIE XYZ with Y in lm sr⁻¹ m⁻²: XYZ / 179 lm W⁻¹ (Radiance's `WHTEFFICACY`), then
//!   the Rec. 709 matrix without adaptation.
//! - A PRIMARIES line other than Rec. 709's or Radiance's own default converts to Rec. 709, adapted to its
//!   white. Radiance's default primaries are taken as Rec. 709, as every other tool does.
//! - Every one of the eight orientations is turned upright.
//!
//! The writer makes new run-length scan lines (flat ones where the width forbids them), top row first.

mod decode;
mod encode;
mod header;

pub(crate) use decode::decode;
pub(crate) use encode::{encode, round_trip};

/// Does `bytes` begin like a Radiance picture?
pub(crate) fn is_hdr(bytes: &[u8]) -> bool {
    bytes.starts_with(b"#?")
}

/// Widths that new run-length scan lines can hold.
const NEW_RLE: std::ops::RangeInclusive<usize> = 8..=0x7fff;
