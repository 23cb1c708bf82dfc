//! What the fuzz targets share.

use steradian_formats::Limits;

/// Limits small enough that a fuzzer's memory bound never trips on an honest allocation.
pub fn limits() -> Limits {
    Limits { max_side: 4096, max_memory: 256 << 20, max_ratio: 20_000 }
}
