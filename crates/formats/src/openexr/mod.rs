//! OpenEXR, through the crate `exr`: its header parser and its codecs. The container's chunks are walked
//! here, in file order and without the offset table, so that nothing is allocated before it is checked,
//! broken tables do not matter, and planes of f32 are filled straight from the file.
//!
//! - Samples: half, float, uint. Scan lines and tiles; of mip and rip maps the full resolution. All parts of
//!   multi-part files, and layers that dots in channel names make.
//! - The image is the display window: what a smaller data window leaves out is zero, overscan is cut off.
//! - `chromaticities` other than Rec. 709's convert to Rec. 709, adapted to its white.
//! - Refused: deep data, subsampled (luminance/chroma) channels, HTJ2K.
//!
//! The codecs see only blocks whose size has been checked. They are another's code and may panic on damaged
//! data; `catch_unwind` turns that into an error, as a last resort.

mod attributes;
mod decode;
mod encode;
mod scan;
mod select;

pub(crate) use decode::decode;
pub(crate) use encode::encode;

const MAGIC: [u8; 4] = 20_000_630u32.to_le_bytes();

/// Does `bytes` begin like an OpenEXR file?
pub(crate) fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// Runs foreign code; a panic there becomes an error.
fn guarded<T>(body: impl FnOnce() -> exr::error::Result<T>) -> Result<T, String> {
    match std::panic::catch_unwind(std::panic::AssertUnwindSafe(body)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(e)) => Err(describe(&e)),
        Err(_) => Err("the data is damaged".into()),
    }
}

/// The library's error on one line.
fn describe(error: &exr::error::Error) -> String {
    use exr::error::Error::{Aborted, Invalid, Io, NotSupported};
    let text = match error {
        Invalid(what) if what.contains("missing bytes") => "truncated".into(),
        Invalid(what) => format!("damaged: {what}"),
        NotSupported(what) => format!("not supported: {what}"),
        Io(e) => crate::atomic::plain(e),
        Aborted => "aborted".into(),
    };
    text.replace(['\n', '\r'], " ")
}
