#![no_main]

use libfuzzer_sys::fuzz_target;
use steradian_fuzz::reflectance;

/// Numbers of a table, and those of its second material that count.
const NUMBERS: usize = 256 * 512 * 3;
const ROW: usize = 512 * 3;

// A table has one size. The input is the second material's row of one that holds ones; with a first byte of 0 what follows is
// the whole file.
fuzz_target!(|bytes: &[u8]| {
    let mut table;
    let file = match bytes {
        [0, file @ ..] => file,
        _ => {
            table = 1f32.to_le_bytes().repeat(NUMBERS);
            let n = bytes.len().min(4 * ROW);
            table[4 * ROW..][..n].copy_from_slice(&bytes[..n]);
            &table
        }
    };
    reflectance("npf", &[("a.bin", file), ("npf_material_names.txt", b"one\ntwo\n")], ",two");
});
