#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use std::sync::Mutex;
use steradian_formats::{NPF_BYTES, NPF_COLUMNS, decode_npf};
use steradian_fuzz::limits;

const ROW: usize = 12 * NPF_COLUMNS;

/// A table has one size: one of zeros, whose second row is the input.
static TABLE: Mutex<Vec<u8>> = Mutex::new(Vec::new());

// With a first byte of 0 what follows is the whole file.
fuzz_target!(|bytes: &[u8]| {
    if let [0, file @ ..] = bytes {
        let _ = decode_npf(Path::new("f.bin"), file, 1, &limits());
        return;
    }
    let mut table = TABLE.lock().expect("no other thread");
    table.resize(NPF_BYTES as usize, 0);
    let n = bytes.len().min(ROW);
    table[ROW..2 * ROW].fill(0);
    table[ROW..][..n].copy_from_slice(&bytes[..n]);
    if let Ok(columns) = decode_npf(Path::new("f.bin"), &table, 1, &limits()) {
        assert!(columns.len() == NPF_COLUMNS && columns.iter().flatten().all(|v| v.is_finite()));
    }
});
